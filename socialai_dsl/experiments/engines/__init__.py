"""Engines, the places where runs are worked on: one module for each, all with the one protocol of this package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Protocol

ENGINES: Final = ("local", "ray", "slurm")
"""The names that `choice` knows."""


class Handle(Protocol):
    """A run that was given to an engine, as `concurrent.futures.Future` has it."""

    def done(self) -> bool:
        """Whether it has come to an end here, in whatever way."""

    def result(self) -> Any:
        """What `work.perform` returned; or the exception that kept the engine from working on it."""


class Engine(Protocol):
    """Somewhere to work on runs. The runs' folders hold the truth; an engine remembers nothing."""

    def submit(self, folder: Path, run_ids: Sequence[str]) -> Sequence[Handle]:
        """Have `work.perform` called for each of these runs, as soon as there is room."""

    def stop(self) -> None:
        """Leave all runs as they stand, and return when no process works on them any more."""


class MissingEngineError(Exception):
    """What the engine needs is not installed, or not there; the message says what to do."""
