"""Cells as values and operands, and sets of cells."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import pytest

from socialai_dsl.program import CELL
from socialai_dsl.semantics.plans import Assignment, Placing, Region, RulePlan
from socialai_dsl.semantics.terms import (
    BOOL,
    DIRECTION,
    CellOf,
    Compare,
    FieldOf,
    Logic,
    Measure,
    Not,
    Quantification,
    Term,
    Type,
    Variable,
)
from socialai_dsl.semantics.terms import CELL as ANY_CELL
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DOOR,
    GUIDE,
    HERE,
    NUMBER,
    SPAN,
    STATUE,
    activity,
    cell,
    cells,
    code,
    compiled,
    entity,
    number,
    sited,
    start,
    state,
    step,
    with_guide,
    with_let,
    workbench,
    worth,
    worths,
    x_of,
    y_of,
)


def at(x: int, y: int) -> int:
    return CELL + 32 * y + x


def both(*args: Term) -> Logic:
    return Logic("and", args)


IN_COLUMN_2 = Compare("==", x_of(HERE), number(2))
NEXT_TO_AGENT = Relation("next_to", HERE, entity(AGENT))
NEXT_TO_EITHER = Quantification(
    BOOL,
    "any",
    "e",
    (entity(AGENT), entity(GUIDE)),
    Relation("next_to", HERE, Variable(Type("entity", 0, 6), "e")),
)
NONE = Compare("==", x_of(HERE), number(20))

VALUES: list[tuple[Term, Any]] = [
    (CellOf(ANY_CELL, entity(GUIDE)), at(4, 3)),
    (CellOf(ANY_CELL, cell(1, 2)), at(1, 2)),
    (cell(5, 1), at(5, 1)),
    (x_of(cell(5, 1)), 5),
    (y_of(cell(5, 1)), 1),
    (x_of(CellOf(ANY_CELL, entity(DOOR))), 6),
    (y_of(CellOf(ANY_CELL, entity(DOOR))), 2),
    (Measure(NUMBER, "distance", (entity(AGENT), cell(5, 5))), 5),
    (Measure(DIRECTION, "dir_to", (entity(AGENT), cell(2, 5))), 1),
    (cells("count", None, NUMBER), 25),
    (cells("count", NEXT_TO_AGENT, NUMBER), 4),
    (cells("count", both(IN_COLUMN_2, Not(NEXT_TO_AGENT)), NUMBER), 3),
    (cells("first", NEXT_TO_AGENT), at(2, 2)),
    (cells("nearest", IN_COLUMN_2, to=entity(GUIDE)), at(2, 3)),
    (cells("nearest", None, to=cell(5, 1)), at(5, 1)),
    (cells("pick", Relation("at", HERE, entity(BOX))), at(3, 3)),
    (cells("first", NONE), at(1, 1)),  # none: at a reset the first of all
    (cells("pick", NONE), at(1, 1)),
    (cells("nearest", NONE, to=entity(GUIDE)), at(1, 1)),
    (x_of(cells("first", Compare("==", y_of(HERE), number(4)))), 1),
]


@pytest.mark.parametrize(("term", "expected"), VALUES)
def test_values(term: Term, expected: int) -> None:
    assert worth(term) == expected


def truth(op: Literal["any", "all"], condition: Term) -> Quantification:
    return cells(op, condition, BOOL)


CONDITIONS: list[tuple[Term, bool]] = [
    (Relation("at", entity(AGENT), cell(2, 3)), True),
    (Relation("at", entity(AGENT), cell(3, 3)), False),
    (Relation("next_to", cell(3, 3), entity(AGENT)), True),
    (Relation("faces", entity(AGENT), cell(3, 3)), True),
    (Relation("faces", entity(AGENT), cell(1, 3)), False),
    (Relation("in_line", cell(1, 1), cell(5, 1)), True),
    (Relation("can_reach", entity(AGENT), cell(5, 5)), True),
    (Relation("unobstructed", entity(AGENT), cell(2, 5)), True),
    (Relation("at", entity(AGENT), cells("first", NONE)), False),
    (truth("any", IN_COLUMN_2), True),
    (truth("any", NONE), False),
    (truth("all", IN_COLUMN_2), False),
    (truth("all", Not(NONE)), True),
    (Not(truth("any", NONE)), True),
    (truth("any", both(IN_COLUMN_2, NEXT_TO_AGENT)), True),
    (truth("all", Logic("or", (IN_COLUMN_2, Compare("!=", x_of(HERE), number(2))))), True),
]


@pytest.mark.parametrize(("term", "expected"), CONDITIONS)
def test_conditions(term: Term, expected: bool) -> None:
    assert worth(term) is expected


def test_a_pick_takes_every_cell_that_fits_sooner_or_later() -> None:
    term = cells("pick", NEXT_TO_AGENT)
    assert set(worths(term, range(40))) == {at(2, 2), at(1, 3), at(3, 3), at(2, 4)}


def test_a_variable_of_things_inside_a_set_of_cells() -> None:
    assert worth(cells("count", NEXT_TO_EITHER, NUMBER)) == 7, "one cell is next to both"


def test_sets_of_cells_do_not_nest() -> None:
    inner = cells("count", NEXT_TO_EITHER, NUMBER)
    with pytest.raises(AssertionError, match="inside another"):
        compiled(with_let(workbench(), "let.answer", cells("count", Compare("<", inner, number(3)), NUMBER)))


def test_a_rule_whose_pick_finds_no_cell_does_not_fire() -> None:
    for condition, fired in ((NONE, 0), (NEXT_TO_AGENT, 1)):
        rule = RulePlan(
            "law",
            "rules[0]",
            SPAN,
            sets=(Assignment("let.spot", sited(cells("first", condition), "rules[0].set")),),
        )
        checked = replace(with_let(workbench(), "let.spot", cell(1, 1)), rules=(rule,))
        env = start(checked)
        step(env)
        assert env.counters()["rules"]["law"] == fired


def test_an_activity_towards_a_cell() -> None:
    checked = with_guide(workbench(), state("waiting", activity("go_to", cell(5, 2))))
    env = start(checked)
    for _ in range(8):
        step(env)
    assert env.describe()["guide"]["at"] == [5, 2]


def test_going_to_a_cell_that_is_none_is_staying() -> None:
    checked = with_guide(workbench(), state("waiting", activity("go_to", cells("first", NONE))))
    env = start(checked)
    step(env)
    assert env.describe()["guide"]["at"] == [4, 3]


def test_a_place_next_to_a_cell() -> None:
    """A set of cells inside a region needs boards of its own."""
    corner = cells("nearest", IN_COLUMN_2, to=cell(1, 1))
    placing = Placing(
        STATUE,
        "cast.statue.cell",
        0,
        SPAN,
        regions=(Region("next_to", (corner,)), Region("next_to", (cell(5, 5),))),
    )
    setup = tuple(placing if isinstance(p, Placing) and p.entity == STATUE else p for p in workbench().setup)
    checked = replace(workbench(), setup=setup)
    found = {tuple(start(checked, seed=seed).describe()["statue"]["at"]) for seed in range(40)}
    assert found == {(1, 1), (3, 1), (2, 2), (4, 5), (5, 4)}


def test_a_register_of_a_cell_may_hold_none() -> None:
    checked = with_let(workbench(), "let.spot", cells("first", NONE), ANY_CELL)
    (name,) = [name for name in compiled(checked).registers if name.path == "let.spot"]
    assert (name.low, name.high) == (CELL - 1, at(6, 6))


def test_coordinates_in_a_loop_cost_nothing() -> None:
    by_variable = compiled(with_let(workbench(), "let.n", cells("count", IN_COLUMN_2, NUMBER)))
    assert "FIELD" not in code(by_variable, "reset")


def test_what_is_computed_of_things_that_are_gone_stays_in_range() -> None:
    gone = {"statue": {"gone": True}}
    distance = Measure(Type("int", 0, 12), "distance", (cell(5, 5), entity(STATUE)))
    assert start(with_let(workbench(), "let.far", distance), gone).describe()["let"]["far"] == 12
    column = FieldOf(Type("int", 0, 6), entity(STATUE), "x")
    assert start(with_let(workbench(), "let.column", column), gone).describe()["let"]["column"] == 0
