"""Estimates of run times: from this experiment's runs, from a short measurement, or from usual figures."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.errors import UnreadableError
from socialai_dsl.experiments.folder import PlannedRun

USUAL_SPEEDS: Final[Mapping[str, float]] = {"fast": 5000.0}
"""Frames per second of a network on a core of a server, where nothing was measured; of others nothing is known."""


USUAL_SECONDS_BESIDES: Final = 15.0
"""What a run takes besides training, to start and to play its test sets, where no run here tells."""


@dataclass(frozen=True)
class Speed:
    """Frames per second, and how that is known."""

    frames_per_second: float
    source: str


class Speeds:
    """What is known of the speed of networks, the best knowledge first.

    Attributes:
        seconds_besides: what a run takes besides training.
    """

    def __init__(self, runs: Iterable[PlannedRun]) -> None:
        """Learn from the runs of an experiment that have got far enough to tell."""
        self._by_scenario: dict[tuple[str, str], list[float]] = {}
        self._by_net: dict[str, list[float]] = {}
        self._cached = _cached()
        besides: list[float] = []
        for run in runs:
            besides += _seconds_besides(run)
            speed = _speed_of(run)
            if speed is not None:
                net = str(run.condition["options"]["net"])
                self._by_scenario.setdefault((run.condition["scenario"], net), []).append(speed)
                self._by_net.setdefault(net, []).append(speed)
        self.seconds_besides = sum(besides) / len(besides) if besides else USUAL_SECONDS_BESIDES

    def of(self, condition: Mapping[str, Any]) -> Speed | None:
        """The speed to expect of a condition's runs; None if nothing is known."""
        net = str(condition["options"]["net"])
        alike = self._by_scenario.get((condition["scenario"], net))
        if alike:
            return Speed(_mean(alike), "runs of this scenario here")
        if net in self._by_net:
            return Speed(_mean(self._by_net[net]), "runs of this network here")
        if net in self._cached:
            return Speed(self._cached[net], "a short measurement on this machine")
        if net in USUAL_SPEEDS:
            return Speed(USUAL_SPEEDS[net], "a typical figure of this network")
        return None

    def is_from_runs(self, condition: Mapping[str, Any]) -> bool:
        """Whether runs here tell the speed."""
        return str(condition["options"]["net"]) in self._by_net

    def look_again(self) -> None:
        """Take note of what was measured in the meantime."""
        self._cached = _cached()

    def remaining(self, run: PlannedRun) -> float | None:
        """Seconds that a run still takes; None if the speed is not known."""
        if run.result is not None:
            return self.seconds_besides if run.missing_tests else 0.0
        if run.condition["frames"] is None:
            return self.seconds_besides
        speed = self.of(run.condition)
        if speed is None:
            return None
        left: int = run.condition["frames"] - (run.checkpoint_frames or 0)
        return max(0, left) / speed.frames_per_second + self.seconds_besides


def remember(net: str, frames_per_second: float) -> None:
    """Keep a measured speed for other experiments on this machine."""
    path = _cache_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, _cached() | {net: frames_per_second})


def _cache_file() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "socialai-dsl" / "speeds.json"


def _cached() -> dict[str, float]:
    try:
        content = json.loads(_cache_file().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    known = content.items() if isinstance(content, dict) else ()
    return {net: float(speed) for net, speed in known if isinstance(speed, int | float) and speed > 0}


def _speed_of(run: PlannedRun) -> float | None:
    try:
        result = run.result
    except (OSError, UnreadableError):
        return None
    row = result or run.last_metrics or {}
    speed: object = row.get("frames_per_second")
    return float(speed) if isinstance(speed, int | float) and speed > 0 else None


def _seconds_besides(run: PlannedRun) -> list[float]:
    """The time that a run's processes took without training, if the run is done."""
    try:
        result, status = run.result, run.status
    except (OSError, UnreadableError):
        return []
    if status.state != "done" or result is None or "train_seconds" not in result:
        return []
    whole = sum(attempt["ended"] - attempt["started"] for attempt in status.attempts)
    return [max(0.0, whole - result["train_seconds"])]


def _mean(speeds: list[float]) -> float:
    """The harmonic mean: what a frame takes is what adds up."""
    return len(speeds) / sum(1 / speed for speed in speeds)
