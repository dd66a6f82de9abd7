"""Words for what was said and done, and for the states in which that leaves the cast."""

from __future__ import annotations

from typing import Final

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups, seats, texts
from socialai_dsl.semantics.groups import must_be_agent
from socialai_dsl.semantics.resolver import ENTITY
from socialai_dsl.semantics.scope import ReportedError, of_each, quoted
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    TURN,
    Compare,
    Const,
    FieldOf,
    InState,
    Operation,
    PokedNow,
    Read,
    Term,
    Type,
    World,
    all_of,
    any_of,
    constants,
    entity,
    equals,
    numbers_of,
    one_of,
    where_there_is,
)
from socialai_dsl.semantics.words.use import Use, Value
from socialai_dsl.vocabulary import FINISHED, NOUN


def _said(use: Use) -> Term:
    assert isinstance(use.node, ast.Call), "internal: it has an argument"
    return texts.said_by(use.resolver, use.node, use.scope)


def _spoke(use: Use) -> Term:
    return texts.spoke(use.resolver, use.node, use.scope)


def _heard(use: Use) -> Term:
    own = use.subject is None or (
        isinstance(use.subject, ast.Name) and use.subject.id in ("self", use.scope.member)
    )
    if use.scope.frame is None or not own:
        message = "`heard` is known to the NPC itself, in its frame; elsewhere write `agent.said(...)`"
        raise use.fail("S211", message)
    return texts.heard(use.resolver, use.args[0], use.scope)


def _noun(use: Use) -> Term:
    must_be_agent(use.resolver, use.node, use.scope)
    texts.no_nouns(use.resolver, use.node, use.scope)
    return texts.in_slot(use.resolver, NOUN, heard=False)


def _action(use: Use) -> Term:
    player = seats.player_before_the_dot(use.resolver, use.node, use.scope)
    if player is None:
        must_be_agent(use.resolver, use.node, use.scope)
        return World(ACTION, "action")
    # What an NPC does besides, pointing, is no action of a player.
    return Operation(ACTION, "min", (FieldOf(TURN, player, "last"), Const(ACTION, ACTION.high)))


def _did(use: Use) -> Term:
    action = _action(use)
    if groups.is_group(use.resolver, use.args[0], use.scope):
        return one_of(action, groups.group(use.resolver, use.args[0], ACTION, use.scope).items)
    return Compare("==", action, use.value(0, ACTION))


def _poked(use: Use) -> Term:
    what, symbols = use.about(), use.resolver.symbols
    others = [entity(symbols.numbers[name]) for name in seats.seated(symbols)[1:]]
    if what == entity(AGENT):  # whom nobody pokes
        others = []
    found = any_of((PokedNow(what), *(toggled_by(use, player, what) for player in others)))
    may_be_agent = bool(others) and AGENT in what.type.values
    return all_of((found, Compare("!=", what, entity(AGENT)))) if may_be_agent else found


def _was_poked(use: Use) -> Term:
    who = use.about()
    if use.resolver.symbols.object_of(who.type.high) is not None:
        hint = "`x.poked` is whether it was in this step"
        raise use.fail("S204", "only an NPC remembers that it was poked", hint=hint)
    return FieldOf(BOOL, who, "poked")


AGENT: Final = 0


def toggled_by(use: Use, who: Const, what: Term) -> Term:
    """Whether the agent toggled at something in this step, or an NPC did so in its last turn."""
    if who.value == AGENT:
        return PokedNow(what)
    # It may be anything, or nothing, and not only what is asked about.
    anything = Type("entity", 0, use.resolver.symbols.entities - 1)
    return Compare("==", FieldOf(anything, who, "toggled"), what)


def _toggled_object(use: Use) -> Term:
    """What is asked of it; only objects are toggled."""
    what = use.about()
    if what.type.low < len(use.resolver.symbols.numbers):
        message = f"only objects are toggled, so only they have `{use.signature.name}`"
        raise use.fail("S204", message, hint="an NPC is poked: `anna.poked`")
    return what


def _toggled(use: Use) -> Term:
    what = _toggled_object(use)
    return any_of(toggled_by(use, entity(each), what) for each in range(len(use.resolver.symbols.numbers)))


def _toggled_by(use: Use) -> Term:
    """Whether the member of the cast that is named, whoever it is, toggled at something."""
    what, who = _toggled_object(use), use.value(0, ENTITY)
    if who.type.high >= len(use.resolver.symbols.numbers):
        raise use.fail("S211", "`toggled_by` takes a member of the cast", use.args[0])
    if isinstance(who, Const):
        return toggled_by(use, who, what)
    cases = (all_of([Compare("==", who, one), toggled_by(use, one, what)]) for one in constants(who.type))
    return where_there_is(who, any_of(cases))


def _turns_in_state(use: Use) -> Term:
    """The clock of a member's frame, which `after` compares as well."""
    who = use.about()
    members = use.resolver.symbols.members_of(numbers_of(who))
    if not all(member in use.resolver.frames for member in members):
        hint = "members of the cast follow one with `frame:`"
        raise use.fail("S204", "only who follows a frame is in a state", hint=hint)
    turns = Type("int", 0, use.resolver.symbols.scenario.horizon)
    return of_each(who, [Read(turns, f"{member}.clock") for member in members])


def _is_in_state(use: Use) -> Term:
    """`dancer.is(watching)`: the state is a bare word, looked up in the member's frame."""
    who = use.resolver.value(use.subject, ENTITY, use.scope) if use.subject is not None else None
    if who is None or isinstance(who, Const):
        member = use.scope.member if who is None else use.resolver.symbols.member_of(who.value)
        return _in_state(use, member, called=quoted(use.subject) if use.subject is not None else None)
    # Of `any(p in peers where p.is(ready))`, `leader.is(ready)` the member that is meant.
    members = use.resolver.symbols.members_of(who.type.values)
    if None in members:
        raise _nobody(use)
    cases = [
        all_of([equals(who, who.type.low + i), _in_state(use, member, called=member)])
        for i, member in enumerate(members)
    ]
    return where_there_is(who, any_of(cases))


def _in_state(use: Use, member: str | None, called: str | None) -> Term:
    """Whether a member is in the state that is named; `called` as it is written, or not at all in its own frame."""
    if member is None:
        raise _nobody(use)
    own = use.scope.frame if called is None else None
    frame = own or use.resolver.frames.get(member)
    if frame is None and use.resolver.symbols.cast[member].value("frame") is not None:
        raise ReportedError  # an unknown frame is reported where it is named
    if frame is None:
        raise use.fail("S310", f"`{called or member}` follows no frame, so it has no states")
    states = list(frame.model.states or ())
    states += [step.state for _, step in frame.model.entries() if step.state]
    states += [FINISHED] if frame.model.steps else []
    (argument,) = use.args
    if not isinstance(argument, ast.Name | ast.Truth):
        state = argument.plain if isinstance(argument, ast.Text) else None
        hint = use.resolver.instead(state, argument, use.scope) if state in states else None
        raise use.fail("S211", "`is` takes the name of a state", argument, hint=hint)
    state = argument.id if isinstance(argument, ast.Name) else str(argument.value).lower()
    if state not in states:
        called = (use.resolver.symbols.group_of(member) or (member, 0))[0]
        message = f"`{called}` has no state `{state}` (it plays `{frame.name}`: {', '.join(states)})"
        raise use.fail("S310", message, argument, suggestion=did_you_mean(state, states))
    return InState(member, frame.name, state)


def _nobody(use: Use) -> ReportedError:
    return use.fail("S211", "a member of the cast is needed before the dot")


HAPPENINGS: Final = (
    Value("said", "agent", ("utterance",), "condition",
          "it said this in this step, at any distance; `<noun>` is any noun", momentary=True,
          also=("says", "say"), meaning=_said),
    Value("spoke", "agent", (), "condition", "it said something in this step, at any distance",
          momentary=True, meaning=_spoke),
    Value("noun", "agent", (), "noun",
          "the noun of what the agent said in this step; without one it equals no noun", momentary=True,
          meaning=_noun),
    Value("did", "agent", ("action",), "condition",
          "its body action in this step is this one; `left | right`: one of them", momentary=True,
          also=("does",), meaning=_did),
    Value("action", "agent", (), "action", "its body action in this step, `none` if it did not move",
          momentary=True, meaning=_action),
    Value("heard", "member", ("utterance",), "condition",
          "it has heard this since its last turn; `heard(any)`: anything. Only in its own frame",
          momentary=True, also=("hears",), meaning=_heard),
    Value("poked", "entity", (), "condition",
          "the agent, or a member with a seat, toggled at it in this step", momentary=True, meaning=_poked),
    Value("was_poked", "entity", (), "condition", "this NPC has been poked in this episode", momentary=True,
          meaning=_was_poked),
    Value("toggled", "object", (), "condition",
          "a member of the cast toggled at it: the agent in this step, an NPC in its last turn",
          momentary=True, meaning=_toggled),
    Value("toggled_by", "object", ("entity",), "condition",
          "x toggled at it: the agent in this step, an NPC in its last turn", momentary=True,
          also=("pressed_by", "used_by", "eaten_by", "opened_by"), meaning=_toggled_by),
    Value("is", "member", ("state",), "condition", "its frame is in this state", momentary=True,
          also=("in_state", "state"), meaning=_is_in_state),
    Value("turns_in_state", "member", (), "number",
          "the number of turns that its frame has been in its state, as `after` counts them", momentary=True,
          meaning=_turns_in_state),
)  # fmt: skip
