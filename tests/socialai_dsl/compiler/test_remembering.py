"""What was before (`prev`), what the agent did last, and the rules of the world that ask for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl.program import Header
from socialai_dsl.semantics.plans import Assignment, CheckedScenario, Drawn, MemoryPlan, RulePlan
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    CELL,
    CellOf,
    Chance,
    Compare,
    Const,
    Logic,
    Operation,
    Read,
    Term,
    Type,
    World,
)
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    DIE,
    SPAN,
    code,
    compiled,
    entity,
    number,
    sited,
    start,
    step,
    with_let,
    workbench,
)

UTTERANCE = Type("utterance", 0, 4, ("", "Go up", "Go down", "Look up", "Look down"))
TIME = World(Type("int", 0, 20), "t")
COUNTER = Read(Type("int", 0, 5), "let.n")


def counting(*rules: RulePlan) -> CheckedScenario:
    """The scenario with a number `let.n` from 0 to 5 and rules of the world."""
    return replace(with_let(workbench(), "let.n", Const(COUNTER.type, 0)), rules=rules)


def rule(name: str, when: Term | None = None, **more: Any) -> RulePlan:
    """A rule that counts."""
    total = Operation(Type("int", -20, 20), "+", (COUNTER, number(1)))
    sets = (Assignment("let.n", sited(total, f"rules.{name}.set")),)
    return RulePlan(name, f"rules.{name}", SPAN, when=sited(when, name) if when else None, sets=sets, **more)


def played(checked: CheckedScenario, *actions: str, seed: int = 0) -> list[int]:
    """The counter after each step."""
    env = start(checked, {"agent": {"at": [1, 4]}}, seed)
    seen = []
    for action in actions:
        step(env, action)
        seen.append(env.describe()["let"]["n"])
    return seen


# --- rules of the world ---


def test_rules_are_counted_by_name_behind_those_of_frames() -> None:
    program = compiled(counting(rule("first"), rule("second", Compare("==", TIME, number(2)))))
    assert program.rules == ("first", "second")
    env = start(counting(rule("first"), rule("second", Compare("==", TIME, number(2)))))
    for _ in range(3):
        step(env)
    assert env.counters()["rules"] == {"first": 3, "second": 1}


def test_chance_of_a_rule_and_in_a_condition() -> None:
    often = counting(rule("maybe", chance=0.5))
    assert 0 < sum(played(often, "left", seed=seed)[0] for seed in range(40)) < 40
    asked = counting(rule("maybe", Chance(0.5, 0, "")))
    assert 0 < sum(played(asked, "left", seed=seed)[0] for seed in range(40)) < 40
    assert played(counting(rule("never", Chance(0.0))), "left") == [0]
    assert played(counting(rule("ever", Chance(1.0))), "left") == [1]


def test_two_chances_of_one_value_are_two_draws() -> None:
    both = Logic("and", (Chance(0.5, 0), Compare("==", Chance(0.5, 1), Const(ACTION, 0))))
    fired = sum(played(counting(rule("maybe", both)), "left", seed=seed)[0] for seed in range(60))
    assert fired > 0


# --- prev ---


def remembering(term: Term, type_: Type, condition: Term) -> CheckedScenario:
    item = Drawn("prev.0", type_, sited(term, "prev.0"))
    return replace(counting(rule("law", condition)), remembered=(item,))


def test_prev_of_a_cell() -> None:
    stayed = Compare("==", CellOf(CELL, entity(AGENT)), Read(CELL, "prev.0"))
    checked = remembering(CellOf(CELL, entity(AGENT)), CELL, stayed)
    env = start(checked, {"agent": {"at": [1, 4], "facing": "right"}})
    for action in ("forward", "left", "forward"):
        step(env, action)
    assert env.describe()["let"]["n"] == 1


def test_a_value_without_zero_starts_with_its_least() -> None:
    late = Type("int", 3, 9)
    checked = remembering(number(5), late, Compare("==", Read(late, "prev.0"), number(5)))
    assert [line for line in code(compiled(checked), "reset") if line == "IF_UNPINNED"]
    assert played(checked, "left", "left") == [1, 2]


# --- memories ---


def acting(open_: Term | None = None, length: int = 2) -> CheckedScenario:
    plan = MemoryPlan("memory.acts", length, UTTERANCE, sited(open_, "memory.acts") if open_ else None)
    return replace(workbench(), memories=(plan,))


def test_registers_of_a_memory() -> None:
    paths = [name.path for name in compiled(acting(Compare("==", DIE, number(1)))).registers]
    assert [path for path in paths if path.startswith("memory.")] == [
        "memory.acts[0].move",
        "memory.acts[0].utterance",
        "memory.acts[1].move",
        "memory.acts[1].utterance",
        "memory.acts.filled",
        "memory.acts.open",
    ]
    always = [name.path for name in compiled(acting()).registers]
    assert "memory.acts.open" not in always


def test_what_never_holds_is_not_remembered_anew() -> None:
    """Its register is 0 from the reset on."""
    checked = remembering(Const(BOOL, 0), BOOL, Compare("==", Read(BOOL, "prev.0"), Const(BOOL, 0)))
    assert compiled(checked).header(Header.BEFORE_PC) == 0
    assert played(checked, "left", "left") == [1, 2]


def test_what_is_not_needed_costs_nothing() -> None:
    program = compiled(workbench())
    assert [program.header(word) for word in (Header.BEFORE_PC, Header.RULES_PC, Header.SETTLE_PC)] == [
        0,
        0,
        0,
    ]
    assert code(compiled(acting(length=1)), "rules") == ["LOAD", "LOAD", "ADD", "MIN", "HALT"]
