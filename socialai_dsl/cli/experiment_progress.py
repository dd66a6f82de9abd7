"""The progress of an experiment's runs: a line for each worker on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from importlib.util import find_spec
from types import TracebackType
from typing import IO, TYPE_CHECKING, Final, Self

from socialai_dsl.cli.experiment_tables import clock
from socialai_dsl.experiments.figures import at_work, seconds_left
from socialai_dsl.experiments.folder import PlannedRun

if TYPE_CHECKING:
    from rich.console import Group
    from rich.live import Live

_SECONDS_BETWEEN_LINES: Final = 30.0
_SECONDS_BETWEEN_LOOKS: Final = 2.0
_SECONDS_BETWEEN_ESTIMATES: Final = 10.0
_FAILURES_SHOWN: Final = 5
_OTHER_LINES: Final = 4
"""Of the picture: below the runs, and what the terminal needs itself."""


class RunsProgress:
    """Reports ends of runs, and how far those at work are; use it in a `with` statement.

    Attributes:
        ends: how many runs have come to which end.
    """

    def __init__(self, runs: Sequence[PlannedRun], stream: IO[str]) -> None:
        """Report on `runs`, writing to `stream`."""
        self._all = runs
        self._left = {run.id: run for run in runs}
        self._stream = stream
        self.ends: Counter[str] = Counter()
        self._failures: list[str] = []
        self._began = time.monotonic()
        self._looked = self._estimated = float("-inf")
        self._wrote = time.monotonic()
        self._estimate = ""
        self._live: Live | None = None
        if stream.isatty() and find_spec("rich") is not None:
            from rich import console, live

            self._live = live.Live(console=console.Console(file=stream), refresh_per_second=2)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def ended(self, run: PlannedRun, outcome: str, message: str) -> None:
        """Report that a run has come to its end."""
        self.ends[outcome] += 1
        self._left.pop(run.id, None)
        if outcome == "failed":
            self._failures.append(f"{run.label}: {message}")
        line = f"[{self.ends.total()}/{len(self._all)}] {run.label}: {outcome}"
        line += f"  success {_success(run)}" if outcome == "done" else ""
        line += f": {message}" if message else ""
        if self._live is not None:
            self._live.console.print(line, markup=False, highlight=False)
        else:
            print(line, file=self._stream, flush=True)

    def look(self) -> None:
        """Report how far the runs are, if it is time to."""
        now = time.monotonic()
        if self._live is not None:
            if now - self._looked > _SECONDS_BETWEEN_LOOKS:
                self._looked = now
                self._live.update(self._picture(self._live.console.height))
        elif now - self._wrote > _SECONDS_BETWEEN_LINES:
            self._wrote = now
            working = at_work(self._left.values())
            runs = ", ".join(f"{one.run.label} {one.share:.0%}" for one in working[:4])
            more = f", and {len(working) - 4} more" if len(working) > 4 else ""
            print(f"{self._sum(len(working))}; at work: {runs}{more}", file=self._stream, flush=True)

    def _picture(self, height: int) -> Group:
        """A line for each run at work, the last failures, which stay in sight, and the sum, on a screen so high."""
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        working = at_work(self._left.values())
        failures = [Text(line, style="red", overflow="ellipsis", no_wrap=True) for line in self._failures]
        table = Table.grid(padding=(0, 2))
        room = max(1, height - _OTHER_LINES - min(len(failures), _FAILURES_SHOWN))
        for one in working[:room]:
            speed, seconds = one.speed, one.seconds_left
            shown = f"{speed:,.0f} frames/s" if speed else ""
            left = f"{clock(seconds)} left" if seconds is not None else ""
            left = "testing" if one.share == 1.0 else left
            bar = ProgressBar(1.0, one.share, width=28)
            table.add_row(Text(one.run.label), bar, f"{one.share:4.0%}", shown, left)
        return Group(table, *failures[-_FAILURES_SHOWN:], Text(self._sum(len(working))))

    def _sum(self, busy: int) -> str:
        """`5 min: 3 done, 1 failed, 2 at work, 6 waiting; 20 min left`."""
        now = time.monotonic()
        if now - self._estimated > _SECONDS_BETWEEN_ESTIMATES:
            self._estimated = now
            seconds = seconds_left(self._all, list(self._left.values()))
            self._estimate = f"; {clock(seconds / max(1, busy))} left" if seconds is not None else ""
        ends = [f"{count} {outcome}" for outcome, count in self.ends.items()]
        counts = [*ends, f"{busy} at work", f"{len(self._left) - busy} waiting"]
        return f"{clock(now - self._began)}: {', '.join(counts)}{self._estimate}"


def _success(run: PlannedRun) -> str:
    result = run.result or {}
    rate = result.get("eval", {}).get("success_rate")
    return "-" if rate is None else f"{rate:.3f}"
