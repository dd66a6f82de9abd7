"""Rules of `first` with a body action of their own: the rest comes after it, with the values of before."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from socialai_dsl.compiler.tables import InvalidProgramError
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.program import FrameColumn, Header
from socialai_dsl.semantics.plans import Activity, Assignment, CheckedScenario, Drawn, Effect, RulePlan
from socialai_dsl.semantics.terms import (
    CELL,
    DIRECTION,
    CellOf,
    Compare,
    Const,
    FieldOf,
    Line,
    Logic,
    Operation,
    Quantification,
    Read,
    Type,
    Variable,
)
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DOOR,
    GUIDE,
    SPAN,
    activity,
    code,
    compiled,
    entity,
    listed,
    number,
    sited,
    start,
    state,
    step,
    with_guide,
    workbench,
)

COLUMN = Type("int", -1, 6)
COUNTED = Read(Type("int", 0, 50), "guide.n")
THING = Type("entity", DOOR, BOX)


def first(do: Activity | None, **what: Any) -> RulePlan:
    return RulePlan("guide.idle.waiting.first[0]", "guide/first[0]", SPAN, do=do, **what)


def scenario(rule: RulePlan, *more: RulePlan) -> CheckedScenario:
    """The guide has a register n, and two states; in `waiting` it has some rules in `first`."""
    waiting = state("waiting", activity("stay"), first=(rule, *more))
    checked = with_guide(workbench(), waiting, state("moved", activity("stay")))
    drawn = Drawn("guide.n", COUNTED.type, sited(number(0), "guide.n"))
    words = tuple(dict.fromkeys((*checked.words_in_order, "here", "at", *map(str, range(-1, 7)))))
    return replace(checked, setup=(*checked.setup, drawn), words_in_order=words)


def guide(env: ScenarioEnv) -> tuple[Any, Any, Any]:
    described = env.describe()["guide"]
    return described["at"], described["state"], described["clock"]


FORWARD = activity("forward")
FREE = {"guide": {"at": [4, 2], "facing": "left"}}


def test_a_target_is_the_one_of_before_the_move() -> None:
    """It would be the door once the guide has moved."""
    moved = Compare("<=", FieldOf(COLUMN, entity(GUIDE), "x"), number(4))
    box = Compare("==", Variable(THING, "v"), Const(THING, BOX))
    which = Quantification(
        THING, "first", "v", (Const(THING, DOOR), Const(THING, BOX)), Logic("or", (moved, box))
    )
    vanishing = Effect("vanish", (which,), SPAN)
    env = start(scenario(first(FORWARD, causes=(vanishing,))), {"guide": {"at": [5, 4], "facing": "left"}})
    step(env)
    after = env.describe()
    assert (guide(env)[0], after["door"]["at"], after["box"]["at"]) == ([4, 4], [6, 2], None)


def test_a_place_is_the_one_of_before_the_move() -> None:
    left = Effect("put", (entity(BOX),), SPAN, CellOf(CELL, entity(GUIDE)))
    env = start(scenario(first(FORWARD, causes=(left,))), FREE)
    step(env)
    assert env.describe()["box"]["at"] == [4, 2]


def test_it_is_counted_once_and_fires_once() -> None:
    more = sited(Operation(COUNTED.type, "+", (COUNTED, number(1))))
    env = start(scenario(first(FORWARD, sets=(Assignment("guide.n", more),), once=True)), FREE)
    for _ in range(3):
        step(env)
    assert guide(env)[0] == [3, 2]
    assert env.describe()["let"]["guide.n"] == 1
    assert env.counters()["rules"]["guide.idle.waiting.first[0]"] == 1


def test_a_rule_that_finds_nothing_does_nothing_at_all() -> None:
    never = Compare("==", number(1), FieldOf(COLUMN, entity(GUIDE), "y"))
    which = Quantification(THING, "first", "v", (Const(THING, DOOR), Const(THING, BOX)), never)
    env = start(scenario(first(FORWARD, causes=(Effect("vanish", (which,), SPAN),))), FREE)
    step(env)
    assert guide(env)[0] == [4, 2]
    assert env.describe()["door"]["at"] == [6, 2]


def test_of_several_rules_the_one_that_fired_is_carried_out() -> None:
    early = Compare("==", FieldOf(COLUMN, entity(GUIDE), "x"), number(4))
    rules = (
        first(FORWARD, when=sited(early), sets=(Assignment("guide.n", sited(number(7))),)),
        replace(first(FORWARD, sets=(Assignment("guide.n", sited(number(9))),), goto="moved"), name="second"),
    )
    env = start(scenario(*rules), FREE)
    step(env)
    assert (env.describe()["let"]["guide.n"], guide(env)[1]) == (7, "waiting")
    step(env)
    assert (env.describe()["let"]["guide.n"], guide(env)[1]) == (9, "moved")


def test_nothing_is_left_behind() -> None:
    """Two moments that differ in nothing that matters are alike."""
    column = sited(FieldOf(COLUMN, entity(GUIDE), "x"))
    env = start(scenario(first(FORWARD, sets=(Assignment("guide.n", column),), goto="moved")), FREE)
    before = env.describe()["let"]
    step(env)
    assert env.describe()["let"] == before | {"guide.n": 4}
    lines = listed(env.program, "guide.idle.deferred")
    assert any("guide.kept[0], #0" in line for line in lines)
    assert any("guide.pending, #0" in line for line in lines)


@pytest.mark.parametrize("what", [{}, {"once": True}])
def test_a_mere_action_is_not_deferred(what: dict[str, Any]) -> None:
    program = compiled(scenario(first(FORWARD, **what)))
    at = program.header(Header.FRAME_AT) + FrameColumn.DEFERRED
    assert int(program.words[at]) == 0
    assert not [
        name.path for name in program.registers if name.path.startswith(("guide.kept", "guide.pending"))
    ]


def test_known_values_are_not_kept() -> None:
    opening = Effect("open", (entity(DOOR),), SPAN)
    program = compiled(scenario(first(FORWARD, causes=(opening,), say=Line(("Here",), "say", SPAN))))
    assert "guide.pending" in [name.path for name in program.registers]
    assert "guide.kept[0]" not in [name.path for name in program.registers]
    assert code(program, "guide.idle.deferred") == ["IF_EQ", "LOAD", "BECOME", "SAY", "HALT", "HALT"]
    assert "BODY" in listed(program, "guide.idle.waiting.first")[-3]


def test_a_layout_cannot_make_it_say_what_it_cannot_say() -> None:
    """Whatever a layout writes into what is kept, it is cut to what it can be."""
    line = Line(("At ", FieldOf(COLUMN, entity(GUIDE), "x")), "say", SPAN)
    program = compiled(scenario(first(FORWARD, say=line)))
    deferred = listed(program, "guide.idle.deferred")
    say = next(k for k, text in enumerate(deferred) if " SAY " in text)
    assert [text.split()[1] for text in deferred[:say]] == ["IF_EQ", "MAX", "MIN", "LOAD", "LOAD"]


@pytest.mark.parametrize("name", ["point", "stop_pointing"])
def test_the_agent_has_no_arm(name: str) -> None:
    """What it does would be no action that outcomes know."""
    args = (Const(DIRECTION, 0),) if name == "point" else ()
    checked = with_guide(workbench(), state("waiting", activity(name, *args)))
    (frame,) = checked.frames
    compiled(checked)
    with pytest.raises(InvalidProgramError, match="refused"):
        compiled(replace(checked, frames=(replace(frame, member="agent", entity=AGENT),)))
