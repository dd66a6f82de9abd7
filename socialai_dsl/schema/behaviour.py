"""Who acts and how: frames with their states, steps and rules, and the members of the cast."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from socialai_dsl.schema.base import (
    WORD_SCHEMA,
    Expression,
    ExpressionOrText,
    Expressions,
    Model,
    Prose,
    StateName,
    TextLine,
    Texts,
    Word,
    _as_tuple,
    as_written,
)

SlotType = Literal[
    "text", "utterance", "object", "npc", "direction", "color", "int", "bool", "noun", "cell", "sequence"
]

Probability = Annotated[
    float, BeforeValidator(lambda v: float(v) if type(v) is int else v), Field(ge=0, le=1)
]


class Effects(Model):
    """What a rule or a step does, in this order whatever the order in the file: do, set, cause, say, goto."""

    set: dict[Word, Expression] = Field(default_factory=dict, description="registers of the frame's `let`")
    cause: Expressions = Field((), description="effects on objects and on oneself, in order")
    say: TextLine | None = Field(
        None, description="a text to say; <...> puts a value in", examples=["The <exit.color> door"]
    )


class Rule(Effects):
    """Conditions, all of which must hold, and effects."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    hears: Texts = Field((), description="an utterance, or a list of alternatives")
    when: Expression | None = Field(None, description="a condition", examples=["eye_contact(agent)"])
    after: Expression | None = Field(None, description="holds from this turn in the state on")
    chance: Probability | None = Field(None, description="drawn anew each turn if everything else holds")
    once: bool = Field(False, description="once per episode and NPC")


class WorldRule(Model):
    """A rule about the world, read once a step after everybody has moved; each that holds takes effect."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    when: Expression | None = Field(None, description="a condition", examples=["eye_contact(agent)"])
    chance: Probability | None = Field(None, description="drawn anew each step if everything else holds")
    once: bool = Field(False, description="once per episode")
    set: dict[Word, Expression] = Field(default_factory=dict, description="registers of `state`")
    cause: Expressions = Field((), description="effects on objects and NPCs, in order")
    reward: int = Field(
        0, ge=-100, le=100, description="per cent of the success reward, added to the reward of the step"
    )


class ThenRule(Rule):
    """A rule read after the body action."""

    goto: StateName | None = Field(None, description="the state from the next step on")
    goto_now: StateName | None = Field(
        None, description="the state from now on: its `then` is still read in this step"
    )


class FirstRule(ThenRule):
    """A rule read before the body action, which it may choose itself."""

    do: str | None = Field(
        None, description="an activity, in place of the state's", examples=["go_next_to(agent)"]
    )


class State(Model):
    """One state of a frame: what is noticed before moving, one body action, what is noticed after it."""

    first: Annotated[tuple[FirstRule, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="rules read before moving; the first that holds takes effect"
    )
    do: str | None = Field(None, description="an activity; default stay", examples=["face(agent)"])
    then: Annotated[tuple[ThenRule, ...], BeforeValidator(_as_tuple)] = Field(
        (), description="rules read after moving; the first that holds takes effect"
    )


class Step(Effects):
    """One entry of `steps`: an activity until it is finished, then its effects."""

    state: StateName | None = Field(None, description="a name for npc.is(name)")
    do: str | None = Field(None, description="an activity, until it is finished", examples=["go_to(exit)"])
    until: Expression | None = Field(None, description="a condition that finishes the step")
    for_: Expression | None = Field(None, alias="for", description="number of steps, or `ever`")


class Ranged(Model):
    """A register with a range, in which it stays whatever it is set to."""

    start: Expression = Field(description="its value at first")
    range: Expression = Field(description="a..b", examples=["0..10"])


class Frame(Model):
    """A pragmatic frame: a protocol of interaction with slots for what varies."""

    slots: dict[Word, SlotType] = Field(
        default_factory=dict,
        description="name: type of what varies; members of the cast fill it by `with`",
        examples=[{"lesson": "object"}],
    )
    let: dict[Word, Expression | Ranged] = Field(
        default_factory=dict, description="registers, one copy per NPC"
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    start: StateName | None = Field(None, description="the first state; default the first written")
    states: dict[Word, State] | None = Field(
        None, description="name: what is noticed and done in this state of the interaction"
    )
    steps: Annotated[tuple[Step, ...], BeforeValidator(_as_tuple)] | None = Field(
        None, description="in place of states: activities in a row, each until it is finished"
    )


class Role(Model):
    """A part that a member of the cast plays: where it is put, and what drives it if it is an NPC."""

    place: str | None = Field(None, description="default anywhere")
    at: Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple)] | None = Field(
        None, description="[x, y] in place of `place`", examples=[[1, "H - 2"]]
    )
    facing: Expression | None = Field(None, description="a direction, random, or toward(x); default random")
    frame: Word | None = Field(None, description="the frame an NPC in this role follows")


class Belief(Model):
    """What a member of the cast takes for true: what it saw last."""

    of: Expression = Field(description="what it is about, such as toy.inside")
    when: Expression | None = Field(None, description="when it is looked at; default always")


class Character(Model):
    """What an inhabitant of the room is: how it looks, where it is put, what it does."""

    role: Word | None = Field(None, description="the part it plays")
    kind: Word | None = Field(None, description="what it looks like; default peer")
    name: ExpressionOrText | None = Field(
        None, description="what precedes its lines; default its key, capitalised"
    )
    color: Expression | None = Field(None, description="default random")
    place: str | None = Field(None, description="default anywhere")
    at: Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple)] | None = Field(
        None, description="[x, y] in place of `place`", examples=[[1, "H - 2"]]
    )
    facing: Expression | None = Field(None, description="a direction, random, or toward(x); default random")
    view: int | None = Field(None, ge=1, le=15, description="side of the square it sees; default 7")
    earshot: Expression | None = Field(None, description="how far its voice carries")
    frame: Word | None = Field(None, description="the frame it follows; default none: it stays")
    with_: dict[Word, ExpressionOrText] = Field(
        default_factory=dict, alias="with", description="fills the slots"
    )
    beliefs: dict[Word, Belief] = Field(default_factory=dict, description="what it takes for true")
    audible: Literal["always"] | None = Field(None, description="heard even while NPCs are hidden")
    kind_code: int | None = Field(None, ge=0, le=255, description="status code in the image")


class Npc(Character):
    """A file of its own for one NPC: what it is, with its frames; `one_of` draws it."""

    npc: Word = Field(description="the name of this file's NPC")
    abstract: bool = Field(False, description="others build on it by `extends`; nobody can be it")
    about: Prose | None = Field(None, description="one sentence for people")
    notes: Prose | None = Field(None, description="more for people")
    frames: dict[Word, Frame] = Field(default_factory=dict, description="the frames it brings along")


class CastMember(Character):
    """The agent or an NPC. Keys left out come from its role, from the file that `one_of` draws, from `npc_defaults`,
    then from the defaults of the language.
    """

    one_of: Annotated[tuple[Npc, ...] | None, BeforeValidator(_as_tuple), as_written(str | list[str])] = (
        Field(
            None,
            description="files of NPCs, one of which is drawn for each episode: a list, or a pattern with *",
        )
    )

    def over(self, defaults: Character | Role) -> CastMember:
        """This member with what it leaves out taken from `defaults`; `with` is merged key by key."""
        given: dict[str, Any] = {name: getattr(self, name) for name in self.model_fields_set}
        known = defaults.model_fields_set & CastMember.model_fields.keys()
        base: dict[str, Any] = {name: getattr(defaults, name) for name in known}
        if "place" in given or "at" in given:
            base.pop("place", None), base.pop("at", None)
        given["with_"] = {**(defaults.with_ if isinstance(defaults, Character) else {}), **self.with_}
        return CastMember.model_construct(**{**base, **given})


class CastGroup(CastMember):
    """A group in the cast as authors write it: so many alike members, of which a list gives one value each.

    The loader makes members `name[0]`, `name[1]`, ... of it, so that no scenario holds one.
    """

    count: int = Field(ge=1, le=16, description="a group of so many")
    name: Annotated[Expression | None, as_written(ExpressionOrText | None | list[ExpressionOrText])] = Field(
        None, description="what precedes its lines; a list gives one each"
    )
    color: Annotated[Expression | None, as_written(Expression | list[Expression])] = Field(
        None, description="default random; a list gives one each"
    )
    place: Annotated[str | None, as_written(str | list[str])] = Field(
        None, description="default anywhere; a list gives one each"
    )
    facing: Annotated[Expression | None, as_written(Expression | list[Expression])] = Field(
        None, description="a direction, random, or toward(x); a list gives one each"
    )
    at: Annotated[
        tuple[Expression, ...] | None,
        BeforeValidator(_as_tuple),
        as_written(list[Expression] | list[list[Expression]]),
    ] = Field(None, description="[x, y], or a list of them: one each")


class WrittenCast(Model):
    """The cast as authors write it: the agent, and anybody else, alone or in a group."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"propertyNames": WORD_SCHEMA})
    __pydantic_extra__: dict[Word, CastMember | CastGroup]

    agent: CastMember | None = Field(None, description="whom a policy plays")
