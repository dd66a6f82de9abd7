"""Where runs are worked on: one module for each way, all with the one protocol of this package."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from socialai_dsl.experiments.work import Outcome


class Handle(Protocol):
    """A run that was given to an engine, as `concurrent.futures.Future` has it."""

    def done(self) -> bool:
        """Whether it has come to an end here, in whatever way."""

    def result(self) -> tuple[Outcome, str]:
        """What came of it; or the exception that kept the engine from working on it."""


class Engine(Protocol):
    """Somewhere to work on runs. The runs' folders hold the truth; an engine remembers nothing."""

    def submit(self, folder: Path, run_id: str) -> Handle:
        """Have `work.perform` called for a run, as soon as there is room."""

    def stop(self) -> None:
        """Leave all runs as they stand, and return when nobody works on them any more."""
