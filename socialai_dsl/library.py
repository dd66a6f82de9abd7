"""The prelude: object types and utterance grammars that every scenario can use."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from socialai_dsl.loader.reader import read_document
from socialai_dsl.schema.scenario import Model, UtteranceGrammar, Word
from socialai_dsl.semantics.entities import Prelude
from socialai_dsl.semantics.terms import COLOR, ObjectType
from socialai_dsl.source import Data

_FOLDER = Path(__file__).parent / "prelude"

Statuses = Annotated[tuple[Word, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]
Channels = Annotated[tuple[int, int], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]


class ObjectTypeModel(Model):
    """An object type as it is written in a library."""

    code: int = Field(ge=0, le=255, description="its number in the type channel of the view")
    states: Statuses = Field(
        min_length=1, description="its statuses; the first is the initial one by default"
    )
    initial: Word | None = Field(None, description="the initial status")
    walkable: Statuses = Field((), description="statuses in which it can be entered")
    transparent: Statuses = Field((), description="statuses in which it can be seen through")
    toggled: dict[Word, Word] = Field(
        default_factory=dict, description="status: the status that a toggle makes of it"
    )
    deadly: bool = Field(False, description="entering it ends the episode")
    active: Statuses = Field((), description="statuses in which it works on what it `unlocks` or `opens`")
    pushed: dict[Word, Word] = Field(
        default_factory=dict, description="status: the status that a push makes of it"
    )
    rolls: Statuses = Field(
        (), description="statuses in which it moves by itself until something is in its way"
    )
    expired: dict[Word, Word] = Field(
        default_factory=dict, description="active status: the status when its timer has run out"
    )
    shown: dict[Word, Channels] = Field(
        default_factory=dict, description="status: what the status and orientation channels show"
    )
    color: Word = Field("random", description="where a scenario gives none")
    look: Word | None = Field(None, description="what it is drawn as; its own name by default")
    letters: str = Field(
        min_length=1, description="of text pictures, one for each status; the last serves the rest"
    )
    mark: str | None = Field(
        None,
        max_length=1,
        description="before its letter, in place of its colour's, where it has its own colour",
    )

    def compiled(self, name: str) -> ObjectType:
        """The type with statuses as numbers."""
        number = self.states.index
        return ObjectType(
            name=name,
            code=self.code,
            states=self.states,
            initial=number(self.initial) if self.initial else 0,
            walkable=frozenset(map(number, self.walkable)),
            transparent=frozenset(map(number, self.transparent)),
            toggled={number(before): number(after) for before, after in self.toggled.items()},
            deadly=self.deadly,
            color=COLOR.words.index(self.color) if self.color in COLOR.words else 0,
            active=frozenset(map(number, self.active)),
            pushed={number(before): number(after) for before, after in self.pushed.items()},
            rolls=frozenset(map(number, self.rolls)),
            expired={number(before): number(after) for before, after in self.expired.items()},
            shown={number(status): channels for status, channels in self.shown.items()},
            look=self.look or name,
            letters=self.letters,
            mark=self.mark,
        )


class ObjectLibrary(Model):
    """A file of object types."""

    library: Literal["objects"] = Field(description="what this file is a library of")
    types: dict[Word, ObjectTypeModel] = Field(description="name: object type")


class GrammarLibrary(Model):
    """A file of utterance grammars."""

    library: Literal["grammars"] = Field(description="what this file is a library of")
    grammars: dict[Word, UtteranceGrammar] = Field(description="name: what an agent can say")


@cache
def prelude() -> Prelude:
    """The object types that come with the language."""
    library = ObjectLibrary.model_validate(read_document(_FOLDER / "objects.yaml").data)
    return Prelude(
        {name: model.compiled(name) for name, model in library.types.items()},
        {name: model.color for name, model in library.types.items()},
    )


@cache
def types_by_code() -> dict[int, ObjectType]:
    """The object types by their number in the type channel."""
    return {type_.code: type_ for type_ in prelude().types.values()}


@cache
def shared_grammars() -> dict[str, Data]:
    """The grammars that a scenario can name, as plain data."""
    document = read_document(_FOLDER / "grammars.yaml")
    GrammarLibrary.model_validate(document.data)
    return {str(name): grammar.data for name, grammar in document.at(("grammars",)).items()}
