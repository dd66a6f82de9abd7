"""This module records what happened in each update: one JSON object a line, and TensorBoard events."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import torch

from trainer.rollout import EpisodeTally
from trainer.team import Team

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


def add_up(
    team: Team, tally: EpisodeTally, bonus: float, counters: Mapping[str, Any]
) -> tuple[EpisodeTally, float, dict[str, Any]]:
    """The tally and the counters of the environments of all processes, and the mean of their bonuses."""
    if team.size == 1:
        return tally, bonus, dict(counters)
    kinds = [(kind, name) for kind in ("outcomes", "rules") for name in counters[kind]]
    own = [*vars(tally).values(), bonus / team.size, *(counters[kind][name] for kind, name in kinds)]
    sums = team.sum(torch.tensor([*own, counters["episodes"]], dtype=torch.float64)).tolist()
    episodes, successes, timeouts, total_return, total_length, bonus, *counts, ended = sums
    whole = EpisodeTally(int(episodes), int(successes), int(timeouts), total_return, int(total_length))
    summed: dict[str, Any] = {"outcomes": {}, "rules": {}, "episodes": int(ended)}
    for (kind, name), count in zip(kinds, counts, strict=True):
        summed[kind][name] = int(count)
    return whole, bonus, summed


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

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the files; where something went wrong before, that they cannot be closed either is no news."""
        with contextlib.suppress(OSError) if error is not None else contextlib.nullcontext():
            self._file.close()
        if self._events is not None:
            with contextlib.suppress(OSError) if error is not None else contextlib.nullcontext():
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
    """Drop the rows after `update`, and what a killed or failing machine left unfinished."""
    if not path.exists():
        return
    kept = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True):
        if not line.endswith("\n") or not 0 < _update_of(line) <= update:
            break
        kept.append(line)
    temporary = path.with_suffix(".tmp")
    temporary.write_text("".join(kept), encoding="utf-8")
    temporary.replace(path)


def _update_of(line: str) -> int:
    """The number of the update a row is of; 0 if it is no row."""
    try:
        number = json.loads(line)["update"]
    except (ValueError, KeyError, TypeError):
        return 0
    return number if isinstance(number, int) else 0
