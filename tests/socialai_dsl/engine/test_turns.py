"""A look ahead of the script changes nothing, and an answer is counted however its rule is run."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Flag, Op, Register
from tests.assembly import (
    Assembly,
    FrameSpec,
    batch_of,
    constant,
    entity_register,
    play,
    temporary,
)


def body(action: Body) -> tuple[int, ...]:
    return int(action), 0, 0, 0


def entity(batch: Batch, number: int, *fields: Field) -> list[int]:
    return [int(batch.state.registers[0, entity_register(number, name)]) for name in fields]


FORWARD = [(Op.BODY, constant(Body.FORWARD))]


def noting(own: int, digit: int, base: int = 10) -> list[tuple[int, ...]]:
    """Code that appends a digit to a register."""
    return [(Op.MUL, own, own, constant(base)), (Op.ADD, own, own, constant(digit))]


def test_scripted_actions_leave_everything_as_it_is() -> None:
    own = Assembly(at=((2, 2), (3, 2)), npcs=1).own
    frame = FrameSpec(
        0,
        ([(Op.BODY, constant(Body.TOGGLE))],),
        first=({-1: [(Op.COUNT, 0), *noting(own, 1)]},),
        then=({-1: [(Op.SAY, constant(0), constant(2 + 4)), *noting(own, 2)]},),
    )
    lines = tuple((f"line{i}", (2,), 1) for i in range(2 + 6))
    room = Assembly(
        at=((2, 2), (3, 2)),
        npcs=1,
        frames=(frame,),
        lines=lines,
        flags=int(Flag.AGENT_FRAME),
        agent_says=3,
    )
    batch = batch_of(room.program(), 3)
    before = [array.copy() for array in (*batch.state, batch.counters)]
    batch.script()
    assert batch.ports.actions.tolist() == [[Body.TOGGLE, 1, 1, 1]] * 3, "pair 4 is template 1, noun 1"
    for was, now in zip(before, (*batch.state, batch.counters), strict=True):
        np.testing.assert_array_equal(was, now)
    batch.ports.actions[:] = (2, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    assert batch.state.registers[0, own] == 12, "in a step the frame's effects happen"
    assert entity(batch, 0, Field.LAST) == [Body.FORWARD], "but its body does what the action says"
    assert batch.state.registers[0, Register.TEMPLATE] == -1, "and it says what the action says"
    assert batch.state.registers[0, Register.SAID_LINE] == 0


ANSWER_AND_GO = (Op.ANSWER, 2, constant(1), 0 << 8 | 2)
"""Counter 2, line 1, the frame's second state."""


@pytest.mark.parametrize(
    "through",
    [[], [(Op.IF_LE, constant(0), Register.T, 0)], [(Op.LOAD, temporary(0), constant(0))]],
    ids=["alone", "behind a comparison", "in code"],
)
def test_an_answer_counts_says_and_goes_on(through: list[tuple[int, ...]]) -> None:
    """What is an answer but for comparisons `conclude` takes itself; behind anything else the interpreter does."""
    frame = FrameSpec(1, ([], []), then=({-1: [*through, ANSWER_AND_GO]}, {}))
    lines = (("hello", (2,), 1), ("bye", (3,), 1))
    batch = batch_of(Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(frame,), lines=lines).program())
    play(batch, body(Body.NONE), body(Body.NONE))
    registers = batch.state.registers[0]
    assert batch.counters[2] == 1, "the second state has no rule"
    assert batch.state.tokens[0][:2].tolist() == [3, 0]
    assert registers[Register.HEARD] == 0
