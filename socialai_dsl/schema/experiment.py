"""An experiment file as models: agents, scenarios, seeds, and published figures."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_type_hints

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    ValidationError,
    create_model,
)

from socialai_dsl.errors import first_mistake
from socialai_dsl.model_options import ModelOptions, meanings
from socialai_dsl.schema.holds import Holds, branches
from socialai_dsl.schema.scenario import ListOf, Model, Prose, Word, _one_or_many, as_written
from socialai_dsl.schema.suite import MemberName
from socialai_dsl.trainer.config import BONUS_SCALES, FLAGS, HYPER, MOST_FRAMES, RunConfig

Label = Annotated[str, StringConstraints(min_length=1, max_length=80)]
"""A name for people: of a condition, a row, a column."""

Title = Annotated[Label, as_written(Label | float | bool), Holds("label")]
"""The same where it is a value."""

Titles = Annotated[
    ListOf[Title],
    BeforeValidator(_one_or_many, json_schema_input_type=Title | tuple[Title, ...]),
]

NETS: Final = ("fast", "relations", "speakers", "paper", "paper-reference", "paper-reference-tuned")
"""The networks and presets that ship, as `socialai-run --net` takes them."""

BONUSES: Final = ("none", "auto", *BONUS_SCALES)
"""The bonuses that ship, and the paper's choice for the scenario."""

AGENTS: Final = ("ppo", "random", "oracle")
"""The agents that are no checkpoint."""


class Reference(Model):
    """A published figure, which the report sets beside ours and compares with it; `std` requires `n`."""

    mean: float | int = Field(description="share of successful test episodes, mean over seeds", ge=0, le=1)
    std: float | int | None = Field(None, description="its standard deviation over seeds", ge=0, le=1)
    n: int | None = Field(None, description="the number of seeds", ge=2, le=10_000)
    deviation: Literal["sample", "population"] = Field(
        "sample", description="whether `std` divides by n − 1 (sample, the default) or by n (population)"
    )
    note: Prose | None = Field(None, description="a remark for the comparison")
    source: Prose | None = Field(None, description="the source of the figure")


class Transfer(Model):
    """A scenario that the trained agents play besides their own."""

    scenario: MemberName = Field(description="the scenario; the condition's `variants` apply to it as well")
    reference: Reference | None = Field(None, description="a published figure")


def _is_mapping(value: Any) -> str:
    return "mapping" if isinstance(value, dict | Model) else "word"


Test = Annotated[
    Annotated[MemberName, Tag("word")] | Annotated[Transfer, Tag("mapping")], Discriminator(_is_mapping)
]


def _made_optional(names: Iterable[str]) -> dict[str, Any]:
    """Fields of `RunConfig` as keys that may be left out: the same meaning, words and bounds."""
    fields: dict[str, Any] = {}
    for name in names:
        field = RunConfig.model_fields[name]
        annotation: Any = _WORDS.get(name, field.annotation)
        if annotation is float or annotation == float | None:
            annotation = float | int
        if str in branches(annotation):
            annotation = Annotated[annotation, Holds("spelt")]
        optional: Any = annotation | None
        bounded = Annotated[optional, *field.metadata] if field.metadata else optional
        fields[name] = (bounded, Field(None, description=field.description))
    return fields


_LEAST: Final[dict[str, Any]] = {
    "history": {"ge": 1},
    "max_tokens": {"ge": 1},
    "concurrency": {"ge": 1},
    "timeout": {"gt": 0},
}
"""The least that options of language models can be."""


def _asked() -> dict[str, Any]:
    """Fields of `ModelOptions` as keys that may be left out: the same meaning and words."""
    told = meanings()
    fields: dict[str, Any] = {}
    for name, annotation in get_type_hints(ModelOptions).items():
        if annotation is float or annotation == float | None:
            annotation = float | int
        if str in branches(annotation):
            annotation = Annotated[annotation, Holds("spelt")]
        fields[name] = (annotation | None, Field(None, description=told.get(name), **_LEAST.get(name, {})))
    return fields


_WORDS: Final[dict[str, Any]] = {"device": Literal["cpu", "cuda"]}
"""Options of which a file may say less than a command line."""

OPTIONS: Final = tuple(n for n in FLAGS if n not in ("agent", "seed", "frames", "wandb"))
"""Options that are keys of their own; every other one is a key of `hyper`."""

if TYPE_CHECKING:

    class Hyper(Model):
        """Options of the trainer that have no key of their own; what is left out is as the network has it."""

    class _RunOptions(Model):
        """Options of `socialai-run`."""

    class Asked(Model):
        """How a language model is asked; what is left out is as `socialai evaluate` has it."""

else:
    Hyper = create_model(
        "Hyper",
        __base__=Model,
        __doc__="Options of the trainer that have no key of their own; what is left out is as the network has it.",
        **_made_optional(HYPER),
    )
    _RunOptions = create_model("_RunOptions", __base__=Model, **_made_optional(OPTIONS))
    Asked = create_model(
        "Asked",
        __base__=Model,
        __doc__="How a language model is asked; what is left out is as `socialai evaluate` has it.",
        **_asked(),
    )


class Settings(_RunOptions):
    """Settings of runs; a key that is left out has the default of `socialai-run`."""

    scenario: MemberName | None = Field(
        None, description="a shipped name, or a path relative to this file; with variants and parameters"
    )
    variants: ListOf[Annotated[Word, Holds("spelt")]] | None = Field(
        None, description="variants applied to the scenario and to its tests"
    )
    agent: Annotated[str, StringConstraints(min_length=1, max_length=1000), Holds("spelt")] | None = Field(
        None,
        description="ppo (default), random, oracle, shipped:NAME, rival:NAME, llm:MODEL, or a checkpoint or run "
        "folder, relative to this file",
    )
    frames: int | None = Field(None, ge=1, le=MOST_FRAMES, description="frames to train for")
    seeds: (
        Annotated[int, Field(ge=1, le=10_000)]
        | Annotated[
            ListOf[Annotated[int, Field(ge=0, lt=2**63)]],
            Field(min_length=1, max_length=10_000),
        ]
        | None
    ) = Field(None, description="the number of seeds, from 0 on, or a list of seeds")
    tests: ListOf[Test] | None = Field(
        None, description="scenarios that the agents play besides their own when they are trained"
    )
    trials: int | None = Field(
        None,
        ge=1,
        le=500,
        description="how many test episodes in a row an agent that is not trained remembers",
    )
    model: Asked | None = Field(None, description="how a language model is asked")
    reference: Reference | None = Field(None, description="a published figure of the scenario itself")
    recipe: Literal["plain", "guided", "paper"] | None = Field(
        None,
        description="the way of learning; guided: the scenario's script shows the task first; default plain",
    )
    hyper: Hyper | None = Field(None, description="name: value of any other option of the trainer")


def one_setting(name: str, value: str | int) -> Settings | str:
    """The settings that hold this value alone, or what is wrong with it, in words."""
    try:
        return Settings.model_validate({name: value})
    except ValidationError as error:
        return first_mistake(error.errors())[1].partition(", got ")[0]  # the finding says the value itself


class Condition(Settings):
    """One cell of the experiment: an agent and a scenario, run once for each seed."""

    name: Title = Field(description="the condition's name; each has its own")
    group: Title | None = Field(None, description="conditions that are shown together")
    row: Title | None = Field(None, description="its row in the group's table; default its name")
    column: Title | None = Field(None, description="its column in the group's table; default the agent")


AxisValue = Annotated[
    Annotated[str | int, Tag("word"), Holds("value")] | Annotated[Settings, Tag("mapping")],
    Discriminator(_is_mapping),
]

Axis = Annotated[
    Annotated[ListOf[Annotated[str | int, Holds("value")]], Field(min_length=1, max_length=1000), Tag("list")]
    | Annotated[dict[Label, AxisValue], Field(min_length=1, max_length=1000), Tag("mapping")],
    Discriminator(lambda value: "mapping" if isinstance(value, dict) else "list"),
]
"""The values of one axis of a grid: those of the setting it is named after, or label -> value or several settings."""


class Grid(Model):
    """Every combination of the values of some axes is a condition; the first axis makes the rows of a table."""

    grid: dict[Label, Axis] = Field(
        min_length=1, max_length=8, description="axis: values; the axis `scenario`, for example"
    )
    group: Title | None = Field(None, description="conditions that are shown together")
    set: Settings | None = Field(None, description="settings of all of them")


ConditionOrGrid = Annotated[
    Annotated[Condition, Tag("condition")] | Annotated[Grid, Tag("grid")],
    Discriminator(
        lambda value: (
            "grid"
            if isinstance(value, Grid) or (isinstance(value, dict) and "grid" in value)
            else "condition"
        )
    ),
]
ConditionList = Annotated[ListOf[ConditionOrGrid], Field(max_length=1000)]


class Override(Model):
    """Other settings for some of the conditions."""

    where: dict[Label, Titles] = Field(
        min_length=1, description="name, row, column, group or an axis: its value, or a list of values"
    )
    set: Settings = Field(description="their settings")


OverrideList = Annotated[ListOf[Override], Field(max_length=1000)]


class Profile(Model):
    """A size in which the experiment can be run; it overrides everything else in the file."""

    about: Prose | None = Field(None, description="one sentence for readers of the file")
    set: Settings | None = Field(None, description="settings of all conditions of the file")
    overrides: OverrideList = Field((), description="other settings for some of them; later ones win")
    conditions: ConditionList = Field(
        (), description="conditions of this profile alone, which `set` is a default for"
    )


class Experiment(Model):
    """An experiment: agents on scenarios, each with its seeds."""

    experiment: Word = Field(description="the name of the experiment, and of its folder")
    about: Prose | None = Field(None, description="one sentence for readers of the file")
    notes: Prose | None = Field(None, description="more for readers of the file")
    set: Settings | None = Field(None, description="settings of all conditions, which each may override")
    conditions: Annotated[ConditionList, Field(min_length=1)] = Field(
        description="conditions and grids of them"
    )
    overrides: OverrideList = Field(
        (), description="other settings for some of the conditions; later ones win"
    )
    profile: Annotated[Word, Holds("name", ("profiles",))] | None = Field(
        None, description="the profile that is used where none is named"
    )
    profiles: dict[Word, Profile] = Field(default_factory=dict, description="sizes in which it can be run")
