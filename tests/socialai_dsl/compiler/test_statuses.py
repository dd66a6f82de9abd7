"""Links and computed statuses: what follows from what, when it is worked out, and what a layout may say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from socialai_dsl.compiler.folding import ChangeAnalysis, When
from socialai_dsl.program import Flag, Header
from socialai_dsl.semantics.plans import Assignment, CheckedScenario, ComputedStatus, Effect, RulePlan
from socialai_dsl.semantics.terms import (
    BOOL,
    CELL,
    COLOR,
    DIRECTION,
    CellOf,
    Chance,
    Compare,
    Const,
    FieldOf,
    Logic,
    Measure,
    Not,
    PokedNow,
    Quantification,
    Read,
    Sees,
    Select,
    Spoke,
    Term,
    Type,
    Variable,
    World,
)
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DIE,
    DOOR,
    ENTITY,
    GUIDE,
    HERE,
    NUMBER,
    SPAN,
    STATUE,
    SWITCH,
    activity,
    cell,
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

CLOSED, LOCKED = 1, 2
STATUS = Type("status", 0, 2)


def status(thing: int, value: int) -> Compare:
    return Compare("==", FieldOf(STATUS, entity(thing), "status"), Const(STATUS, value))


def computed(condition: Term) -> CheckedScenario:
    """The door is locked while the condition holds."""
    status = ComputedStatus(DOOR, LOCKED, CLOSED, sited(condition, "objects.door.locked"))
    return replace(workbench(), computed=(status,))


def linked(*targets: int) -> CheckedScenario:
    entities = tuple(replace(e, unlocks=targets) if e.number == SWITCH else e for e in workbench().entities)
    return replace(workbench(), entities=entities)


def law(when: Term | None = None) -> RulePlan:
    return RulePlan("law", "rules[0]", SPAN, when=sited(when) if when else None)


def door(env: Any) -> str:
    return env.describe()["door"]["state"]


def settles_always(checked: CheckedScenario) -> bool:
    return bool(compiled(checked).header(Header.FLAGS) & Flag.SETTLE_ALWAYS)


# --- links ---


def test_without_links_there_is_no_code() -> None:
    assert compiled(workbench()).header(Header.LINKS_PC) == 0
    assert code(compiled(linked(DOOR)), "links") == ["IF_EQ", "IF_EQ", "IF_EQ", "BECOME", "HALT"]


# --- computed statuses ---


def test_what_rules_set_is_looked_at_when_they_set_it() -> None:
    """The door is locked while the die shows 2, which one rule lets it show and the next one ends."""
    checked = computed(Compare("==", DIE, number(2)))
    rules = tuple(
        replace(
            law(Compare("==", World(NUMBER, "t"), number(t))),
            name=f"law{t}",
            site=f"rules[{t}]",
            sets=(Assignment("let.die", sited(number(value))),),
        )
        for t, value in ((2, 2), (4, 3))
    )
    checked = replace(checked, rules=rules)
    assert not settles_always(checked)
    assert code(compiled(checked), "rules").count("LOAD") == 2 * 3, "of the value, of the die and of the mark"
    env = start(checked, {"let": {"die": 1}})
    seen = [door(env)]
    for _ in range(4):
        step(env)
        seen.append(door(env))
    assert seen == ["closed", "closed", "locked", "locked", "closed"]


def test_rules_mark_nothing_that_no_status_reads() -> None:
    rule = replace(law(), sets=(Assignment("let.die", sited(number(2))),))
    checked = replace(computed(status(SWITCH, 1)), rules=(rule,))
    assert code(compiled(checked), "rules").count("LOAD") == 2, "of the value and of the die"


def test_what_cannot_change_is_decided_by_the_reset() -> None:
    def box(die: int, layout: dict[str, Any] | None = None) -> str:
        return str(start(checked, {"let": {"die": die}} | (layout or {})).describe()["box"]["state"])

    tagged = ComputedStatus(BOX, 1, 0, sited(Compare("==", DIE, number(2))))
    checked = replace(workbench(), computed=(tagged,))
    assert compiled(checked).header(Header.SETTLE_PC) == 0
    assert not settles_always(checked)
    assert list(map(box, range(4))) == ["plain", "plain", "tagged", "plain"]
    assert box(2, {"box": {"state": "plain"}}) == "plain", "a layout has its way"


def test_what_something_else_can_change_is_decided_again() -> None:
    """Whoever toggles a door that is to be locked finds it locked again."""
    checked = computed(Compare("==", DIE, number(2)))
    assert compiled(checked).header(Header.SETTLE_PC) > 0
    assert not settles_always(checked)
    assert [door(start(checked, {"let": {"die": die}})) for die in (1, 2)] == ["closed", "locked"]


def test_listings_say_where_a_status_comes_from() -> None:
    program = compiled(computed(status(SWITCH, 1)))
    assert all(line.endswith("workbench.yaml:1") for line in listed(program, "settle"))


# --- what can change ---

THING = Variable(ENTITY, "e")


def some(condition: Term, *items: int) -> Quantification:
    return Quantification(BOOL, "any", "e", tuple(map(entity, items)), condition)


def any_cell(condition: Term) -> Quantification:
    return Quantification(BOOL, "any", "c", (), condition, cells=True)


N, S, A = When.NEVER, When.MARKED, When.ANY_TIME
OCCASIONS: list[tuple[Term, When]] = [
    (Compare("==", DIE, number(2)), N),
    (Compare("==", World(NUMBER, "width"), number(2)), N),
    (Compare("==", World(NUMBER, "t"), number(2)), A),
    (Spoke(), A),
    (PokedNow(entity(STATUE)), A),
    (Chance(0.5), A),
    (Read(NUMBER, "memory.acts.filled"), A),
    (Read(NUMBER, "let.written"), S),
    (Read(NUMBER, "guide.frame"), A),
    (Read(NUMBER, "let.kept"), N),
    (FieldOf(COLOR, entity(AGENT), "color"), N),
    (FieldOf(NUMBER, entity(STATUE), "x"), N),
    (FieldOf(NUMBER, entity(AGENT), "x"), A),
    (FieldOf(NUMBER, entity(BOX), "y"), S),
    (FieldOf(BOOL, entity(BOX), "gone"), S),
    (FieldOf(BOOL, entity(DOOR), "gone"), N),
    (FieldOf(BOOL, entity(STATUE), "poked"), A),
    (FieldOf(DIRECTION, entity(STATUE), "dir"), N),
    (FieldOf(DIRECTION, entity(GUIDE), "dir"), A),
    (FieldOf(NUMBER, entity(STATUE), "status"), N),
    (FieldOf(STATUS, Read(Type("entity", DOOR, SWITCH), "let.kept"), "status"), S),
    (FieldOf(NUMBER, Read(Type("entity", AGENT, STATUE), "let.kept"), "y"), A),
    (FieldOf(NUMBER, cell(1, 2), "x"), N),
    (CellOf(CELL, entity(DOOR)), N),
    (CellOf(CELL, entity(AGENT)), A),
    (Measure(NUMBER, "distance", (entity(STATUE), entity(DOOR))), N),
    (Measure(NUMBER, "distance", (entity(STATUE), entity(BOX))), S),
    (Measure(NUMBER, "distance", (entity(GUIDE), cell(1, 1))), N),
    (Relation("next_to", entity(STATUE), entity(DOOR)), N),
    (Relation("next_to", entity(AGENT), entity(DOOR)), A),
    (Relation("faces", entity(GUIDE), entity(DOOR)), A),
    (Relation("faces", entity(STATUE), entity(DOOR)), N),
    (Relation("eye_contact", entity(STATUE), entity(GUIDE)), A),
    (Relation("in_front_of", entity(STATUE), entity(GUIDE)), A),
    (Relation("can_reach", entity(STATUE), entity(DOOR)), A),
    (Relation("unobstructed", entity(STATUE), entity(DOOR)), S),
    (Relation("looks_at", entity(STATUE), entity(DOOR)), S),
    (Relation("looks_at", entity(GUIDE), entity(DOOR)), A),
    (Sees(entity(STATUE), entity(DOOR)), N),
    (Sees(entity(GUIDE), entity(DOOR)), A),
    (Sees(entity(GUIDE), entity(DOOR), Const(DIRECTION, 1)), N),
    (Sees(entity(STATUE), entity(AGENT)), A),
    (Logic("and", (Compare("==", DIE, number(2)), status(SWITCH, 1))), S),
    (Not(status(SWITCH, 1)), S),
    (Select(NUMBER, (status(SWITCH, 1),), (number(1),), World(NUMBER, "t")), A),
    (some(Relation("next_to", THING, cell(1, 1)), STATUE, DOOR), N),
    (some(Relation("next_to", THING, cell(1, 1)), STATUE, AGENT), A),
    (Quantification(ENTITY, "pick", "e", (entity(DOOR), entity(BOX)), None), A),
    (Quantification(ENTITY, "nearest", "e", (entity(DOOR), entity(STATUE)), None, entity(DOOR)), N),
    (Quantification(ENTITY, "nearest", "e", (entity(DOOR), entity(STATUE)), None, entity(AGENT)), A),
    (any_cell(Relation("next_to", HERE, entity(DOOR))), N),
    (any_cell(Relation("next_to", HERE, entity(AGENT))), A),
    (Quantification(CELL, "nearest", "c", (), None, entity(AGENT), cells=True), A),
]


@pytest.mark.parametrize(("term", "when"), OCCASIONS)
def test_when_a_value_can_change(term: Term, when: When) -> None:
    """The guide turns, the statue does nothing, the box may vanish, a rule writes `let.written`."""
    checked = with_guide(workbench(), state("waiting", activity("turn_to", Const(DIRECTION, 1))))
    rule = RulePlan(
        "law",
        "rules[0]",
        SPAN,
        sets=(Assignment("let.written", sited(number(1))),),
        causes=(Effect("vanish", (entity(BOX),), SPAN),),
    )
    assert ChangeAnalysis(replace(checked, rules=(rule,))).of(term) == when


@pytest.mark.parametrize(
    ("name", "walks"), [("stay", False), ("turn", False), ("forward", True), ("go_to", True)]
)
def test_who_walks(name: str, walks: bool) -> None:
    goal = {"turn": (Const(Type("int", -1, 1), 1),), "go_to": (entity(DOOR),)}.get(name, ())
    checked = with_guide(workbench(), state("waiting", activity(name, *goal)))
    assert ChangeAnalysis(checked).of(FieldOf(NUMBER, entity(GUIDE), "x")) == (A if walks else N)
    in_first = RulePlan("r", "guide/r", SPAN, do=activity(name, *goal))
    checked = with_guide(workbench(), state("waiting", activity("stay"), first=(in_first,)))
    assert ChangeAnalysis(checked).of(FieldOf(NUMBER, entity(GUIDE), "x")) == (A if walks else N)
