"""Instructions at the edges of what they take, and what they count."""

import pytest

from socialai_dsl.program import CELL, Op, Register
from tests.assembly import (
    Assembly,
    Instruction,
    batch_of,
    constant,
    holds,
    result_of,
    step,
    temporary,
)

RESULT = Assembly().own  # entities: the agent alone


@pytest.mark.parametrize(
    ("op", "left", "right", "expected"),
    [
        (Op.ADD, 3, -5, -2),
        (Op.SUB, 3, -5, 8),
        (Op.MUL, -3, 5, -15),
        (Op.DIV, -7, 2, -4),
        (Op.DIV, 7, 0, 0),
        (Op.MOD, -7, 3, 2),
        (Op.MOD, 7, -3, -2),
        (Op.MOD, 7, 0, 0),
        (Op.MIN, -3, 5, -3),
        (Op.MAX, -3, 5, 5),
    ],
)
def test_arithmetic(op: Op, left: int, right: int, expected: int) -> None:
    assert result_of([(op, RESULT, constant(left), constant(right))]) == expected


@pytest.mark.parametrize(
    ("test", "expected"),
    [
        ((Op.IF_EQ, constant(4), constant(4)), True),
        ((Op.IF_EQ, constant(4), constant(5)), False),
        ((Op.IF_NE, constant(4), constant(5)), True),
        ((Op.IF_NE, constant(4), constant(4)), False),
        ((Op.IF_LT, constant(-4), constant(4)), True),
        ((Op.IF_LT, constant(4), constant(4)), False),
        ((Op.IF_LE, constant(4), constant(4)), True),
        ((Op.IF_LE, constant(5), constant(4)), False),
        ((Op.IF_BIT, constant(0b100), constant(2)), True),
        ((Op.IF_BIT, constant(0b100), constant(1)), False),
        ((Op.IF_BIT, constant(0b100), constant(-1)), False),
        ((Op.IF_CHANCE, 65536, 0), True),
        ((Op.IF_CHANCE, 0, 0), False),
        ((Op.IF_UNPINNED, Register.WIDTH, 0), True),
    ],
)
def test_comparisons(test: Instruction, expected: bool) -> None:
    assert holds((*test, 2)) == expected


def test_count_and_end() -> None:
    rules = [
        (Op.COUNT, 0),
        (Op.IF_EQ, Register.T, constant(3), 1),
        (Op.END, 1, 50),
    ]
    batch = batch_of(Assembly(rules=rules, horizon=10).program())
    for _ in range(3):
        step(batch)
    assert batch.ports.terminated[0]
    assert batch.ports.outcome[0] == 1
    assert batch.ports.reward[0] == pytest.approx(0.5 * (1 - 0.9 * 3 / 10))
    assert batch.counters.tolist() == [3, 0, 1, 0, 0, 1]


def test_cells_are_visited_in_the_widest_room() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.EACH_CELL, 0, temporary(0), 2),
        (Op.ADD, RESULT, RESULT, constant(1)),
        (Op.LOAD, RESULT + 1, temporary(2)),
        (Op.END_EACH, 0, 0, 0),
    ]
    batch = batch_of(Assembly(size=(30, 30), canvas=(30, 30), reset=reset).program())
    assert batch.state.registers[0, RESULT : RESULT + 2].tolist() == [28 * 28, CELL + 32 * 28 + 28]
