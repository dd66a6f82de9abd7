"""Pointing, and the two channels that show it and the last act of NPCs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import CELL, LAST_ACTS, NO_GESTURE, Body, Field, Flag, Op, Register
from tests.assembly import (
    Assembly,
    FrameSpec,
    Instruction,
    batch_of,
    constant,
    entity_register,
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


def test_pointing_lasts_until_it_stops() -> None:
    batch = performing(
        (Op.POINT, constant(1), constant(3)),
        (Op.BODY, constant(Body.NONE)),
        (Op.BODY, constant(Body.LEFT)),
        (Op.BODY, constant(Body.STOP_POINTING)),
        (Op.BODY, constant(Body.NONE)),
    )
    assert shown(batch) == [NO_GESTURE, LAST_ACTS["none"]]
    seen = []
    for _ in range(5):
        step(batch)
        seen.append((int(batch.state.registers[0, entity_register(1, Field.POINTING)]), shown(batch)))
    assert seen == [
        (4, [3, LAST_ACTS["point"] + 3]),
        (4, [3, LAST_ACTS["none"]]),
        (4, [3, LAST_ACTS["left"]]),
        (0, [NO_GESTURE, LAST_ACTS["stop"]]),
        (0, [NO_GESTURE, LAST_ACTS["none"]]),
    ]


@pytest.mark.parametrize(
    ("action", "word"),
    [
        (Body.LEFT, "left"),
        (Body.RIGHT, "right"),
        (Body.TOGGLE, "toggle"),
        (Body.DONE, "none"),
        (Body.NONE, "none"),
    ],
)
def test_last_acts(action: Body, word: str) -> None:
    batch = performing((Op.BODY, constant(action)))
    step(batch)
    assert shown(batch) == [NO_GESTURE, LAST_ACTS[word]]


def test_a_step_forward_is_seen_where_it_led() -> None:
    batch = performing((Op.BODY, constant(Body.FORWARD)))
    step(batch)
    assert shown(batch) == NOTHING
    assert shown(batch, AHEAD - 1) == [NO_GESTURE, LAST_ACTS["forward"]]


@pytest.mark.parametrize("own", range(4))
def test_directions_relative_to_the_agent(own: int) -> None:
    at = ((2, 2), ((3, 2), (2, 3), (1, 2), (2, 1))[own])
    batch = performing((Op.POINT, constant(1), constant(1)), at=at, facing=(own,), flags=int(Flag.EGOCENTRIC))
    step(batch)
    relative = (1 - own + 2) % 4
    assert shown(batch) == [relative, LAST_ACTS["point"] + relative]


@pytest.mark.parametrize("own", range(4))
def test_cells_relative_to_the_agent(own: int) -> None:
    """An NPC ahead points at a cell two to the right and one nearer, as the agent sees it; then it walks on."""
    ahead, right = ((1, 0), (0, 1), (-1, 0), (0, -1))[own], ((0, 1), (-1, 0), (0, -1), (1, 0))[own]
    npc = 4 + ahead[0], 4 + ahead[1]
    cell = npc[0] + 2 * right[0] - ahead[0], npc[1] + 2 * right[1] - ahead[1]
    batch = performing(
        (Op.POINT, constant(1), constant(CELL + 32 * cell[1] + cell[0])),
        (Op.BODY, constant(Body.FORWARD)),
        at=((4, 4), npc),
        facing=(own, own),
        size=(9, 9),
        canvas=(9, 9),
        channels=8,
    )
    direction = (own + 1) % 4
    step(batch)
    assert shown(batch, channels=4) == [direction, LAST_ACTS["point"] + direction, 130, 127]
    step(batch)
    assert shown(batch, AHEAD - 1, channels=4) == [direction, LAST_ACTS["forward"], 130, 126]
    assert shown(batch, channels=4) == 2 * NOTHING


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


def test_nothing_is_shown_of_other_cells_or_hidden_npcs() -> None:
    batch = performing((Op.POINT, constant(1), constant(1)))
    step(batch)
    others = np.delete(np.arange(49), AHEAD)
    assert (batch.state.extra[0, others] == 0xFFFF).all()
    batch = performing((Op.POINT, constant(1), constant(1)), flags=int(Flag.NPCS_HIDDEN))
    step(batch)
    assert (batch.state.extra == 0xFFFF).all()
    assert batch.state.registers[0, entity_register(1, Field.POINTING)] == 2, "it points all the same"


def test_the_picture_before_npcs_shows_what_they_did_the_step_before() -> None:
    batch = performing(
        (Op.POINT, constant(1), constant(2)),
        (Op.BODY, constant(Body.STOP_POINTING)),
        flags=int(Flag.PICTURE_BEFORE_NPCS),
    )
    step(batch)
    assert shown(batch) == [NO_GESTURE, LAST_ACTS["none"]]
    step(batch)
    assert shown(batch) == [2, LAST_ACTS["point"] + 2]


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
