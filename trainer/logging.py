"""What a run writes while it trains: starts, a row of figures for each update, TensorBoard events, W&B."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import time
import uuid
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import torch

from trainer.config import RunConfig
from trainer.rollout import EpisodeTally

FILE_NAME = "metrics.jsonl"
STARTS = "starts.jsonl"
SURROUNDINGS = ("torch", "cpu", "device", "threads")
_ID_FILE = "wandb_id.txt"


def episode_metrics(
    tally: EpisodeTally, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, Any]:
    """What the episodes that ended in one rollout were like.

    Args:
        tally: the trainer's sums.
        before: the environments' `counters()` before the rollout.
        after: the same after it.

    Returns:
        episodes, success, mean_return, mean_length, timeouts of the agent's own episodes; then per episode, own and
        led ones, the rate of each outcome and of each rule (rules may fire several times an episode). None where no
        episode ended.
    """

    def rate(total: float, episodes: int = tally.episodes) -> float | None:
        return total / episodes if episodes else None

    def rates(kind: str) -> dict[str, float | None]:
        counts = {name: count - before[kind].get(name, 0) for name, count in after[kind].items()}
        return {name: rate(count, tally.all_episodes) for name, count in counts.items()}

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
    """Takes a run's figures to somewhere else, such as `WandbTracker`; it may never stop the run."""

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


def record_start(run_dir: Path, update: int, frames: int, config: RunConfig) -> None:
    """Append a line to `starts.jsonl`: when, from where on, and what must be equal for two runs to be equal to the bit.

    Warns if the last start was under other conditions.

    The file is never cut back: it tells how often a run was stopped.

    Raises:
        OSError: it cannot be written.
    """
    # The instructions that torch uses here; other processors may round sums differently.
    cpu = torch.backends.cpu.get_cpu_capability()
    values = (str(torch.__version__), cpu, config.device, config.threads)
    around = dict(zip(SURROUNDINGS, values, strict=True))
    path = run_dir / STARTS
    text = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
    known = _rows(text)
    if known and update > 0:
        changed = [
            f"{name} {known[-1].get(name)} -> {around[name]}"
            for name in SURROUNDINGS
            if known[-1].get(name) != around[name]
        ]
        if changed:
            warnings.warn(
                f"the run goes on under other conditions ({', '.join(changed)}), so it need not equal, to the last "
                "bit, one that never stopped",
                stacklevel=3,
            )
    row = {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "update": update, "frames": frames}
    with path.open("a", encoding="utf-8") as file:
        unfinished = "\n" if text and not text.endswith("\n") else ""  # by a process killed while writing
        file.write(unfinished + json.dumps(row | around) + "\n")
        file.flush()
        os.fsync(file.fileno())


def _rows(text: str) -> list[dict[str, Any]]:
    """The lines that are whole."""
    rows = []
    for line in text.splitlines():
        try:
            row = json.loads(line)
        except ValueError:
            continue
        if isinstance(row, dict):
            rows.append(row)
    return rows


class TrackingWarning(UserWarning):
    """Figures are not sent any more; the run goes on."""


class WandbTracker:
    """Sends figures to a project of Weights & Biases, where they are drawn over frames.

    A resumed run goes on where it was: what it does again is not sent twice. Once begun, nothing that goes wrong
    stops the training; it is said once, and the figures stay in `metrics.jsonl`.
    """

    def __init__(self, project: str, run_dir: Path, config: Mapping[str, Any], name: str) -> None:
        """Send to `project`.

        Args:
            project: its name.
            run_dir: folder of the run, where W&B keeps its own files as well.
            config: what the run was asked for, shown beside its curves.
            name: what the run is called there.

        Raises:
            ValueError: the package is not installed.
        """
        try:
            self._wandb = importlib.import_module("wandb")
        except ImportError:
            raise ValueError(
                "W&B is not installed: pip install 'socialai-dsl[wandb]', or leave out --wandb"
            ) from None
        self._project, self._run_dir, self._config, self._name = project, run_dir, dict(config), name
        self._run: Any = None

    def open(self) -> None:
        """See `Tracker.open`."""
        try:
            self._run = self._wandb.init(
                project=self._project,
                name=self._name,
                id=self._identity(),
                dir=str(self._run_dir),
                config=self._config,
                resume="allow",
                # The terminal shows the progress; W&B is not to copy what is printed.
                settings=self._wandb.Settings(console="off"),
            )
        except Exception as error:
            raise ValueError(f"W&B cannot begin: {type(error).__name__}: {error}") from error

    def write(self, scalars: Mapping[str, float], frames: int) -> None:
        """See `Tracker.write`."""
        if self._run is None:
            return
        try:
            # A resumed run makes again what came after its checkpoint.
            if frames >= self._run.step:
                self._run.log(dict(scalars), step=frames)
        except Exception as error:
            self._give_up(error)

    def close(self) -> None:
        """See `Tracker.close`."""
        if self._run is None:
            return
        try:
            self._run.finish()
        except Exception as error:
            self._give_up(error)
        self._run = None

    def _give_up(self, error: Exception) -> None:
        self._run = None
        warnings.warn(
            f"W&B gets no more figures ({type(error).__name__}: {error}); training goes on, and they are all in "
            f"{self._run_dir / 'metrics.jsonl'}",
            TrackingWarning,
            stacklevel=2,
        )

    def _identity(self) -> str:
        """The run's name for machines, made once and kept in its folder."""
        path = self._run_dir / _ID_FILE
        if path.exists():
            return path.read_text(encoding="utf-8").strip()
        made = uuid.uuid4().hex[:12]
        path.write_text(made + "\n", encoding="utf-8")
        return made
