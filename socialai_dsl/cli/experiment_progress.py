"""The progress of an experiment's runs: a line for each worker on a terminal, plain lines elsewhere."""

import time
from collections import Counter
from collections.abc import Sequence
from types import TracebackType
from typing import IO, Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from socialai_dsl.cli.experiment_tables import clock
from socialai_dsl.experiments.figures import seconds_left
from socialai_dsl.experiments.folder import PlannedRun

_SECONDS_BETWEEN_LINES: Final = 30.0
_SECONDS_BETWEEN_LOOKS: Final = 2.0
_SECONDS_BETWEEN_ESTIMATES: Final = 10.0
_FAILURES_SHOWN: Final = 5
_OTHER_LINES: Final = 4
"""Of the picture: below the runs, and what the terminal needs itself."""


class RunsProgress:
    """Reports ends of runs, and how far those at work are; use it in a `with` statement."""

    def __init__(self, runs: Sequence[PlannedRun], stream: IO[str]) -> None:
        """Report on `runs`, writing to `stream`."""
        self._all = runs
        self._left = {run.id: run for run in runs}
        self._stream = stream
        self._ends: Counter[str] = Counter()
        self._failures: list[str] = []
        self._began = time.monotonic()
        self._looked = self._estimated = float("-inf")
        self._wrote = time.monotonic()
        self._estimate = ""
        self._live: Live | None = None
        if stream.isatty():
            self._live = Live(console=Console(file=stream), refresh_per_second=2)

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
        self._ends[outcome] += 1
        self._left.pop(run.id, None)
        if outcome == "failed":
            self._failures.append(f"{run.label}: {message}")
        line = f"[{self._ends.total()}/{len(self._all)}] {run.label}: {outcome}"
        line += f"  success {_success(run)}" if outcome == "done" else ""
        line += f": {message}" if message else ""
        if self._live is not None:
            self._live.console.print(Text(line))
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
            at_work = self._at_work()
            runs = ", ".join(f"{run.label} {share:.0%}" for run, share, _ in at_work[:4])
            more = f", and {len(at_work) - 4} more" if len(at_work) > 4 else ""
            print(f"{self._sum(len(at_work))}; at work: {runs}{more}", file=self._stream, flush=True)

    def _at_work(self) -> list[tuple[PlannedRun, float, float | None]]:
        """Runs that a process works on, here or elsewhere: how far each is, and its last frames per second."""
        found = []
        for run in self._left.values():
            if run.shown_status.state != "running":
                continue
            row = run.last_metrics or {}
            wanted = run.condition["frames"] or 1
            found.append((run, min(1.0, row.get("frames", 0) / wanted), row.get("frames_per_second")))
        return found

    def _picture(self, height: int) -> Group:
        """A line for each run at work, the last failures, which stay in sight, and the sum, on a screen so high."""
        at_work = self._at_work()
        failures = [Text(line, style="red", overflow="ellipsis", no_wrap=True) for line in self._failures]
        table = Table.grid(padding=(0, 2))
        room = max(1, height - _OTHER_LINES - min(len(failures), _FAILURES_SHOWN))
        for run, share, speed in at_work[:room]:
            shown = f"{speed:,.0f} frames/s" if speed else ""
            left = clock(run.condition["frames"] * (1 - share) / speed) + " left" if speed else ""
            left = "testing" if share == 1.0 else left
            table.add_row(Text(run.label), ProgressBar(1.0, share, width=28), f"{share:4.0%}", shown, left)
        return Group(table, *failures[-_FAILURES_SHOWN:], Text(self._sum(len(at_work))))

    def _sum(self, at_work: int) -> str:
        """`5 min: 3 done, 1 failed, 2 at work, 6 waiting; 20 min left`."""
        now = time.monotonic()
        if now - self._estimated > _SECONDS_BETWEEN_ESTIMATES:
            self._estimated = now
            seconds = seconds_left(self._all, list(self._left.values()))
            self._estimate = f"; {clock(seconds / max(1, at_work))} left" if seconds is not None else ""
        ends = [f"{count} {outcome}" for outcome, count in self._ends.items()]
        counts = [*ends, f"{at_work} at work", f"{len(self._left) - at_work} waiting"]
        return f"{clock(now - self._began)}: {', '.join(counts)}{self._estimate}"


def _success(run: PlannedRun) -> str:
    result = run.result or {}
    rate = result.get("eval", {}).get("success_rate")
    return "-" if rate is None else f"{rate:.3f}"
