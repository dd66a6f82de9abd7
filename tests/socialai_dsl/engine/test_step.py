"""What a step takes: outcomes by utterance and body, and the actions it is given."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.calls import BAD_ACTION, Task
from socialai_dsl.program import Body, Op
from tests.assembly import Assembly, batch_of, step

SILENT = (7, 0, 0, 0)


@pytest.mark.parametrize(
    ("action", "ended"),
    [((7, 1, 0, 1), True), ((5, 1, 0, 1), False), ((7, 1, 0, 2), False), ((7, 0, 0, 1), False)],
)
def test_outcomes_are_looked_up_by_utterance_and_body(action: tuple[int, ...], ended: bool) -> None:
    batch = batch_of(Assembly(outcomes={(2, Body.NONE): [(Op.END, 0, 40)]}).program())
    step(batch, action)
    ports = batch.ports
    assert (bool(ports.terminated[0]), ports.outcome[0]) == ((True, 0) if ended else (False, -1))
    assert ports.reward[0] == pytest.approx(0.4 * 0.91 if ended else 0.0)


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
