"""In a batch of several programs each shows the gestures that it declares."""

from __future__ import annotations

from typing import Any

import numpy as np

from socialai_dsl.engine.batch import Batch
from socialai_dsl.program import CELL, LAST_ACTS, NO_GESTURE, Op, Register
from tests.assembly import (
    Assembly,
    FrameSpec,
    Instruction,
    batch_of,
    constant,
    part_of,
    step,
)

NOTHING = [NO_GESTURE, NO_GESTURE]
AHEAD = 3 * 7 + 5


def shown(batch: Batch, cell: int = AHEAD, channels: int = 2) -> list[int]:
    """The channels behind the fourth of a cell of the picture, by default the one ahead."""
    held = batch.state.extra.view(np.uint8)[:, : 49 * channels]
    return held.reshape(-1, 49, channels)[0, cell].tolist()


def performing(*turns: Instruction, **more: object) -> Batch:
    """The agent looks right at an NPC that does one thing in each step, then nothing."""
    activity: list[Instruction] = []
    for t, turn in enumerate(turns, 1):
        activity += [(Op.IF_EQ, Register.T, constant(t), 1), turn]
    room = {"at": ((1, 2), (2, 2)), "npcs": 1, "channels": 6, **more}
    return batch_of(Assembly(frames=(FrameSpec(1, (activity,)),), **room).program())  # type: ignore[arg-type]


def test_a_direction_is_no_cell_and_a_program_shows_what_it_declares() -> None:
    batch = performing((Op.POINT, constant(1), constant(3)), channels=8)
    step(batch)
    assert shown(batch, channels=4) == [3, LAST_ACTS["point"] + 3, *NOTHING]
    activity = [(Op.POINT, constant(1), constant(CELL + 32 + 3))]
    room: Any = {"at": ((1, 2), (2, 2)), "npcs": 1, "frames": (FrameSpec(1, (activity,)),)}
    parts = [part_of(Assembly(channels=channels, **room).program()) for channels in (4, 6, 8)]
    batch = Batch(parts, [[0], [1], [2]], [0, 1, 2], 8)
    batch.reset()
    step(batch)
    rows = batch.state.extra.view(np.uint8)[:, : 4 * 49].reshape(3, 49, 4)[:, AHEAD].tolist()
    assert rows == [2 * NOTHING, [3, 7, *NOTHING], [3, 7, 127, 129]]
