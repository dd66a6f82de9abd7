"""A suite file as models: several scenarios, one of which is played in each episode."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, JsonValue, StringConstraints, Tag

from socialai_dsl.schema.holds import Holds
from socialai_dsl.schema.scenario import WORD_SCHEMA, ListOf, Model, Prose, UtteranceGrammar, Word, as_written
from socialai_dsl.vocabulary import Primitive

MemberName = Annotated[str, Field(min_length=1, max_length=200), Holds("file")]
"""The path of a scenario, relative to the suite's file, with variants and parameters."""

MemberNames = ListOf[MemberName]


def _form(value: Any) -> str:
    return "written out" if isinstance(value, dict | UtteranceGrammar | list | tuple) else "word"


Label = Annotated[str, StringConstraints(pattern=r"^[^,=\[\]]+$", max_length=80)]
"""A value of a tree's parameter, as people call it."""

_Chosen = Annotated[str | int | float | bool, Holds("label", beside=(bool, int, float))]
Labels = _Chosen | ListOf[_Chosen]

Patch = Annotated[dict[str, JsonValue], Holds("patch")]
"""Path in a scenario -> value."""


class Changes(Model):
    """A suite's changes of a scenario, like a variant's, and the start of its episodes."""

    set: Patch = Field(default_factory=dict, description="path: its new value, as in a variant")
    remove: ListOf[Annotated[str, Holds("spelt")]] = Field((), description="paths of what is left out")
    add: Patch = Field(default_factory=dict, description="path of a list or mapping: what is added to it")
    layout: Annotated[dict[str, JsonValue], Holds("layout")] | None = Field(
        None, description="the known part of every episode's room; the rest is drawn"
    )


class Entry(Changes):
    """A member that the suite changes."""

    scenario: MemberName = Field(description="the scenario, with variants and parameters")
    name: Annotated[Word | None, as_written(Word | bool | None), Holds("label")] = Field(
        None, description="its name in the suite; default the scenario's name"
    )


class Value(Changes):
    """A value of a parameter in a tree; every other key is a parameter below it, which has a value as well."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"propertyNames": WORD_SCHEMA})
    __pydantic_extra__: dict[Word, Values]

    about: Prose | None = Field(None, description="one sentence for readers of the file")
    scenario: MemberName | None = Field(None, description="the scenario; deeper ones replace it")


Values = Annotated[
    Annotated[
        ListOf[Annotated[Label | int | float | bool, Holds("label", beside=(bool, int, float))]],
        Field(min_length=1),
        Tag("list"),
    ]
    | Annotated[dict[Label, Value], Field(min_length=1), Tag("mapping")],
    Discriminator(lambda value: "mapping" if isinstance(value, dict) else "list"),
]
"""The values of a parameter, of which an episode draws one: plain ones, or label -> what it means."""


class Split(Model):
    """Other members than the suite's own: some replaced, all written anew, or some leaves of its tree."""

    replace: dict[MemberName, MemberName] = Field(
        default_factory=dict, description="member -> its substitute"
    )
    members: MemberNames | None = Field(
        None, min_length=1, max_length=64, description="all members of this split"
    )
    only: dict[Word, Labels] | None = Field(
        None,
        description="parameter: value or values; the leaves that have one of the values of every parameter",
    )
    without: dict[Word, Labels] | None = Field(
        None, description="parameter: value or values; all leaves but those that `only` would choose"
    )


class Suite(Model):
    """Several scenarios with one action space; each episode plays one of them."""

    suite: Word = Field(description="the name of the suite")
    about: Prose | None = Field(None, description="one sentence for readers of the file")
    notes: Prose | None = Field(None, description="more for readers of the file")
    skills: ListOf[Prose] = Field((), description="the skills that it needs, for readers of the file")
    training_frames: int | None = Field(
        None,
        ge=1,
        description="the number of frames for which the recipe `guided` trains an agent; default 6000000",
    )
    draw: Literal["uniform", "in_sequence"] = Field(
        "uniform", description="`uniform`: an episode plays one member; `in_sequence`: all of them, as acts"
    )
    members: Annotated[ListOf[MemberName | Entry], Field(min_length=1, max_length=64)] | None = Field(
        None, description="scenarios by path, with variants and parameters, or changed ones"
    )
    sweep: dict[MemberName, Annotated[dict[str, ListOf[JsonValue]], Holds("patch")]] | None = Field(
        None, min_length=1, description="member: {path: values}; each combination is a member of its own"
    )
    tree: Value | None = Field(
        None, description="parameters with their values, in place of members; an episode plays a leaf"
    )
    grammar: Annotated[
        Annotated[Literal["union", "concat"], Tag("word")] | Annotated[UtteranceGrammar, Tag("written out")],
        Discriminator(_form),
    ] = Field(
        "union",
        description="`union`: each template and noun once, in the order of the members; `concat`: the "
        "grammars one behind the other; or written out",
    )
    actions: Annotated[
        Annotated[Literal["union"], Tag("word")] | Annotated[ListOf[Primitive], Tag("written out")],
        Discriminator(_form),
    ] = Field(
        "union",
        description="the body actions in every member, whatever its own `actions`: all that a member has, "
        "or a list",
    )
    splits: dict[Word, Split] = Field(
        default_factory=dict, description="name: other members, which `?split=NAME` chooses"
    )
    held_out: dict[Word, Labels] | None = Field(
        None,
        min_length=1,
        description="parameter: value or values of the tree that only a split plays whose `only` names them",
    )
