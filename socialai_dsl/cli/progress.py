"""The progress of a run: a live bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from importlib.util import find_spec
from types import TracebackType
from typing import IO, TYPE_CHECKING, Self

from socialai_dsl.diagnostics import counted
from socialai_dsl.program_suite import Playable
from socialai_dsl.runs import train

if TYPE_CHECKING:
    from rich.progress import Progress

_SECONDS_BETWEEN_LINES = 5.0
_SECONDS_BETWEEN_SENTENCES = 15.0


class RunProgress:
    """Reports what is run, then frames, frames per second, success and the time left; use it in a `with` statement.

    On a terminal one line is redrawn; otherwise a line is written every few seconds, so that logs stay short.
    """

    def __init__(self, stream: IO[str], scenario: str | None = None) -> None:
        """Report on a run of this scenario, as the user called it, writing to `stream`."""
        self._stream = stream
        self._scenario = scenario
        self._last_line = self._last_sentence = time.monotonic()
        self._pace = train.Pace()
        self._bar: Progress | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def update(self, progress: train.Progress) -> None:
        """Report how far the run is."""
        if not self._pace.speed and not progress.frames_per_second:
            self._begin(progress)
            return
        self._pace.note(progress)
        frames, total, text = progress.frames, progress.total, self._text(progress)
        if self._bar is not None:
            self._bar.update(self._task, completed=min(frames, total), text=text)
        elif time.monotonic() - self._last_line > _SECONDS_BETWEEN_LINES or frames >= total:
            self._last_line = time.monotonic()
            print(f"{frames:>12,} of {total:,} frames  {text}", file=self._stream, flush=True)
        now = time.monotonic()
        if progress.learnt and (now - self._last_sentence > _SECONDS_BETWEEN_SENTENCES or frames >= total):
            self._last_sentence = now
            self._say(progress.learnt)
        if self._bar is not None and frames >= total:
            self._bar.stop()

    def _begin(self, progress: train.Progress) -> None:
        size, folder = _size(progress.program), progress.run.folder
        name = self._scenario or progress.run.config.scenario
        print(f"{name}: {size}; writing to {folder}", file=self._stream, flush=True)
        if progress.total and self._stream.isatty() and find_spec("rich") is not None:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

            self._bar = Progress(
                TextColumn("training"),
                BarColumn(bar_width=28),
                TaskProgressColumn(),
                TextColumn("{task.fields[text]}"),
                console=Console(file=self._stream),
            )
            self._task = self._bar.add_task("training", total=progress.total, text="")
            self._bar.start()

    def _say(self, sentence: str) -> None:
        if self._bar is not None:
            self._bar.console.print(f"  {sentence}", highlight=False, markup=False)
        else:
            print(f"    {sentence}", file=self._stream, flush=True)

    def _text(self, progress: train.Progress) -> str:
        pace, left = self._pace, _clock(self._pace.seconds_left(progress))
        success = "" if pace.success is None else f"  success {pace.success:.3f}"
        return f"{pace.speed:>9,.0f} frames/s{success}  {left} left"


def _size(program: Playable) -> str:
    """The size of the agent's choices, in one phrase."""
    said = sum(1 for _ in program.sentences.each())
    sizes = {"action": len(program.actions), "utterance": said, "word": len(program.vocabulary)}
    return ", ".join(counted(number, noun) for noun, number in sizes.items())


def _clock(seconds: float) -> str:
    """Seconds as h:mm:ss or m:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
