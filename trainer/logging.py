"""The records of a training run: starts, a row of figures for each update, TensorBoard events, a tracker."""

from __future__ import annotations

import contextlib
import json
import os
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import torch
from numpy.typing import NDArray

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.files import METRICS, STARTS
from socialai_dsl.trainer.session import Session, State


@dataclass
class Tally:
    """Sums over a rollout; episodes are the agent's own that ended in it, without those that a guide took part in.

    Attributes:
        episodes, successes, timeouts: counts.
        total_return, total_length: sums of undiscounted returns (without bonus) and of lengths in steps.
        all_episodes: own and led ones.
        led_steps, agreed_steps: steps that a guide made, and those of them in which the policy's own sample was the
            same.
        bonus: mean exploration bonus per frame.
    """

    episodes: int = 0
    successes: int = 0
    timeouts: int = 0
    total_return: float = 0.0
    total_length: int = 0
    all_episodes: int = 0
    led_steps: int = 0
    agreed_steps: int = 0
    bonus: float = 0.0

    def count(
        self, state: State, ended: NDArray[np.bool_], cut: NDArray[np.bool_], success: NDArray[np.bool_]
    ) -> None:
        """Add the episodes that ended in a step, those that were cut off and those that succeeded, bool (E,) each."""
        own = ended & ~state.led
        self.all_episodes += int(ended.sum())
        self.episodes += int(own.sum())
        self.successes += int(success[own].sum())
        self.timeouts += int(cut[own].sum())
        self.total_return += float(state.returns[own].sum())
        self.total_length += int(state.lengths[own].sum())


class Metrics:
    """Makes the row of each update, as `docs/metrics.md` describes it."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._counted, self._time = session.envs.counters(), time.perf_counter()

    def row(self, tally: Tally, losses: Mapping[str, float | None]) -> dict[str, Any]:
        """The row of the update just made, which took from the last call until now."""
        session, config, before, began = self._session, self._session.config, self._counted, self._time
        self._counted, self._time = session.envs.counters(), time.perf_counter()
        row = {
            "update": session.update,
            "frames": session.frames,
            "frames_per_second": round(config.frames_per_update / (self._time - began), 1),
            **losses,
            "bonus": tally.bonus,
            **episode_metrics(tally, before, self._counted, session.seats),
        }
        if config.guide == "none":
            row.pop("imitation_loss", None)  # algorithms have figures of their own
            return row
        agreement = tally.agreed_steps / tally.led_steps if tally.led_steps else None
        return row | {"led": tally.led_steps / config.frames_per_update, "agreement": agreement}


def episode_metrics(
    tally: Tally, before: Mapping[str, Any], after: Mapping[str, Any], seats: int = 1
) -> dict[str, Any]:
    """The figures of the episodes that ended in one rollout; rates are None where none ended.

    Args:
        tally: the trainer's sums, of the agent's own episodes.
        before: the environments' `counters()` before the rollout, of own and led episodes.
        after: the same after it.
        seats: in how many environments the agent plays each episode; what is counted of it is counted once.
    """

    def rate(total: float, episodes: float = tally.episodes) -> float | None:
        return total / episodes if episodes else None

    def rates(kind: str) -> dict[str, float | None]:
        counts = {name: count - before[kind].get(name, 0) for name, count in after[kind].items()}
        return {name: rate(count, tally.all_episodes / seats) for name, count in counts.items()}

    return {
        "episodes": tally.episodes,
        "success": rate(tally.successes),
        "mean_return": rate(tally.total_return),
        "mean_length": rate(tally.total_length),
        "timeouts": rate(tally.timeouts),
        "outcomes": rates("outcomes"),
        "rules": rates("rules"),
    }


class Tracker(Protocol):
    """Another place for the figures, such as a service that draws them; one that fails must not stop the run."""

    def open(self) -> None:
        """Begin, or go on with a resumed run; ValueError says why it cannot."""

    def write(self, scalars: Mapping[str, float], frames: int) -> None:
        """Take the figures of the update that reached `frames`; a resumed run makes some of them again."""

    def close(self) -> None:
        """End."""


class MetricsLog:
    """`starts.jsonl`, `metrics.jsonl`, and, if wanted, TensorBoard events in a run directory and a tracker.

    Opening it records the start, and cuts rows and events back to `update`, so that a resumed run's log equals that
    of one that never stopped. TensorBoard's steps and the tracker's are frames.

    Raises:
        OSError: the files cannot be written.
        ValueError: the tracker cannot begin.
    """

    def __init__(
        self,
        run_dir: Path,
        config: RunConfig,
        update: int = 0,
        tracker: Tracker | None = None,
    ) -> None:
        run_dir.mkdir(parents=True, exist_ok=True)
        path = run_dir / METRICS
        _cut_back(path, update)
        self._tracker = tracker
        if tracker is not None:
            tracker.open()
        self._file = path.open("a", encoding="utf-8")
        self._events: Any = None
        if config.tensorboard:
            from torch.utils.tensorboard import SummaryWriter

            # A reader drops what an earlier part of the run wrote from this step on.
            self._events = SummaryWriter(str(run_dir), purge_step=update * config.frames_per_update + 1)
        record_start(run_dir, update, config)

    def write(self, row: Mapping[str, Any]) -> None:
        """Append the row of one update."""
        self._file.write(json.dumps(row, allow_nan=False) + "\n")
        self._file.flush()
        found = scalars({name: value for name, value in row.items() if name not in ("update", "frames")})
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

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Close the files; where something went wrong before, that they cannot be closed either is no news."""
        for written in (self._file, self._events):
            with contextlib.suppress(OSError) if error is not None else contextlib.nullcontext():
                if written is not None:
                    written.close()
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
    """Drop the rows after `update`."""
    if path.exists():
        known = _rows(path.read_text(encoding="utf-8", errors="replace"))
        rows = [row for row in known if isinstance(row.get("update"), int) and 0 < row["update"] <= update]
        temporary = path.with_suffix(".tmp")
        temporary.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
        temporary.replace(path)


def _rows(text: str) -> list[dict[str, Any]]:
    """The rows of a file's text, but for what a killed or failing machine left unfinished."""
    rows = []
    for line in text.splitlines():
        with contextlib.suppress(ValueError):
            rows.append(json.loads(line))
    return [row for row in rows if isinstance(row, dict)]


def record_start(run_dir: Path, update: int, config: RunConfig) -> None:
    """Append a line to `starts.jsonl`: when, from where on, and what must be equal for two runs to be equal to the bit.

    Warns if the last start was under other conditions. The file is never cut back: it tells how often a run was
    stopped.

    Raises:
        OSError: it cannot be written.
    """
    # The instructions that torch uses here; other processors may round sums differently.
    cpu = torch.backends.cpu.get_cpu_capability()
    now = {"torch": str(torch.__version__), "cpu": cpu, "device": config.device, "threads": config.threads}
    path = run_dir / STARTS
    known = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
    if update and (starts := _rows(known)):
        last = starts[-1]
        changed = [f"{name} {last.get(name)} -> {one}" for name, one in now.items() if last.get(name) != one]
        if changed:
            warnings.warn(
                f"the run resumes under other conditions ({', '.join(changed)}), so its weights may differ from "
                "those of a run that never stopped",
                stacklevel=4,
            )
    began, frames = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), update * config.frames_per_update
    with path.open("a", encoding="utf-8") as file:
        unfinished = "" if known.endswith("\n") or not known else "\n"  # by a process killed while writing
        file.write(unfinished + json.dumps({"time": began, "update": update, "frames": frames} | now) + "\n")
        file.flush()
        os.fsync(file.fileno())
