"""The figures of an experiment's runs, as JSON-able objects: plan, estimated time, progress."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from socialai_dsl.errors import UnreadableError
from socialai_dsl.experiments.estimate import Speeds
from socialai_dsl.experiments.folder import PlannedRun


def plan_figures(
    document: Mapping[str, Any], folder: Path, runs: Sequence[PlannedRun], speeds: Speeds, workers: int
) -> dict[str, Any]:
    """The plan: each run with its state and the seconds left, and the sum; None where nothing is known of a time left.

    Args:
        document: of the experiment.
        folder: the experiment's.
        runs: its runs.
        speeds: what is known of the speed.
        workers: how many runs there are at once.
    """
    rows = []
    for run, row in zip(runs, _rows(document, runs), strict=True):
        speed = speeds.of(run.condition) if run.condition["frames"] else None
        known = {
            "frames_per_second": round(speed.frames_per_second, 1) if speed else None,
            "speed_from": speed.source if speed else None,
        }
        seconds = 0.0 if row["state"] in ("failed", "cancelled") else _remaining(speeds, run)
        rows.append(row | known | {"seconds": None if seconds is None else round(seconds, 1)})
    known_seconds = [row["seconds"] for row in rows if row["seconds"] is not None]
    known, unknown = sum(known_seconds), len(rows) - len(known_seconds)
    return {
        **_head(document, folder),
        "workers": workers,
        "seconds": round(known / workers, 1) if known or not unknown else None,
        "seconds_besides": round(speeds.seconds_besides, 1),
        "unknown": unknown,
        "states": dict(Counter(row["state"] for row in rows)),
        "runs": rows,
    }


def seconds_left(runs: Sequence[PlannedRun], left: Sequence[PlannedRun]) -> float | None:
    """The seconds left of some runs, one after the other; None if the speed of one is unknown.

    Args:
        runs: all, which tell the speed.
        left: those that are asked about.
    """
    speeds = Speeds(runs)
    times = [_remaining(speeds, run) for run in left]
    known = [seconds for seconds in times if seconds is not None]
    return sum(known) if len(known) == len(times) else None


@dataclass(frozen=True)
class AtWork:
    """A run that a process works on: the share of its frames that is done, and its last frames per second."""

    run: PlannedRun
    share: float
    speed: float | None

    @property
    def seconds_left(self) -> float | None:
        """Seconds of training that are left; None if the speed is not known."""
        return self.run.condition["frames"] * (1 - self.share) / self.speed if self.speed else None


def at_work(runs: Iterable[PlannedRun]) -> list[AtWork]:
    """Those of some runs that a process works on, here or elsewhere."""
    found = []
    for run in runs:
        if run.shown_status.state == "running":
            row = run.last_metrics or {}
            share = min(1.0, row.get("frames", 0) / (run.condition["frames"] or 1))
            found.append(AtWork(run, share, row.get("frames_per_second")))
    return found


def grouped(rows: Sequence[dict[str, Any]], each: bool) -> list[tuple[str, list[dict[str, Any]]]]:
    """The runs of each condition, by its name; with `each` every run alone, by the names of its conditions."""
    if each:
        return [(" and ".join(row["conditions"]), [row]) for row in rows]
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        for condition in row["conditions"]:
            groups.setdefault(condition, []).append(row)
    return list(groups.items())


def share_done(group: Sequence[Mapping[str, Any]]) -> float:
    """How much of the training is done; of agents that are not trained, how many have played."""
    pairs = [(float(row["frames_done"]), float(row["frames"])) for row in group]
    wanted = sum(frames for _, frames in pairs)
    if not wanted:
        return [row["state"] for row in group].count("done") / len(group)
    return sum(min(done, frames) for done, frames in pairs) / wanted


def _remaining(speeds: Speeds, run: PlannedRun) -> float | None:
    try:
        return speeds.remaining(run)
    except (OSError, UnreadableError):
        return 0.0  # such a run is not worked on


def status_figures(document: Mapping[str, Any], folder: Path, runs: Sequence[PlannedRun]) -> dict[str, Any]:
    """How far each run is."""
    rows = _rows(document, runs)
    return {**_head(document, folder), "states": dict(Counter(row["state"] for row in rows)), "runs": rows}


def _head(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    return {"name": document["name"], "profile": document["profile"], "folder": str(folder)}


def _rows(document: Mapping[str, Any], runs: Sequence[PlannedRun]) -> list[dict[str, Any]]:
    conditions: dict[str, list[str]] = {}
    for entry in document["runs"]:
        conditions.setdefault(entry["id"], []).append(entry["condition"])
    return [_row(run, conditions[run.id]) for run in runs]


def _row(run: PlannedRun, conditions: Sequence[str]) -> dict[str, Any]:
    status = run.shown_status
    done, success = 0, None
    try:
        result = run.result
        metrics = run.last_metrics if run.condition["frames"] else None
        done = int((result or metrics or {}).get("frames", 0))
        success = result["eval"]["success_rate"] if result else None
    except (OSError, UnreadableError):
        pass  # the state says what is wrong
    return {
        "id": run.id,
        "conditions": conditions,
        "seed": run.seed,
        "frames": run.condition["frames"] or 0,
        "frames_done": done,
        "state": status.state,
        "attempts": len(status.attempts),
        "success_rate": success,
        "message": status.message,
    }
