"""This module records what happened in each update: one JSON object a line, and TensorBoard events."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from trainer.rollout import EpisodeTally

FILE_NAME = "metrics.jsonl"


def episode_metrics(
    tally: EpisodeTally, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, Any]:
    """What the episodes that ended in one rollout were like.

    Args:
        tally: the trainer's own sums.
        before: the environments' `counters()` before the rollout.
        after: the same after it.

    Returns:
        episodes, success, mean_return, mean_length, timeouts, and per episode the rate of each outcome and of each
        rule (rules may fire several times an episode); None where no episode ended.
    """
    episodes = tally.episodes

    def rate(total: float) -> float | None:
        return total / episodes if episodes else None

    def rates(kind: str) -> dict[str, float | None]:
        return {name: rate(count - before[kind].get(name, 0)) for name, count in after[kind].items()}

    return {
        "episodes": episodes,
        "success": rate(tally.successes),
        "mean_return": rate(tally.total_return),
        "mean_length": rate(tally.total_length),
        "timeouts": rate(tally.timeouts),
        "outcomes": rates("outcomes"),
        "rules": rates("rules"),
    }


class Tracker(Protocol):
    """Takes a run's figures to somewhere else, such as `tracking.WandbTracker`; it may never stop the run."""

    def open(self) -> None:
        """Begin, or go on.

        Raises:
            ValueError: it cannot begin; the message says what to do.
        """

    def write(self, scalars: Mapping[str, float], frames: int) -> None:
        """Take the figures of the update that reached `frames`."""

    def close(self) -> None:
        """End."""


class MetricsLog:
    """`metrics.jsonl`, and, if wanted, TensorBoard events in a run directory and a tracker elsewhere.

    Opening it cuts file and events back to `update`, so that a resumed run's log equals that of one that never
    stopped. TensorBoard's steps and the tracker's are frames.

    Raises:
        OSError: the files cannot be written.
        ValueError: the tracker cannot begin.
    """

    def __init__(
        self, run_dir: Path, update: int, tensorboard: bool, frames: int = 0, tracker: Tracker | None = None
    ) -> None:
        self._path = run_dir / FILE_NAME
        _cut_back(self._path, update)
        self._tracker = tracker
        if tracker is not None:
            tracker.open()
        self._file = self._path.open("a", encoding="utf-8")
        self._events: Any = None
        if tensorboard:
            from torch.utils.tensorboard import SummaryWriter

            # A reader drops what an earlier part of the run wrote from this step on.
            self._events = SummaryWriter(str(run_dir), purge_step=frames + 1)

    def write(self, update: int, row: Mapping[str, Any]) -> None:
        """Append the row of one update, which reached `row["frames"]` frames."""
        self._file.write(json.dumps({"update": update, **row}, allow_nan=False) + "\n")
        self._file.flush()
        if self._events is None and self._tracker is None:
            return
        found = scalars({name: value for name, value in row.items() if name != "frames"})
        if self._events is not None:
            for name, value in found.items():
                self._events.add_scalar(name, value, row["frames"])
        if self._tracker is not None:
            self._tracker.write(found, row["frames"])

    def sync(self) -> None:
        """Make sure that everything written so far survives a power loss, and the events a kill."""
        os.fsync(self._file.fileno())
        if self._events is not None:
            self._events.flush()

    def close(self) -> None:
        """Close the files."""
        self._file.close()
        if self._events is not None:
            self._events.close()
        if self._tracker is not None:
            self._tracker.close()


def scalars(row: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """A row's numbers by path, such as `outcomes/timeout`; without those that are None."""
    found: dict[str, float] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            found |= scalars(value, f"{prefix}{name}/")
        elif value is not None:
            found[prefix + name] = value
    return found


def _cut_back(path: Path, update: int) -> None:
    """Drop the rows after `update`, and a last line that was not finished."""
    if not path.exists():
        return
    kept = []
    for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
        if not line.endswith("\n") or json.loads(line)["update"] > update:
            break
        kept.append(line)
    temporary = path.with_suffix(".tmp")
    temporary.write_text("".join(kept), encoding="utf-8")
    temporary.replace(path)
