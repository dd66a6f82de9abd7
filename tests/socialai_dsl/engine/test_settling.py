"""Code that lets statuses follow from others runs after pins, and for a scripted look, which takes it back."""

from __future__ import annotations

import numpy as np

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Flag, Op, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import (
    CLOSED,
    LOCKED,
    OPEN,
    Assembly,
    FrameSpec,
    batch_of,
    constant,
    entity_register,
)

ALWAYS = int(Flag.SETTLE_ALWAYS)


# A lever would unlock: here an open door at (0, 2) lets the locked one at (4, 2) become closed.
LINKED = {
    "at": ((1, 2), (0, 2), (2, 0)),
    "objects": ("door", "door"),
    "facing": (2,),
    "links": [
        (Op.IF_EQ, entity_register(1, Field.STATUS), constant(OPEN), 2),
        (Op.IF_EQ, entity_register(2, Field.STATUS), constant(LOCKED), 1),
        (Op.BECOME, constant(2), constant(CLOSED)),
    ],
    "reset": [(Op.LOAD, entity_register(2, Field.STATUS), constant(LOCKED))],
}


def statuses(batch: Batch) -> list[int]:
    return [int(batch.state.registers[0, entity_register(n, Field.STATUS)]) for n in (1, 2)]


def test_pins_are_settled() -> None:
    batch = batch_of(Assembly(**LINKED).program())  # type: ignore[arg-type]
    pins = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
    pins[1, entity_register(1, Field.STATUS)] = OPEN
    batch.ports.layout[:] = 1
    batch.reset(pins)
    assert statuses(batch) == [OPEN, CLOSED]
    line = batch.state.boards[0, :42].reshape(7, 6)
    assert line[0, 2] >> 16 & 0xFF == CLOSED


def test_a_scripted_look_disturbs_nothing() -> None:
    """Code that runs before a step, links and settling run for it, and all of it is taken back."""
    at = (*LINKED["at"], (3, 3))  # type: ignore[misc]
    own = Assembly(at=at).own
    frame = FrameSpec(
        0,
        (
            [
                # It toggles once what was noted before the step says so.
                (Op.BODY, constant(Body.TOGGLE)),
                (Op.IF_EQ, own + 2, constant(0), 1),
                (Op.BODY, constant(Body.NONE)),
            ],
        ),
        then=({-1: [(Op.VANISH, constant(1))]},),
    )
    room = {
        **LINKED,
        "at": at,
        "objects": ("door", "door", "lava"),
        "frames": (frame,),
        "flags": int(Flag.AGENT_FRAME) | ALWAYS,
        "before": [(Op.LOAD, own + 2, constant(1)), (Op.COUNT, 0)],
        "settle": [(Op.ADD, own + 3, own + 3, constant(1))],
    }
    batch = batch_of(Assembly(**room).program(), 3)  # type: ignore[arg-type]
    batch.state.registers[:, Register.CHANGED] = (0, 1, 1)
    before = [array.copy() for array in (*batch.state, batch.counters)]
    batch.script()
    assert batch.ports.actions[:, 0].tolist() == [Body.TOGGLE] * 3
    for was, now in zip(before, (*batch.state, batch.counters), strict=True):
        np.testing.assert_array_equal(was, now)
    batch.step(Task.STEP_ONLY)
    assert batch.state.registers[:, entity_register(1, Field.GONE)].tolist() == [1] * 3
