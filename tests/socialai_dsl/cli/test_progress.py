"""Progress without a terminal: plain lines, numbers that make sense."""

import io

import pytest

from socialai_dsl.cli import progress
from socialai_dsl.cli.progress import TrainingProgress


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress.time, "monotonic", clock)
    return clock


def test_lines_are_rare_and_the_last_update_is_always_shown(clock: Clock) -> None:
    stream = io.StringIO()
    with TrainingProgress(10_000, 0, stream) as shown:
        for update in range(1, 101):
            clock.now = update * 0.1
            shown.update(update * 100, 0.5)
    lines = stream.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[-1].split() == "10,000 of 10,000 frames 1,000 frames/s success 0.500 0:00 left".split()


def test_time_left_and_speed_count_only_this_part_of_a_resumed_run(clock: Clock) -> None:
    stream = io.StringIO()
    with TrainingProgress(1_000_000, 900_000, stream) as shown:
        clock.now = 10.0
        shown.update(910_000, None)
    assert stream.getvalue().split()[4:] == "1,000 frames/s success - 1:30 left".split()


def test_updates_in_which_no_episode_ended_do_not_spoil_the_success(clock: Clock) -> None:
    stream = io.StringIO()
    with TrainingProgress(100, 0, stream) as shown:
        shown.update(50, 0.25)
        clock.now = 1.0
        shown.update(100, float("nan"))
    assert "success 0.250" in stream.getvalue()
