"""Libraries as models: object types, and grammars that every scenario can name."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from socialai_dsl.schema.holds import Holds
from socialai_dsl.schema.scenario import ListOf, Model, StateName, UtteranceGrammar, Word, _as_tuple

Statuses = ListOf[StateName]
Channels = Annotated[tuple[int, int], BeforeValidator(_as_tuple)]


class ObjectTypeModel(Model):
    """An object type as it is written in a library."""

    code: int = Field(ge=0, le=255, description="its number in the type channel of the view")
    states: Statuses = Field(
        min_length=1, description="its statuses; the first is the initial one by default"
    )
    initial: StateName | None = Field(None, description="the initial status")
    walkable: Statuses = Field((), description="statuses in which it can be entered")
    transparent: Statuses = Field((), description="statuses in which it can be seen through")
    toggled: dict[Word, StateName] = Field(
        default_factory=dict, description="status: the status that a toggle makes of it"
    )
    deadly: bool = Field(False, description="entering it ends the episode")
    active: Statuses = Field((), description="statuses in which it works on what it `unlocks` or `opens`")
    pushed: dict[Word, StateName] = Field(
        default_factory=dict, description="status: the status that a push makes of it"
    )
    rolls: Statuses = Field(
        (), description="statuses in which it moves by itself until something is in its way"
    )
    expired: dict[Word, StateName] = Field(
        default_factory=dict, description="active status: the status when its timer has run out"
    )
    shown: dict[Word, Channels] = Field(
        default_factory=dict, description="status: what the status and orientation channels show"
    )
    color: Annotated[Word, Holds("spelt")] = Field("random", description="where a scenario gives none")
    look: Annotated[Word, Holds("spelt")] | None = Field(
        None, description="what it is drawn as; its own name by default"
    )
    letters: Annotated[str, Holds("spelt")] = Field(
        min_length=1, description="of text pictures, one for each status; the last serves the rest"
    )
    mark: Annotated[str, Holds("spelt")] | None = Field(
        None,
        max_length=1,
        description="before its letter, in place of its colour's, where it has its own colour",
    )


class ObjectLibrary(Model):
    """A file of object types."""

    library: Literal["objects"] = Field(description="what this file is a library of")
    types: dict[Word, ObjectTypeModel] = Field(description="name: object type")


class GrammarLibrary(Model):
    """A file of utterance grammars."""

    library: Literal["grammars"] = Field(description="what this file is a library of")
    grammars: dict[Word, UtteranceGrammar] = Field(description="name: what an agent can say")
