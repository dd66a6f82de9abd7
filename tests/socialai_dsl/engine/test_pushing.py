"""What pushing, rolling and putting do in moments that no scenario can bring about by itself."""

from __future__ import annotations

import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.program import Body, Field, Flag, Op, Register
from tests.assembly import (
    GENERATOR,
    PRESSED,
    ROLLING,
    Assembly,
    Instruction,
    batch_of,
    constant,
    entity_register,
    step,
)

ROLLS = int(Flag.ROLLS)
FORWARD = (int(Body.FORWARD), 0, 0, 0)


def entity(batch: Batch, number: int, *fields: Field) -> list[int]:
    return [int(batch.state.registers[0, entity_register(number, name)]) for name in fields]


def code_at(batch: Batch, x: int, y: int, width: int = 9) -> int:
    return int(batch.state.boards[0, y * width + x] & 0xFF)


def corridor(at: tuple[tuple[int, int], ...], objects: tuple[str, ...], **more: object) -> Batch:
    """A room of 9 by 5 in which the agent looks to the right, everybody else where `at` says."""
    room = {"size": (9, 5), "canvas": (9, 5), "flags": ROLLS, **more}
    return batch_of(Assembly(at=at, objects=objects, **room).program())  # type: ignore[arg-type]


def test_what_stands_where_an_npc_stands_is_pushed() -> None:
    batch = corridor(((2, 2), (3, 2), (3, 2)), ("generator",), npcs=1)
    step(batch, FORWARD)
    assert entity(batch, 2, Field.STATUS) == [PRESSED]


def test_a_marble_that_is_gone_does_not_roll() -> None:
    rolling: list[Instruction] = [
        (Op.LOAD, entity_register(1, Field.STATUS), constant(ROLLING)),
        (Op.VANISH, constant(1)),
    ]
    batch = corridor(((2, 2), (3, 2)), ("marble",), reset=rolling)
    step(batch)
    assert entity(batch, 1, Field.X, Field.STATUS) == [3, ROLLING]


def test_placing_draws_both_cells_and_counts_as_a_change() -> None:
    own = Assembly(at=((2, 2), (3, 2))).own
    settled: list[Instruction] = [(Op.ADD, own, own, constant(1))]
    move: list[Instruction] = [(Op.IF_EQ, Register.T, constant(1), 1), (Op.PLACE, constant(1), 2048 + 0)]
    move[1] = (Op.PLACE, constant(1), constant(2048 + 32 * 1 + 5))
    batch = corridor(((2, 2), (3, 2)), ("generator",), rules=move, settle=settled)
    before = int(batch.state.registers[0, own])
    step(batch)
    assert entity(batch, 1, Field.X, Field.Y) == [5, 1]
    assert (code_at(batch, 3, 2), code_at(batch, 5, 1)) == (1, GENERATOR)
    step(batch)
    assert batch.state.registers[0, own] == before + 1


@pytest.mark.parametrize("cell", [2047, 2048 + 32 * 1 + 20, 2048 + 32 * 20 + 1])
def test_nothing_is_placed_off_the_canvas(cell: int) -> None:
    batch = corridor(((2, 2), (3, 2)), ("generator",), rules=[(Op.PLACE, constant(1), constant(cell))])
    step(batch)
    assert entity(batch, 1, Field.X, Field.Y) == [3, 2]
