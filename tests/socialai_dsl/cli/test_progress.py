"""Progress without a terminal: plain lines, numbers that make sense."""

import io
from dataclasses import replace
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.cli import progress
from socialai_dsl.cli.progress import RunProgress
from socialai_dsl.runs.folder import Run
from socialai_dsl.runs.train import Progress


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress.time, "monotonic", clock)
    return clock


def test_one_of_a_kind_is_singular() -> None:
    program = socialai_dsl.compile(socialai_dsl.load("help"))
    one = replace(program, actions=program.actions[:1])
    assert progress._size(one) == "1 action, 4 utterances, 9 words"


class Training:
    """A run of so many frames, and what is shown of it behind its first line."""

    def __init__(self, total: int, stream: io.StringIO, folder: Path) -> None:
        self.total, self.run = total, Run(folder)
        self.program = socialai_dsl.compile(socialai_dsl.load("help"))
        self.shown = RunProgress(stream, "help")
        self.shown.update(Progress(self.run, self.program, 0, total))
        assert stream.getvalue().startswith(f"help: 7 actions, 4 utterances, 9 words; writing to {folder}\n")
        stream.seek(0)
        stream.truncate()

    def update(self, frames: int, success: float | None, speed: float, episodes: int = 1) -> None:
        self.shown.update(Progress(self.run, self.program, frames, self.total, success, episodes, speed))


def test_lines_are_rare_and_the_last_update_is_always_shown(clock: Clock, tmp_path: Path) -> None:
    stream = io.StringIO()
    shown = Training(10_000, stream, tmp_path)
    with shown.shown:
        for update in range(1, 101):
            clock.now = update * 0.1
            shown.update(update * 100, 0.5, 1000)
    lines = stream.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[-1].split() == "10,000 of 10,000 frames 1,000 frames/s success 0.500 0:00 left".split()


def test_a_slow_update_counts_for_the_time_it_took(clock: Clock, tmp_path: Path) -> None:
    """100 frames at 100/s and 100 at 300/s are 200 frames in 4/3 s."""
    stream = io.StringIO()
    shown = Training(9_200, stream, tmp_path)
    with shown.shown:
        shown.update(100, None, 100)
        clock.now = 10.0
        shown.update(200, None, 300)
    assert stream.getvalue().split() == "200 of 9,200 frames 150 frames/s 1:00 left".split()


def test_updates_in_which_no_episode_ended_do_not_spoil_the_success(clock: Clock, tmp_path: Path) -> None:
    stream = io.StringIO()
    shown = Training(100, stream, tmp_path)
    with shown.shown:
        shown.update(50, 0.25, 10)
        shown.update(100, None, 10)
    assert "success 0.250" in stream.getvalue()


def test_each_episode_counts_once_however_many_ended_with_it(clock: Clock, tmp_path: Path) -> None:
    stream = io.StringIO()
    shown = Training(100, stream, tmp_path)
    with shown.shown:
        shown.update(50, 1.0, 10, episodes=1)
        shown.update(100, 0.0, 10, episodes=3)
    assert "success 0.250" in stream.getvalue()


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_one_line_that_is_redrawn(tmp_path: Path) -> None:
    stream = Terminal()
    shown = Training(1000, stream, tmp_path)
    with shown.shown:
        for frames in range(100, 1100, 100):
            shown.update(frames, 0.5, 100)
    assert "100%" in stream.getvalue()
    assert "1,000 of" not in stream.getvalue()
