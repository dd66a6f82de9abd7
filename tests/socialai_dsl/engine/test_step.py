"""The order of a step: ends, rewards, pictures."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import BAD_ACTION, Task
from socialai_dsl.program import Body, Flag, Op, Register
from tests.assembly import Assembly, FrameSpec, batch_of, constant

SILENT = (7, 0, 0, 0)


def play(batch: Batch, *actions: tuple[int, ...], task: Task = Task.STEP_ONLY) -> list[int]:
    ended = []
    for action in actions:
        batch.ports.actions[:] = action
        ended.append(batch.step(task))
    return ended


def ends(batch: Batch) -> tuple[bool, bool, int, float]:
    ports = batch.ports
    return bool(ports.terminated[0]), bool(ports.truncated[0]), int(ports.outcome[0]), float(ports.reward[0])


def test_time_runs_out() -> None:
    batch = batch_of(Assembly(horizon=3).program())
    assert play(batch, SILENT, SILENT) == [0, 0]
    assert ends(batch) == (False, False, -1, 0.0)
    assert play(batch, SILENT) == [1]
    assert ends(batch) == (False, True, 3, 0.0)
    assert batch.state.registers[0, Register.ENDED] == 2
    assert batch.counters.tolist() == [0, 0, 0, 0, 1, 1]


def test_an_outcome_in_the_last_step_is_not_a_time_out() -> None:
    batch = batch_of(Assembly(horizon=3, outcomes={(-1, Body.DONE): [(Op.END, 0, 100)]}).program())
    play(batch, SILENT, SILENT, (int(Body.DONE), 0, 0, 0))
    assert ends(batch) == (True, False, 0, pytest.approx(0.1))


@pytest.mark.parametrize(
    ("action", "ended"),
    [((7, 1, 0, 1), True), ((5, 1, 0, 1), False), ((7, 1, 0, 2), False), ((7, 0, 0, 1), False)],
)
def test_outcomes_are_looked_up_by_utterance_and_body(action: tuple[int, ...], ended: bool) -> None:
    batch = batch_of(Assembly(outcomes={(2, Body.NONE): [(Op.END, 0, 40)]}).program())
    play(batch, action)
    assert ends(batch) == ((True, False, 0, pytest.approx(0.4 * 0.91)) if ended else (False, False, -1, 0.0))


def test_deadly_comes_before_any_outcome() -> None:
    room = {
        "at": ((1, 1), (2, 1)),
        "objects": ("lava",),
        "outcomes": {(-1, -1): [(Op.IF_EQ, Register.T, constant(1), 1), (Op.END, 0, 100)]},
    }
    forward = (int(Body.FORWARD), 0, 0, 0)
    batch = batch_of(Assembly(deadly=True, **room).program())  # type: ignore[arg-type]
    play(batch, forward)
    assert ends(batch) == (True, False, 2, 0.0)
    batch = batch_of(Assembly(deadly=False, **room).program())  # type: ignore[arg-type]
    play(batch, forward)
    assert ends(batch) == (True, False, 0, pytest.approx(0.91))


@pytest.mark.parametrize(("flags", "direction"), [(0, 1), (int(Flag.PICTURE_BEFORE_NPCS), 0)])
def test_the_picture_is_taken_after_or_before_the_npcs(flags: int, direction: int) -> None:
    frame = FrameSpec(1, ([(Op.BODY, constant(Body.RIGHT))],))
    batch = batch_of(Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(frame,), flags=flags).program())
    play(batch, SILENT)
    assert batch.state.image.view(np.uint8).reshape(7, 7, 4)[3, 5].tolist() == [11, 0, 1, direction]
    play(batch, (int(Body.LEFT), 0, 0, 0))
    seen = batch.state.image.view(np.uint8).reshape(7, 7, 4)
    assert seen[4, 6].tolist() == [11, 0, 1, direction + 1], "what the agent did itself is in either picture"


def test_a_bad_action_is_refused_and_changes_nothing() -> None:
    batch = batch_of(Assembly().program(), 3)
    before = [array.copy() for array in batch.state]
    for column, value in ((0, 8), (0, -1), (1, 2), (2, 2), (3, 3), (3, -1)):
        batch.ports.actions[:] = SILENT
        batch.ports.actions[1, column] = value
        assert batch.step(Task.STEP_ONLY) == BAD_ACTION
    for was, now in zip(before, batch.state, strict=True):
        np.testing.assert_array_equal(was, now)


def test_given_actions_are_copied_and_only_for_that_step() -> None:
    rows = 200
    own, given_to = (batch_of(Assembly().program(), rows) for _ in range(2))
    actions = np.tile(np.array(SILENT), (rows, 1))
    actions[::3, 0] = Body.LEFT
    own.ports.actions[:] = actions
    given = actions.copy()
    assert own.step(Task.STEP_ONLY) == given_to.step(Task.STEP_ONLY, given) == 0
    np.testing.assert_array_equal(given, actions)
    np.testing.assert_array_equal(given_to.ports.actions, actions)
    given[:] = -1
    for batch in (own, given_to):
        assert batch.step(Task.STEP_ONLY) == 0, "what the ports hold is done again"
    for mine, other in zip(own.state, given_to.state, strict=True):
        np.testing.assert_array_equal(mine, other)
    before = [array.copy() for array in own.state]
    assert own.step(Task.STEP_ONLY, given) == BAD_ACTION
    for was, now in zip(before, own.state, strict=True):
        np.testing.assert_array_equal(was, now)


def test_rules_run_after_the_npcs_and_before_the_end() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    frame = FrameSpec(1, ([],), then=({-1: [(Op.ADD, own, own, constant(1))]},))
    room = Assembly(
        at=((1, 1), (2, 2)),
        npcs=1,
        frames=(frame,),
        rules=[(Op.MUL, own, own, constant(2))],
        outcomes={(-1, -1): [(Op.IF_EQ, own, constant(6), 1), (Op.END, 1, 0)]},
    )
    batch = batch_of(room.program())
    assert play(batch, SILENT, SILENT) == [0, 1], "2 after one step, 6 after two"
    assert ends(batch) == (True, False, 1, 0.0)
