"""A scenario file as models: they are the syntax tree of the YAML part; expressions inside stay text."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from socialai_dsl.schema.base import Expression, Model, Word, _as_tuple
from socialai_dsl.schema.behaviour import CastMember, Frame
from socialai_dsl.schema.world import ObjectGroup, Observe, Room, UtteranceGrammar

Primitive = Literal["left", "right", "forward", "pickup", "drop", "toggle", "done"]
PRIMITIVES: tuple[Primitive, ...] = ("left", "right", "forward", "pickup", "drop", "toggle", "done")
"""The agent's body actions in the order of the paper (appendix, action space)."""


class Outcome(Model):
    """One way the episode ends: exactly one of `success` and `failure`."""

    success: Expression | None = None
    failure: Expression | None = None
    reward: int = Field(100, ge=0, le=100, description="per cent of the success reward")
    id: Word | None = None


class Parameter(Model):
    """A parameter of the file, used as $name."""

    default: int | bool | float | str
    values: list[int | bool | float | str] | dict[str, int | bool | float | str] | None = None


class Scenario(Model):
    """One environment: a room with objects, a cast that follows frames, and an outcome."""

    scenario: Word
    abstract: bool = False
    about: str | None = None
    notes: str | None = None
    skills: Annotated[tuple[str, ...], BeforeValidator(_as_tuple)] = ()
    horizon: int = Field(100, ge=1, le=10_000, description="the episode ends at t == horizon")
    earshot: Expression = Field("next_to", description="next_to, room, or a Manhattan distance")
    actions: Annotated[tuple[Primitive, ...], BeforeValidator(_as_tuple)] = Field(PRIMITIVES, min_length=1)
    params: dict[Word, int | bool | float | str | Parameter] = Field(default_factory=dict)
    grammar: UtteranceGrammar
    room: Room
    order: Annotated[tuple[Word, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="order of placement"
    )
    objects: dict[Word, ObjectGroup] = Field(default_factory=dict)
    let: dict[Word, Expression] = Field(
        default_factory=dict, description="drawn or computed once per episode"
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    frames: dict[Word, Frame] = Field(default_factory=dict)
    npc_defaults: CastMember = CastMember()
    cast: dict[Word, CastMember]
    outcome: Annotated[tuple[Outcome, ...], BeforeValidator(_as_tuple)] = Field(min_length=1)
    observe: Observe = Observe()

    def members(self) -> dict[str, CastMember]:
        """The cast with `npc_defaults` filled in (they do not apply to the agent), in the order written."""
        return {
            name: member if name == "agent" else member.over(self.npc_defaults)
            for name, member in self.cast.items()
        }

    def npcs(self) -> dict[str, CastMember]:
        """The members other than the agent, in the order they act."""
        return {name: member for name, member in self.members().items() if name != "agent"}

    def __repr__(self) -> str:
        return f"<Scenario {self.scenario}: {len(self.npcs())} NPCs, {len(self.frames)} frames, horizon {self.horizon}>"
