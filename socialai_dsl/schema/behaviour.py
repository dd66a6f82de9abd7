"""Who acts and how: frames with their states, steps and rules, and the members of the cast."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from socialai_dsl.schema.base import Expression, Expressions, Model, TextLine, Texts, Word, _as_tuple

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
    say: TextLine | None = None


class Rule(Effects):
    """Conditions, all of which must hold, and effects."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    hears: Texts = Field((), description="an utterance, or a list of alternatives")
    when: Expression | None = None
    after: Expression | None = Field(None, description="holds from this turn in the state on")
    chance: Probability | None = Field(None, description="drawn anew each turn if everything else holds")
    once: bool = Field(False, description="once per episode and NPC")


class WorldRule(Model):
    """A rule about the world, read once a step after everybody has moved; each that holds takes effect."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    when: Expression | None = None
    chance: Probability | None = Field(None, description="drawn anew each step if everything else holds")
    once: bool = Field(False, description="once per episode")
    set: dict[Word, Expression] = Field(default_factory=dict, description="registers of `state`")
    cause: Expressions = Field((), description="effects on objects and NPCs, in order")
    reward: int = Field(
        0, ge=-100, le=100, description="per cent of the success reward, added to the reward of the step"
    )


class ThenRule(Rule):
    """A rule read after the body action."""

    goto: Word | None = None
    goto_now: Word | None = None


class FirstRule(ThenRule):
    """A rule read before the body action, which it may choose itself."""

    do: str | None = None


class State(Model):
    """One state of a frame: what is noticed before moving, one body action, what is noticed after it."""

    first: Annotated[tuple[FirstRule, ...], BeforeValidator(_as_tuple)] = ()
    do: str | None = Field(None, description="an activity; default stay")
    then: Annotated[tuple[ThenRule, ...], BeforeValidator(_as_tuple)] = ()


class Step(Effects):
    """One entry of `steps`: an activity until it is finished, then its effects."""

    state: Word | None = Field(None, description="a name for npc.is(name)")
    do: str | None = None
    until: Expression | None = None
    for_: Expression | None = Field(None, alias="for", description="number of steps, or `ever`")


class Ranged(Model):
    """A register with a range, in which it stays whatever it is set to."""

    start: Expression
    range: Expression = Field(description="a..b")


class Frame(Model):
    """A pragmatic frame: a protocol of interaction with slots for what varies."""

    slots: dict[Word, SlotType] = Field(default_factory=dict)
    let: dict[Word, Expression | Ranged] = Field(
        default_factory=dict, description="registers, one copy per NPC"
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    start: Word | None = Field(None, description="the first state; default the first written")
    states: dict[Word, State] | None = None
    steps: Annotated[tuple[Step, ...], BeforeValidator(_as_tuple)] | None = None


class Role(Model):
    """A part that a member of the cast plays: where it is put, and what drives it if it is an NPC."""

    place: str | None = Field(None, description="default anywhere")
    at: Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple)] | None = None
    facing: Expression | None = Field(None, description="a direction, random, or toward(x); default random")
    frame: Word | None = Field(None, description="the frame an NPC in this role follows")


class Belief(Model):
    """What a member of the cast takes for true: what it saw last."""

    of: Expression = Field(description="what it is about, such as toy.inside")
    when: Expression | None = Field(None, description="when it is looked at; default always")


class CastMember(Model):
    """The agent or an NPC. Keys left out come from its role, from the file that `one_of` draws, from `npc_defaults`,
    then from the defaults of the language.
    """

    role: Word | None = Field(None, description="the part it plays")
    one_of: Annotated[tuple[Npc, ...], BeforeValidator(_as_tuple)] | None = Field(
        None, description="files of NPCs, one of which is drawn for each episode: a list, or a pattern with *"
    )
    kind: Word | None = Field(None, description="what it looks like; default peer")
    name: Expression | None = Field(None, description="what precedes its lines; default its key, capitalised")
    color: Expression | None = Field(None, description="default random")
    place: str | None = Field(None, description="default anywhere")
    at: Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple)] | None = None
    facing: Expression | None = Field(None, description="a direction, random, or toward(x); default random")
    view: int | None = Field(None, ge=1, le=15)
    earshot: Expression | None = Field(None, description="how far its voice carries")
    frame: Word | None = Field(None, description="the frame it follows; default none: it stays")
    with_: dict[Word, Expression] = Field(default_factory=dict, alias="with", description="fills the slots")
    beliefs: dict[Word, Belief] = Field(default_factory=dict, description="what it takes for true")
    audible: Literal["always"] | None = Field(None, description="heard even while NPCs are hidden")
    kind_code: int | None = Field(None, ge=0, le=255, description="status code in the image")

    def over(self, defaults: CastMember | Role) -> CastMember:
        """This member with what it leaves out taken from `defaults`; `with` is merged key by key."""
        given: dict[str, Any] = {name: getattr(self, name) for name in self.model_fields_set}
        known = defaults.model_fields_set & CastMember.model_fields.keys()
        base: dict[str, Any] = {name: getattr(defaults, name) for name in known}
        if "place" in given or "at" in given:
            base.pop("place", None), base.pop("at", None)
        given["with_"] = {**(defaults.with_ if isinstance(defaults, CastMember) else {}), **self.with_}
        return CastMember.model_construct(**{**base, **given})


class Npc(CastMember):
    """A file of its own for one NPC: a member of the cast with its frames, which `one_of` draws."""

    npc: Word
    abstract: bool = False
    about: str | None = None
    notes: str | None = None
    frames: dict[Word, Frame] = Field(default_factory=dict)


CastMember.model_rebuild(_types_namespace={"Npc": Npc})
