"""The folders of an experiment and of its runs: tasks, progress, results."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

from socialai_dsl.atomic import write_text
from socialai_dsl.folder_lock import Holder, hold, holder

EXPERIMENT: Final = "experiment.json"
RUNS: Final = "runs"
STATUS: Final = "status.json"
RESULT: Final = "result.json"
REPLAY: Final = "episode.html"
EPISODES: Final = "episodes.csv"
TESTS: Final = "tests.json"
METRICS: Final = "metrics.jsonl"
CHECKPOINTS: Final = "checkpoints"
CANCEL: Final = "cancel"
_WORKER: Final = "worker"
"""The lock of the one process that works on a run, see `folder_lock`."""
LOCK: Final = f"{_WORKER}.lock"

State = Literal["waiting", "running", "done", "failed", "cancelled"]

_BLOCK: Final = 4096
"""Status files fill whole blocks, so that one can be changed on a disk that has none left."""


@dataclass
class Status:
    """What a run's folder says about the run.

    Attributes:
        state: waiting (also: stopped half-way), running, done, failed or cancelled.
        attempts: each time that a process worked on it: host, pid, started, ended, reason, from_frames.
        message: what a person should know, if anything.
    """

    state: State = "waiting"
    attempts: list[dict[str, Any]] = field(default_factory=list)
    message: str | None = None

    def begin(self, pid: int, from_frames: int) -> None:
        """Note that a process works on the run now."""
        self.state, self.message = "running", None
        self.attempts.append(
            {
                "host": socket.gethostname(),
                "pid": pid,
                "started": time.time(),
                "ended": None,
                "reason": None,
                "from_frames": from_frames,
            }
        )

    def end(self, reason: str, ended: float | None = None) -> None:
        """Note why the last attempt ended, if it has not ended yet."""
        if self.attempts and self.attempts[-1]["ended"] is None:
            self.attempts[-1] |= {"ended": time.time() if ended is None else ended, "reason": reason}


class UnreadableError(Exception):
    """A file of a run that cannot be read, or not understood; the message says which and why."""


@dataclass(frozen=True)
class Run:
    """A run's folder; it may not exist yet.

    Attributes:
        path: the folder. id: its name.
        condition: of the first condition that it belongs to, as `experiment.json` has it. seed: the run's.
        tests: scenarios that any of its conditions wants the agent to play besides.
    """

    path: Path
    id: str
    condition: Mapping[str, Any]
    seed: int
    tests: tuple[str, ...]

    @property
    def label(self) -> str:
        """What people call the run."""
        return f"{self.condition['name']}, seed {self.seed}"

    # -- status ----------------------------------------------------------------------------------------------

    def status(self) -> Status:
        """What the folder says; a run without a status is waiting.

        Raises:
            UnreadableError: it cannot be told.
        """
        content = self._json(STATUS)
        if content is None:
            return Status()
        if content.get("state") not in get_args(State):
            raise UnreadableError(f"{self.path / STATUS}: unknown state {content.get('state')!r}")
        return Status(content["state"], content.get("attempts", []), content.get("message"))

    def write_status(self, status: Status) -> None:
        """Replace the status; only the holder of the lock may.

        Raises:
            OSError: it cannot be written.
        """
        text = json.dumps(vars(status), indent=1, ensure_ascii=True)
        text += " " * (-(len(text) + 1) % _BLOCK) + "\n"
        try:
            write_text(self.path / STATUS, text)
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            self._overwrite_status(text, error)

    def _overwrite_status(self, text: str, error: OSError) -> None:
        """Write over the blocks that the status has already, which a full disk still lets one do."""
        try:
            with open(self.path / STATUS, "r+", encoding="utf-8") as file:
                if os.fstat(file.fileno()).st_size < len(text):
                    raise error
                file.write(text)
        except FileNotFoundError:
            raise error from None

    def shown_status(self) -> Status:
        """The status for people: a run whose worker is gone is waiting, one that cannot be read has failed."""
        try:
            status = self.status()
            if status.state == "running" and worker_of(self.path) is None:
                status.end("its process is gone", self.last_sign())
                status.state = "waiting"
        except (OSError, UnreadableError) as error:
            return Status("failed", message=f"cannot be read: {said_of(error)}")
        return status

    def lock(self) -> AbstractContextManager[None]:
        """To be held while working on it.

        Raises:
            HeldError: on entry, if another worker holds it.
        """
        return hold(self.path, _WORKER)

    # -- what a process left ---------------------------------------------------------------------------------

    def checkpoint_frames(self) -> int | None:
        """Frames of the newest checkpoint; None if there is none."""
        with contextlib.suppress(FileNotFoundError):
            names = os.listdir(self.path / CHECKPOINTS)
            frames = [int(n[:-12]) for n in names if n.endswith(".safetensors") and n[:-12].isdigit()]
            return max(frames, default=None)
        return None

    def last_metrics(self) -> Mapping[str, Any] | None:
        """The last complete line of the run's metrics; None if there is none."""
        try:
            with open(self.path / METRICS, "rb") as file:
                size = file.seek(0, os.SEEK_END)
                file.seek(max(0, size - 65_536))
                lines = file.read().split(b"\n")[:-1]
        except OSError:
            return None
        try:
            row = json.loads(lines[-1]) if lines else None
        except ValueError:
            return None
        return row if isinstance(row, dict) else None

    def result(self) -> dict[str, Any] | None:
        """What `socialai run` found; None if it has not come to its end."""
        return self._json(RESULT)

    def tested(self) -> dict[str, Any]:
        """What was found on other scenarios: name -> figures."""
        return self._json(TESTS) or {}

    def missing_tests(self) -> list[str]:
        """What the agent has not played yet."""
        if not self.tests:
            return []
        tested = self.tested()
        return [name for name in self.tests if name not in tested]

    def _json(self, name: str) -> dict[str, Any] | None:
        path = self.path / name
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except ValueError as error:
            raise UnreadableError(f"{path}: not JSON, {error}") from None
        if not isinstance(content, dict):
            raise UnreadableError(f"{path}: expected a JSON object")
        return content

    def last_sign(self) -> float | None:
        """When its processes last wrote something, seconds since 1970; None if they never did."""
        times = []
        for name in (STATUS, METRICS):
            with contextlib.suppress(FileNotFoundError):
                times.append((self.path / name).stat().st_mtime)
        return max(times, default=None)

    def is_cancelled(self) -> bool:
        """Whether a command has asked to give the run up."""
        return (self.path / CANCEL).exists()


def worker_of(run: Path) -> Holder | None:
    """The process that works on the run in this folder; None if there is none."""
    return holder(run, _WORKER)


def said_of(error: Exception) -> str:
    """What a person is told of an error of a file."""
    if isinstance(error, OSError):
        place = f": {error.filename}" if error.filename is not None else ""
        return f"{error.strerror or error}{place}"
    return str(error)


def runs_of(folder: Path, document: Mapping[str, Any]) -> list[Run]:
    """The runs of an experiment, each once, in its order."""
    conditions = {condition["name"]: condition for condition in document["conditions"]}
    wanted: dict[str, list[tuple[Mapping[str, Any], int]]] = {}
    for run in document["runs"]:
        wanted.setdefault(run["id"], []).append((conditions[run["condition"]], run["seed"]))
    runs = []
    for identity, uses in wanted.items():
        tests = dict.fromkeys(test for condition, _ in uses for test in condition["tests"])
        runs.append(Run(folder / RUNS / identity, identity, *uses[0], tuple(tests)))
    return runs


def read_experiment(folder: Path) -> dict[str, Any] | None:
    """The content of a folder's `experiment.json`; None if it has none.

    Raises:
        UnreadableError: it is none of ours.
        OSError: it cannot be read.
    """
    path = folder / EXPERIMENT
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise UnreadableError(f"{path}: not JSON, {error}") from None
    if not isinstance(content, dict) or content.get("format") != 1:
        raise UnreadableError(f"{path}: expected an experiment of format 1")
    return content
