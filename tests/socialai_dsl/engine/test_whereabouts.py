"""Where an entity is asked for its place, a cell will do."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.program import CELL, Body, Field, Op, Register
from tests.assembly import Assembly, batch_of, constant, entity_register, holds, result_of, step, temporary

AGENT = (2, 2)
ROOM = {"at": (AGENT, (1, 1)), "npcs": 1}


def cell(x: int, y: int) -> int:
    """The operand that stands for a cell."""
    return constant(CELL + 32 * y + x)


NO_CELL = constant(CELL - 1)


@pytest.mark.parametrize(
    ("op", "facing", "there", "elsewhere"),
    [
        (Op.IF_SAME_CELL, 0, (2, 2), (2, 3)),
        (Op.IF_NEXT_TO, 0, (2, 3), (3, 3)),
        (Op.IF_FACES, 1, (2, 3), (3, 2)),
        (Op.IF_FACES, 1, (2, 3), (2, 4)),
        (Op.IF_FACES_TOWARD, 1, (1, 3), (1, 2)),
        (Op.IF_IN_LINE, 0, (2, 0), (1, 3)),
        (Op.IF_REACHES, 0, (3, 3), (5, 6)),
        (Op.IF_LOOKS_AT, 2, (0, 2), (4, 2)),
        (Op.IF_UNOBSTRUCTED, 0, (2, 4), (3, 3)),
    ],
)
def test_relations_of_an_entity_and_a_cell(
    op: Op, facing: int, there: tuple[int, int], elsewhere: tuple[int, int]
) -> None:
    room = {**ROOM, "facing": (facing,)}
    assert holds((op, constant(0), cell(*there)), **room)
    assert not holds((op, constant(0), cell(*elsewhere)), **room)
    assert not holds((op, constant(0), NO_CELL), **room), "what is nowhere is in no relation"
    gone = {**room, "reset": [(Op.VANISH, constant(0))]}
    assert not holds((op, constant(0), cell(*there)), **gone)


@pytest.mark.parametrize("op", [Op.IF_SAME_CELL, Op.IF_NEXT_TO, Op.IF_IN_LINE, Op.IF_UNOBSTRUCTED])
def test_relations_in_which_either_may_be_a_cell(op: Op) -> None:
    there = AGENT if op == Op.IF_SAME_CELL else (2, 3)
    assert holds((op, cell(*there), constant(0)), **ROOM)
    assert holds((op, cell(*there), cell(*AGENT)), **ROOM)
    assert not holds((op, cell(3, 3), constant(0)), **ROOM)
    assert not holds((op, NO_CELL, NO_CELL), **ROOM)


@pytest.mark.parametrize("op", [Op.IF_FACES, Op.IF_FACES_TOWARD, Op.IF_LOOKS_AT, Op.IF_EYE_CONTACT])
def test_cells_face_nowhere(op: Op) -> None:
    for place in ((2, 3), (2, 1), (1, 2), (3, 2)):
        assert not holds((op, cell(*place), constant(0)), **ROOM)


def test_a_cell_in_front_of_a_thing() -> None:
    room = {"at": (AGENT, (0, 2)), "objects": ("door",)}
    assert holds((Op.IF_IN_FRONT_OF, cell(1, 2), constant(1)), **room)
    assert not holds((Op.IF_IN_FRONT_OF, cell(1, 1), constant(1)), **room)
    assert not holds((Op.IF_IN_FRONT_OF, constant(0), cell(2, 1)), **room), "a cell has no front"


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ([(Op.DISTANCE, temporary(0), constant(0), cell(4, 1))], 3),
        ([(Op.DISTANCE, temporary(0), cell(4, 1), cell(0, 1))], 4),
        ([(Op.QUADRANT, temporary(0), constant(0), cell(2, 0))], 3),
        ([(Op.QUADRANT, temporary(0), cell(0, 0), constant(0))], 0),
        ([(Op.FIELD, temporary(0), cell(5, 3), Field.X)], 5),
        ([(Op.FIELD, temporary(0), cell(5, 3), Field.Y)], 3),
        ([(Op.FIELD, temporary(0), cell(5, 3), Field.GONE)], 0),
        ([(Op.CELL_OF, temporary(0), constant(0))], CELL + 32 * 2 + 2),
        ([(Op.CELL_OF, temporary(0), cell(5, 3))], CELL + 32 * 3 + 5),
        ([(Op.CELL_OF, temporary(0), NO_CELL)], CELL - 1),
        ([(Op.VANISH, constant(1)), (Op.CELL_OF, temporary(0), constant(1))], CELL - 1),
    ],
)
def test_values_of_cells(block: list[tuple[int, ...]], expected: int) -> None:
    own = Assembly(**ROOM).own  # type: ignore[arg-type]
    assert result_of([*block, (Op.LOAD, own, temporary(0))], **ROOM) == expected


def test_an_entity_without_a_place_is_in_no_cell() -> None:
    room = {"at": (AGENT, None), "npcs": 1}
    own = Assembly(**room).own  # type: ignore[arg-type]
    assert result_of([(Op.CELL_OF, own, constant(1))], **room) == CELL - 1


@pytest.mark.parametrize(
    ("thing", "expected"),
    [
        (cell(2, 2), {(1, 2), (3, 2), (2, 1), (2, 3)}),
        (cell(0, 0), {(1, 0), (0, 1)}),
        (NO_CELL, set()),
    ],
)
def test_cells_next_to_a_cell(thing: int, expected: set[tuple[int, int]]) -> None:
    own = Assembly().own
    rules = [
        (Op.B_NEXT_TO, 0, thing),
        (Op.EACH_CELL, 0, temporary(0), 8),
        *[
            instruction
            for y in range(4)
            for instruction in (
                (Op.IF_EQ, temporary(1), constant(y), 1),
                (Op.SET_BIT, own + y, temporary(0)),
            )
        ],
        (Op.END_EACH, 0, 0, 0),
    ]
    batch = batch_of(Assembly(rules=rules).program())
    step(batch)
    lines = batch.state.registers[0, own : own + 4].tolist()
    assert {(x, y) for y in range(4) for x in range(6) if lines[y] >> x & 1} == expected


@pytest.mark.parametrize("canvas", [(6, 7), (9, 9)])
@pytest.mark.parametrize(
    ("op", "target", "facing", "expected"),
    [
        (Op.GO_TO, (1, 3), 1, Body.FORWARD),
        (Op.GO_TO, (1, 3), 0, Body.RIGHT),
        (Op.GO_TO, (3, 1), 0, Body.FORWARD),
        (Op.GO_TO, (1, 1), 0, Body.NONE),
        (Op.GO_TO, (5, 6), 0, Body.NONE),
        (Op.GO_NEXT_TO, (1, 2), 0, Body.NONE),
        (Op.GO_NEXT_TO, (3, 1), 0, Body.FORWARD),
    ],
)
def test_ways_to_cells(
    canvas: tuple[int, int], op: Op, target: tuple[int, int], facing: int, expected: Body
) -> None:
    """On a small canvas and on one where paths take boards."""
    room = {**ROOM, "canvas": canvas, "facing": (0, facing)}
    assert result_of([(op, constant(1), cell(*target), 0)], Register.LAST_TURN, **room) == expected


@pytest.mark.parametrize("canvas", [(6, 7), (9, 9)])
@pytest.mark.parametrize("target", [(31, 2), (2, 31), (9, 8)])
def test_no_way_leads_off_the_canvas(canvas: tuple[int, int], target: tuple[int, int]) -> None:
    room = {**ROOM, "canvas": canvas}
    for op in (Op.GO_TO, Op.GO_NEXT_TO):
        assert result_of([(op, constant(1), cell(*target), 0)], Register.LAST_TURN, **room) == Body.NONE
    assert not holds((Op.IF_REACHES, constant(1), cell(*target)), **room)


def test_a_register_may_hold_a_cell_or_an_entity() -> None:
    own = Assembly(**ROOM).own  # type: ignore[arg-type]
    rules = [
        (Op.DISTANCE, own + 1, constant(0), own),
        (Op.CELL_OF, own, own),
        (Op.FIELD, own + 2, own, Field.X),
    ]
    batch = batch_of(Assembly(rules=rules, **ROOM).program(), 2)  # type: ignore[arg-type]
    batch.state.registers[:, own] = (1, CELL + 32 * 3 + 3)
    batch.state.registers[:, entity_register(1, Field.X)] = 1
    step(batch)
    np.testing.assert_array_equal(
        batch.state.registers[:, own : own + 3],
        [[CELL + 32 + 1, 2, 1], [CELL + 32 * 3 + 3, 2, 3]],
    )


@pytest.mark.parametrize(
    ("thing", "direction", "cell"),
    [
        (0, 0, (3, 2)),
        (0, 1, (2, 3)),
        (0, 2, (1, 2)),
        (0, 3, (2, 1)),
        (CELL + 32 * 0 + 5, 0, None),
        (CELL + 32 * 0 + 5, 3, None),
        (CELL + 32 * 0 + 5, 1, (5, 1)),
        (CELL + 32 * 6 + 0, 2, None),
        (CELL - 1, 0, None),
        (1, 0, None),
    ],
)
def test_the_cell_beside(thing: int, direction: int, cell: tuple[int, int] | None) -> None:
    at = ((2, 2), None)
    own = Assembly(at=at).own
    beside = result_of(
        [(Op.CELL_BESIDE, own, constant(thing), constant(direction))], own, at=at, objects=("door",)
    )
    assert beside == (CELL - 1 if cell is None else CELL + 32 * cell[1] + cell[0])
