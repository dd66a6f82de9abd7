"""Code that begins with comparisons does the same whether the interpreter makes them or not."""

from __future__ import annotations

import pytest

from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Op, Register
from tests.assembly import Assembly, FrameSpec, batch_of, constant, temporary

Code = list[tuple[int, ...]]
TIME = int(Register.T)

ELSE_WHAT_FOLLOWS: Code = [(Op.IF_EQ, TIME, constant(2), 2), (Op.COUNT, 0), (Op.HALT,), (Op.COUNT, 1)]
ONE_BEHIND_ANOTHER: Code = [(Op.IF_LT, constant(1), TIME, 2), (Op.IF_LE, TIME, constant(3), 1), (Op.COUNT, 0)]
ONE_BEYOND_ANOTHER: Code = [
    (Op.IF_LT, TIME, constant(2), 1),
    (Op.COUNT, 0),
    (Op.IF_NE, TIME, constant(4), 1),
    (Op.COUNT, 1),
]
NOTHING_LEFT: Code = [(Op.IF_LT, TIME, constant(0), 0), (Op.IF_EQ, TIME, TIME, 0)]
"""Tests of which nothing depends."""


@pytest.mark.parametrize("by_itself", [True, False], ids=["by itself", "in the interpreter"])
@pytest.mark.parametrize("where", ["first", "then"])
@pytest.mark.parametrize(
    ("code", "counted"),
    [
        pytest.param(ELSE_WHAT_FOLLOWS, [1, 4], id="else what follows"),
        pytest.param(ONE_BEHIND_ANOTHER, [2, 0], id="one behind another"),
        pytest.param(ONE_BEYOND_ANOTHER, [1, 4], id="one beyond another"),
        pytest.param(NOTHING_LEFT, [0, 0], id="nothing left"),
    ],
)
def test_comparisons_are_made(code: Code, counted: list[int], where: str, by_itself: bool) -> None:
    before = [] if by_itself else [(Op.LOAD, temporary(0), constant(0))]
    frame = FrameSpec(1, ([],), **{where: ({-1: [*before, *code]},)})  # type: ignore[arg-type]
    batch = batch_of(Assembly(at=((1, 1), (2, 3)), npcs=1, frames=(frame,)).program())
    for _ in range(5):
        batch.step(Task.STEP_ONLY)
    assert batch.counters[:2].tolist() == counted
