"""This module shows how far all runs of an experiment are: redrawn on a terminal, plain lines elsewhere."""

import time
from collections import Counter
from collections.abc import Sequence
from types import TracebackType
from typing import IO, TYPE_CHECKING, Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from socialai_dsl.cli.experiment_tables import clock

if TYPE_CHECKING:
    from socialai_dsl.experiments.folder import Run

_SECONDS_BETWEEN_LINES: Final = 30.0
_SECONDS_BETWEEN_LOOKS: Final = 2.0
_RUNS_SHOWN: Final = 16


class RunsProgress:
    """Reports ends of runs, and how far those at work are; use it in a `with` statement."""

    def __init__(self, runs: "Sequence[Run]", stream: IO[str]) -> None:
        """Report on `runs`, writing to `stream`."""
        self._runs = {run.id: run for run in runs}
        self._stream = stream
        self._ends: Counter[str] = Counter()
        self._began = time.monotonic()
        self._looked = float("-inf")
        self._wrote = time.monotonic()
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

    def ended(self, run: "Run", outcome: str, message: str) -> None:
        """Report that a run has come to its end."""
        self._ends[outcome] += 1
        self._runs.pop(run.id, None)
        found = ""
        if outcome == "done":
            found = f"  success {_success(run)}"
        line = f"[{self._ends.total()}/{self._ends.total() + len(self._runs)}] {run.label}: {outcome}{found}"
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
                self._live.update(self._picture())
        elif now - self._wrote > _SECONDS_BETWEEN_LINES:
            self._wrote = now
            at_work = self._at_work()
            summary = ", ".join(f"{run.label} {share:.0%}" for run, share, _ in at_work[:4])
            more = f", and {len(at_work) - 4} more" if len(at_work) > 4 else ""
            counts = f"{self._ends.total()} ended, {len(self._runs)} left"
            line = f"{clock(now - self._began)}: {counts}; at work: {summary}{more}"
            print(line, file=self._stream, flush=True)

    def _at_work(self) -> "list[tuple[Run, float, float | None]]":
        """Runs that somebody works on, here or elsewhere: how far each is, and its last frames per second."""
        found = []
        for run in self._runs.values():
            if run.shown_status().state != "running":
                continue
            row = run.last_metrics() or {}
            wanted = run.condition["frames"] or 1
            found.append((run, min(1.0, row.get("frames", 0) / wanted), row.get("frames_per_second")))
        return found

    def _picture(self) -> Group:
        table = Table.grid(padding=(0, 2))
        at_work = self._at_work()
        for run, share, speed in at_work[:_RUNS_SHOWN]:
            shown = f"{speed:,.0f} frames/s" if speed else ""
            table.add_row(Text(run.label), ProgressBar(1.0, share, width=28), f"{share:4.0%}", shown)
        ends = ", ".join(f"{count} {outcome}" for outcome, count in self._ends.items())
        left = len(self._runs) - len(at_work)
        total = f"{ends or 'none ended'}, {len(at_work)} at work, {left} waiting, "
        total += clock(time.monotonic() - self._began)
        return Group(table, Text(total))


def _success(run: "Run") -> str:
    result = run.result() or {}
    rate = result.get("eval", {}).get("success_rate")
    return "-" if rate is None else f"{rate:.3f}"
