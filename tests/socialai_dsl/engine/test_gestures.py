"""Gestures in the pictures of batches: of several programs, at the end of an episode, in digests."""

from __future__ import annotations

from typing import Any

import numpy as np

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
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


def test_programs_with_four_channels_have_no_more() -> None:
    plain = Assembly(at=((1, 2), (2, 2)), npcs=1).program()
    assert batch_of(plain).state.extra.shape == (1, 0)
    rich = Assembly(at=((1, 2), (2, 2)), npcs=1, channels=6).program()
    both = Batch([part_of(plain), part_of(rich)], [[0], [1]], [0, 1], 8)
    both.state.extra[:] = 7
    both.reset()
    assert (both.state.extra[0] == 0xFFFF).all()
    assert both.state.extra[1, AHEAD] == LAST_ACTS["none"] << 8 | NO_GESTURE


def test_pictures_that_differ_in_a_gesture_have_different_digests() -> None:
    batch = performing((Op.POINT, constant(1), constant(2)))
    before, image = batch.identify(), batch.state.image.copy()
    step(batch)
    assert np.array_equal(batch.state.image, image)
    assert batch.identify() != before


def test_the_last_gestures_of_an_episode_are_kept() -> None:
    batch = performing((Op.POINT, constant(1), constant(2)), horizon=1)
    batch.ports.actions[:] = (7, 0, 0, 0)
    assert batch.step(Task.STEP_SAME) == 1
    assert batch.ports.final_extra[0, AHEAD] == (LAST_ACTS["point"] + 2) << 8 | 2
    assert batch.state.extra[0, AHEAD] == LAST_ACTS["none"] << 8 | NO_GESTURE
