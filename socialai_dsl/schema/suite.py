"""A suite file as models: several scenarios, one of which is played in each episode."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag

from socialai_dsl.schema.base import Model, Word, _as_tuple
from socialai_dsl.schema.scenario import Primitive
from socialai_dsl.schema.world import UtteranceGrammar

MemberName = Annotated[str, Field(min_length=1, max_length=200)]
"""The path of a scenario, relative to the suite's file, with variants and parameters."""

MemberNames = Annotated[tuple[MemberName, ...], BeforeValidator(_as_tuple)]


def _form(value: Any) -> str:
    return "written out" if isinstance(value, dict | UtteranceGrammar | list | tuple) else "word"


class Split(Model):
    """Other members than the suite's own: some replaced, or all written anew."""

    replace: dict[MemberName, MemberName] = Field(
        default_factory=dict, description="member -> what is played in its place"
    )
    members: MemberNames | None = Field(None, min_length=1, max_length=64)


class Suite(Model):
    """Several scenarios with one action space; each episode plays one of them."""

    suite: Word
    about: str | None = None
    notes: str | None = None
    skills: Annotated[tuple[str, ...], BeforeValidator(_as_tuple)] = ()
    draw: Literal["uniform"] = Field("uniform", description="how the member of an episode is chosen")
    members: MemberNames = Field(min_length=1, max_length=64)
    grammar: Annotated[
        Annotated[Literal["union", "concat"], Tag("word")] | Annotated[UtteranceGrammar, Tag("written out")],
        Discriminator(_form),
    ] = Field("union", description="union: each text once; concat: one behind the other; or written out")
    actions: Annotated[
        Annotated[Literal["union"], Tag("word")]
        | Annotated[tuple[Primitive, ...], BeforeValidator(_as_tuple), Tag("written out")],
        Discriminator(_form),
    ] = Field("union", description="the body actions in every member")
    splits: dict[Word, Split] = Field(default_factory=dict, description="chosen by ?split=NAME")
