"""A scenario file as models: they are the syntax tree of the YAML part; expressions inside stay text."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints

from socialai_dsl.schema.base import Expression, ExpressionOrText, Model, Prose, Word, _as_tuple, as_written
from socialai_dsl.schema.behaviour import (
    CastMember,
    Character,
    Frame,
    Probability,
    Ranged,
    Role,
    WorldRule,
    WrittenCast,
)
from socialai_dsl.schema.properties import Probe, Property
from socialai_dsl.schema.world import ObjectGroup, Observe, Room, UtteranceGrammar
from socialai_dsl.vocabulary import PRIMITIVES, Primitive

"""The agent's body actions in the order of the paper (appendix, action space)."""


MemberName = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\[[0-9]+\])?$", max_length=40)
]
"""A member of the cast; those of a group are numbered from 0: `peers[0]`."""


class Outcome(Model):
    """One way the episode ends: exactly one of `success` and `failure`."""

    success: Expression | None = Field(
        None, description="a condition that ends the episode well", examples=["agent.at(exit)"]
    )
    failure: Expression | None = Field(None, description="a condition that ends the episode badly")
    reward: Expression = Field(100, description="per cent of the success reward; computed when it ends")
    id: Word | None = Field(None, description="names the outcome in figures, `check` and patches")


class Reward(Model):
    """What is earned: linear(s) is 1 - s t / horizon at success; `each_step` is added to every reward."""

    success: str = Field("linear(0.9)", description="linear(s), the part s that is lost by the horizon")
    each_step: Annotated[float, BeforeValidator(lambda v: float(v) if type(v) is int else v)] = Field(
        0.0, ge=-1, le=1, description="added to the reward of every step"
    )


class SungWith(Model):
    """When the elements of a sequence are accompanied by an utterance."""

    chance: Probability = Field(
        description="of an utterance, drawn uniformly from the grammar, for each element"
    )


class Sequence(Model):
    """A sequence of acts, drawn at reset: each element has a move and perhaps an utterance."""

    sequence: int = Field(ge=1, le=16, description="how many elements")
    moves: Annotated[tuple[Primitive, ...], BeforeValidator(_as_tuple)] = Field(
        min_length=1, description="what each move is drawn from"
    )
    utterance: SungWith | None = Field(None, description="default: silent")


class Memory(Model):
    """What the agent did last, to be compared with a sequence."""

    last: int = Field(ge=1, le=16, description="how many acts it holds")
    of: Literal["agent.acts"] = Field("agent.acts", description="moves and utterances of the agent")
    while_: Expression | None = Field(
        None, alias="while", description="only steps at whose start this held; default all"
    )


class Parameter(Model):
    """A parameter of the file, used as $name."""

    default: int | bool | float | str = Field(description="its value unless `?name=value` gives another")
    values: list[int | bool | float | str] | dict[str, int | bool | float | str] | None = Field(
        None, description="what it may be: a list, or label: value"
    )


class Scenario(Model):
    """One environment: a room with objects, a cast that follows frames, and an outcome."""

    scenario: Word = Field(description="the name of the scenario")
    abstract: bool = Field(False, description="others build on it by `extends`; it cannot be run itself")
    about: Prose | None = Field(None, description="one sentence for people")
    notes: Prose | None = Field(None, description="more for people")
    skills: Annotated[tuple[Prose, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="what it asks of an agent, for people"
    )
    horizon: int = Field(100, ge=1, le=10_000, description="the episode ends at t == horizon")
    earshot: Expression = Field("next_to", description="next_to, room, or a Manhattan distance")
    actions: Annotated[tuple[Primitive, ...], BeforeValidator(_as_tuple)] = Field(
        PRIMITIVES, min_length=1, description="the agent's body actions; default all seven"
    )
    params: dict[Word, int | bool | float | str | Parameter] = Field(
        default_factory=dict,
        description="name: default of parameters, used as $name and given as ?name=value",
    )
    grammar: Annotated[UtteranceGrammar, as_written(UtteranceGrammar | Word)] = Field(
        description="what the agent can say: written out, or the name of a grammar that all can use"
    )
    room: Room = Field(description="the walled room", examples=[{"size": "5..8"}])
    order: Annotated[tuple[Word, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="order of placement"
    )
    objects: dict[Word, ObjectGroup] = Field(
        default_factory=dict,
        description="name: what lies in the room",
        examples=[{"exit": {"type": "door", "place": "wall(top)"}}],
    )
    let: dict[Word, Expression | Sequence] = Field(
        default_factory=dict, description="drawn or computed once per episode"
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    state: dict[Word, Expression | Ranged] = Field(
        default_factory=dict, description="registers of the world, set by rules and by any frame"
    )
    tables: dict[Word, dict[str, ExpressionOrText] | str] = Field(
        default_factory=dict, description="name: {key: value}, or permuted(table): name(key) looks a value up"
    )
    memory: dict[Word, Memory] = Field(default_factory=dict, description="what the agent did last")
    frames: dict[Word, Frame] = Field(
        default_factory=dict, description="name: protocol of interaction, which members of the cast follow"
    )
    roles: dict[Word, Role] = Field(default_factory=dict, description="parts that members of the cast play")
    npc_defaults: Character = Field(Character(), description="what NPCs have that do not say otherwise")
    cast: Annotated[dict[MemberName, CastMember], as_written(WrittenCast)] = Field(
        description="who is in the room: the `agent` and the NPCs by name",
        examples=[{"guide": {"frame": "show_the_way"}, "agent": {"place": "anywhere"}}],
    )
    rules: Annotated[tuple[WorldRule, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="rules about the world, read once a step; each that holds takes effect"
    )
    outcome: Annotated[tuple[Outcome, ...], BeforeValidator(_as_tuple)] = Field(
        min_length=1, description="read top to bottom after every step; the first that holds ends the episode"
    )
    reward: Reward = Field(Reward(), description="what is earned")
    observe: Observe = Field(Observe(), description="what the agent perceives")
    require: Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="conditions on the drawn room, which is drawn again while one is false"
    )
    check: Annotated[tuple[Property, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="properties that `socialai check` verifies; playing never reads them"
    )
    probes: dict[Word, Probe] = Field(
        default_factory=dict,
        max_length=64,
        description="name: a question to language models; playing never reads them",
    )

    def members(self) -> dict[str, CastMember]:
        """The cast in the order written, each as its first alternative (`alternatives`)."""
        return {name: self.alternatives(name)[0] for name in self.cast}

    def alternatives(self, name: str) -> tuple[CastMember, ...]:
        """What a member can be, one for each file of its `one_of`, else one.

        What it leaves out comes from the file, then from its role (not the frame, for the agent: a role drives NPCs
        only), then, for NPCs, from `npc_defaults`.
        """
        member = self.cast[name]
        drawn = [member.over(file) for file in member.one_of or ()] or [member]
        role = self.roles.get(member.role) if member.role is not None else None
        if role is not None:
            drawn = [one.over(role) for one in drawn]
        if name != "agent":
            return tuple(one.over(self.npc_defaults) for one in drawn)
        if role is not None and member.frame is None:
            drawn = [one.model_copy(update={"frame": None}) for one in drawn]
        return tuple(drawn)

    def npcs(self) -> dict[str, CastMember]:
        """The members other than the agent, in the order they act."""
        return {name: member for name, member in self.members().items() if name != "agent"}

    def __repr__(self) -> str:
        return f"<Scenario {self.scenario}: {len(self.npcs())} NPCs, {len(self.frames)} frames, horizon {self.horizon}>"
