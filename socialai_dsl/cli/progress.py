"""The progress of a training run: a live bar on a terminal, plain lines elsewhere."""

import time
from collections import deque
from types import TracebackType
from typing import IO, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

_SECONDS_BETWEEN_LINES = 5.0
_SECONDS_BETWEEN_SENTENCES = 15.0
_REMEMBERED_UPDATES = 20


class TrainingProgress:
    """Reports frames, frames per second, success and the time left; use it in a `with` statement.

    On a terminal one line is redrawn; otherwise a line is written every few seconds, so that logs stay short.
    """

    def __init__(self, total: int, stream: IO[str]) -> None:
        """Report on a run of `total` frames, writing to `stream`."""
        self._total = total
        self._stream = stream
        self._last_line = self._last_sentence = time.monotonic()
        self._success: deque[float] = deque(maxlen=_REMEMBERED_UPDATES)
        self._speed: deque[float] = deque(maxlen=_REMEMBERED_UPDATES)
        self._bar: Progress | None = None
        if stream.isatty():
            self._bar = Progress(
                TextColumn("training"),
                BarColumn(bar_width=28),
                TaskProgressColumn(),
                TextColumn("{task.fields[text]}"),
                console=Console(file=stream),
            )
            self._task = self._bar.add_task("training", total=total, text="")

    def __enter__(self) -> Self:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def update(self, frames: int, success: float | None, speed: float, said: str = "") -> None:
        """Report one update.

        Args:
            frames: frames trained so far, earlier parts of a resumed run included.
            success: share of the episodes ended in this update that succeeded; None if none ended.
            speed: frames per second of this update.
            said: what the agent has learnt so far, in words; shown now and then.
        """
        if success is not None:
            self._success.append(success)
        self._speed.append(speed)
        text = self._text(frames)
        if self._bar is not None:
            self._bar.update(self._task, completed=min(frames, self._total), text=text)
        elif time.monotonic() - self._last_line > _SECONDS_BETWEEN_LINES or frames >= self._total:
            self._last_line = time.monotonic()
            print(f"{frames:>12,} of {self._total:,} frames  {text}", file=self._stream, flush=True)
        now = time.monotonic()
        if said and (now - self._last_sentence > _SECONDS_BETWEEN_SENTENCES or frames >= self._total):
            self._last_sentence = now
            self._say(said)

    def _say(self, sentence: str) -> None:
        if self._bar is not None:
            self._bar.console.print(f"  {sentence}", highlight=False, markup=False)
        else:
            print(f"    {sentence}", file=self._stream, flush=True)

    def _text(self, frames: int) -> str:
        # The mean time of a frame, not the mean speed: a slow update counts for as long as it took.
        speed = len(self._speed) / sum(1 / max(s, 1e-9) for s in self._speed)
        left = max(self._total - frames, 0) / speed
        success = f"  success {sum(self._success) / len(self._success):.3f}" if self._success else ""
        return f"{speed:>9,.0f} frames/s{success}  {_clock(left)} left"


def _clock(seconds: float) -> str:
    """Seconds as h:mm:ss or m:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
