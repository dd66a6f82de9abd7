"""Rows, columns and what is near a thing are filled at once, with the cells that asking for each one finds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.program import CELL
from socialai_dsl.semantics.terms import Compare, Logic, Not, Term
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DOOR,
    GUIDE,
    HERE,
    NUMBER,
    cell,
    cells,
    compiled,
    entity,
    number,
    with_let,
    workbench,
    worth,
    x_of,
    y_of,
)

SHAPES = {
    **{f"x {op} {k}": Compare(op, x_of(HERE), number(k)) for op in ("==", "<", "<=") for k in (-1, 1, 3, 40)},  # type: ignore[arg-type]
    **{f"{k} {op} y": Compare(op, number(k), y_of(HERE)) for op in ("==", "<", "<=") for k in (-1, 1, 3, 40)},  # type: ignore[arg-type]
    "x of the guide": Compare("<=", x_of(HERE), x_of(entity(GUIDE))),
    **{
        f"{name} {thing}": Relation(name, HERE, entity(thing))  # type: ignore[arg-type]
        for name in ("at", "next_to", "in_line", "in_front_of")
        for thing in (AGENT, GUIDE, DOOR, BOX)
    },
    "in line with a cell": Relation("in_line", HERE, cell(5, 2)),
}


def asked_one_by_one(condition: Term) -> Term:
    """The same in a form that is no shape."""
    return Logic("or", (condition, Not(Not(condition))))


def loops(term: Term) -> bool:
    return "EACH_CELL" in compiled(with_let(workbench(), "let.answer", term)).listing()


@pytest.mark.parametrize("condition", SHAPES.values(), ids=SHAPES)
@pytest.mark.thorough("compiles a scenario for each shape")
def test_a_shape_has_the_cells_that_a_loop_finds(condition: Term) -> None:
    each = asked_one_by_one(condition)
    assert not loops(cells("count", condition, NUMBER))
    assert loops(cells("count", each, NUMBER))
    for wanted in (condition, Not(condition)):
        other = each if wanted is condition else Not(each)
        assert worth(cells("count", wanted, NUMBER)) == worth(cells("count", other, NUMBER))
        assert worth(cells("first", wanted)) == worth(cells("first", other))


def test_shapes_of_a_conjunction_come_first_and_the_rest_is_asked_of_what_is_left() -> None:
    odd = asked_one_by_one(Relation("next_to", HERE, entity(AGENT)))
    both = Logic("and", (odd, Compare("==", x_of(HERE), number(2))))
    assert worth(cells("count", both, NUMBER)) == 2, "above and below the agent"
    assert worth(cells("first", both)) == CELL + 32 * 2 + 2


SCENARIO = """
scenario: shapes
horizon: 5
actions: [left, right, forward]
grammar: {templates: [Go <noun>], nouns: [away]}
room: {size: 8}
objects:
  door: {type: door, color: red, place: wall(top)}
  statue: {type: ball, color: red, place: anywhere}
  box: {type: box, color: red, place: "anywhere where %s"}
let: {number: pick(1 | 2)}
cast: {agent: {color: red, place: anywhere}}
outcome: [{success: agent.at(door)}]
"""

PLACES: dict[str, Callable[[list[int], list[int]], bool]] = {
    "here.x < 3": lambda box, _: box[0] < 3,
    "not here.y > 2": lambda box, _: box[1] <= 2,
    "here.x != 3 and here.y != statue.y": lambda box, statue: box[0] != 3 and box[1] != statue[1],
    "here.in_line(statue)": lambda box, statue: box[0] == statue[0] or box[1] == statue[1],
    "not (here.in_line(statue) or here.x == 1)": lambda box, statue: (
        box[0] not in (1, statue[0]) and box[1] != statue[1]
    ),
    "statue.x < 4 or here.y == 1": lambda box, statue: statue[0] < 4 or box[1] == 1,
}


@pytest.mark.parametrize("where", PLACES)
def test_places_are_shapes(where: str, tmp_path: Path) -> None:
    path = tmp_path / "shapes.yaml"
    path.write_text(SCENARIO % where)
    program = socialai_dsl.compile(socialai_dsl.load(path))
    assert isinstance(program, socialai_dsl.Program), program
    assert "EACH_CELL" not in program.listing()
    env = socialai_dsl.make(path)
    env.reset(seed=3)
    boxes = set()
    for _ in range(60):
        env.reset()
        state = env.describe()
        boxes.add(tuple(state["box"]["at"]))
        assert PLACES[where](state["box"]["at"], state["statue"]["at"]), state
    assert len(boxes) > 5


def test_what_is_the_same_for_all_cells_is_asked_once(tmp_path: Path) -> None:
    path = tmp_path / "shapes.yaml"
    path.write_text(SCENARIO % "number == 2")
    program = socialai_dsl.compile(socialai_dsl.load(path))
    assert isinstance(program, socialai_dsl.Program), program
    assert "EACH_CELL" not in program.listing()
    env = socialai_dsl.make(path)
    seen = set()
    for _ in range(30):
        env.reset()
        state = env.describe()
        seen.add((state["let"]["number"], state["box"]["at"] is not None))
    assert seen == {(1, False), (2, True)}


def test_what_all_have_to_be_is_taken_apart() -> None:
    """Nested conjunctions and negated disjunctions are shapes one after another."""
    at_either = Logic("or", (Relation("at", HERE, entity(AGENT)), Relation("at", HERE, entity(GUIDE))))
    nested = Logic("and", (Compare("!=", x_of(HERE), number(1)), Not(at_either)))
    whole = Logic("and", (Relation("in_line", HERE, entity(AGENT)), nested))
    assert not loops(cells("count", whole, NUMBER))
    assert worth(cells("count", whole, NUMBER)) == worth(cells("count", asked_one_by_one(whole), NUMBER)) == 6
