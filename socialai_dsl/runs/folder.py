"""The folder of a run: the names of its files, who may write them, and how they are read."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

from pydantic import ValidationError

from socialai_dsl.atomic import read_json
from socialai_dsl.errors import OptionError, UnreadableError, UsageError, described_error, first_mistake
from socialai_dsl.runs.lock import HeldError, Holder, hold, holder
from socialai_dsl.runs.status import Status
from socialai_dsl.trainer.config import LEARNS, RunConfig, scenario_file, scenario_in
from socialai_dsl.trainer.config import SCENARIO_FOLDER as SCENARIO
from socialai_dsl.trainer.files import CHECKPOINTS, METRICS, STARTS, checkpoint_files

# What training writes, and the copy of the scenario, are named where the trainer finds them.
__all__ = ["CHECKPOINTS", "METRICS", "SCENARIO", "STARTS"]

CONFIG: Final = "config.json"
OPTIONS: Final = "options.json"
"""What an experiment asks a run for, of which `config.json` is what came of it."""

RESULT: Final = "result.json"
CARD: Final = "model_card.md"
CURVE: Final = "learning_curve.png"
REPLAY: Final = "episode.html"
TRANSCRIPT: Final = "transcript.txt"
FILM: Final = "episode.gif"
FAILURE: Final = "failure"
"""The name of film and transcript of a failure, without their endings."""

EPISODES: Final = "episodes.csv"
ASKED: Final = "asked.csv"
EVALUATIONS: Final = "evaluation.json"
"""The results on several scenarios, in the folder above those of the scenarios."""
CROSSPLAY: Final = "crossplay.json"
"""Who plays how well with whom, in a folder of its own."""
WORDS: Final = "words.json"
"""What each seat says in which situation, likewise."""
DILEMMAS: Final = "dilemmas.json"
"""What those who cooperate and those who defect are paid, likewise."""
ROOMS: Final = "rooms.json"
"""Which rooms an evaluation played, where they are not the test set."""
TESTS: Final = "tests.json"
STATUS: Final = "status.json"
CANCEL: Final = "cancel"

_RUNS: Final = Path("runs")
"""Where runs go unless the user says otherwise."""

_WRITER: Final = "run"
_WORKER: Final = "worker"
LOCK_FILES: Final = tuple(f"{_WRITER}.{ending}" for ending in ("lock", "owner"))
_SECONDS_TO_WAIT: Final = 5.0
"""A process whose parent was killed takes a moment to end."""


@dataclass(frozen=True)
class Run:
    """A run and its folder, which may not exist yet.

    Two locks guard it: `only_writer` is held by the process that writes the run's files, `worker_lock` by that of an
    experiment, which starts one such process after another and has to see that a killed one has ended.

    Attributes:
        folder: where it is.
    """

    folder: Path

    @property
    def id(self) -> str:
        """The name of its folder."""
        return self.folder.name

    @property
    def config(self) -> RunConfig:
        """Its options; see `read_config`."""
        return read_config(self.folder)

    @property
    def agent(self) -> str:
        """Its agent, as `evaluate` takes it: the run's folder if it was trained."""
        config = self.config
        return str(self.folder) if config.trains else config.agent

    @property
    def result(self) -> dict[str, Any] | None:
        """Its result, as in `result.json`; None while the run is unfinished.

        Raises:
            UnreadableError: the file is damaged.
        """
        return self._read(RESULT)

    @property
    def tested(self) -> dict[str, Any]:
        """Its results on other scenarios: name -> figures."""
        return self._read(TESTS) or {}

    @property
    def checkpoint_frames(self) -> int | None:
        """Frames of the newest checkpoint; None if there is none."""
        names = [file.stem for file in checkpoint_files(self.folder / CHECKPOINTS)]
        return max((int(name) for name in names if name.isdigit()), default=None)

    @property
    def last_metrics(self) -> Mapping[str, Any] | None:
        """The last complete row of `metrics.jsonl`; None if there is none."""
        try:
            with open(self.folder / METRICS, "rb") as file:
                line = _last_whole_line(file)
        except OSError:
            return None
        try:
            row = json.loads(line) if line else None
        except ValueError:
            return None
        return row if isinstance(row, dict) else None

    def _read(self, name: str) -> dict[str, Any] | None:
        try:
            return read_json(self.folder / name)
        except FileNotFoundError:
            return None

    # -- what an experiment does with it ---------------------------------------------------------------------

    @property
    def status(self) -> Status:
        """What its worker says of it; see `Status.read`."""
        return Status.read(self.folder / STATUS)

    @property
    def shown_status(self) -> Status:
        """The status for people: a run whose worker is gone is waiting, one that cannot be read has failed."""
        try:
            status = self.status
            if status.state == "running" and self.worker is None:
                status.end("its process is gone", self.last_sign)
                status.state = "waiting"
        except (OSError, UnreadableError) as error:
            return Status("failed", message=f"cannot be read: {described_error(error)}")
        return status

    def write_status(self, status: Status) -> None:
        """Replace the status; only the worker may.

        Raises:
            OSError: it cannot be written.
        """
        status.write(self.folder / STATUS)

    @property
    def last_sign(self) -> float | None:
        """When its processes last wrote something, seconds since 1970; None if they never did."""
        times = []
        for name in (STATUS, METRICS):
            with contextlib.suppress(FileNotFoundError):
                times.append((self.folder / name).stat().st_mtime)
        return max(times, default=None)

    @property
    def is_cancelled(self) -> bool:
        """Whether a command has asked to give it up."""
        return (self.folder / CANCEL).exists()

    @property
    def worker(self) -> Holder | None:
        """The process that works on it for an experiment; None if there is none."""
        return holder(self.folder, _WORKER)

    @property
    def was_left(self) -> bool:
        """Whether its worker was killed: the lock is there, and nobody holds it."""
        return (self.folder / f"{_WORKER}.lock").exists() and self.worker is None

    def worker_lock(self) -> AbstractContextManager[None]:
        """Be its worker.

        Raises:
            HeldError: on entry, if another process is.
        """
        return hold(self.folder, _WORKER)


def read_config(folder: Path) -> RunConfig:
    """The configuration of a run's folder, as of a run in this folder.

    Raises:
        UsageError: it is not a run's folder, its configuration is damaged, or its copy of the scenario is missing.
        OSError: it cannot be read.
    """
    if not (folder / CONFIG).is_file():
        raise UsageError(f"{folder} is not a run's folder, it has no {CONFIG}")
    scenario_of(folder)
    try:
        # As JSON, because strict validation takes no lists for tuples from Python.
        return RunConfig.model_validate_json(json.dumps(read_json(folder / CONFIG))).within(folder)
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        raise UsageError(f"{folder / CONFIG}: {place}: {said}") from None


def agent_of(folder: Path) -> str:
    """Who plays in a run or an evaluation, as its folder says; `LEARNS` if the folder is that of a trained agent.

    Raises:
        UnreadableError, OSError: the folder does not say.
    """
    agent = read_json(folder / CONFIG).get("agent", LEARNS)
    if not isinstance(agent, str):
        raise UnreadableError(f"{folder / CONFIG}: agent: expected a text, got {agent!r}")
    return agent


def scenario_of(folder: Path) -> str:
    """The scenario that a run's folder is about, as it is loaded from here; other options may be of another version.

    Raises:
        UsageError: the folder does not say, or lacks its copy of the scenario.
        OSError: it cannot be read.
    """
    scenario = read_json(folder / CONFIG).get("scenario")
    if not isinstance(scenario, str):
        raise UnreadableError(f"{folder / CONFIG}: scenario: expected a text, got {scenario!r}")
    file = scenario_file(scenario)
    if file.parts[:1] == (SCENARIO,) and not (folder / file).is_file() and not file.is_file():
        raise UsageError(f"{folder} lacks its copy of the scenario, {file}; copy the folder as a whole")
    return scenario_in(folder, scenario)


def scenario_folder_name(spec: str) -> str:
    """`scenarios/talkitout.yaml+unsocial?a=1&b=2` -> `talkitout+unsocial,a=1,b=2`."""
    path, mark, parameters = spec.partition("?")
    name, plus, variants = Path(path).name.partition("+")
    name = name.removesuffix(".yaml").removesuffix(".yml")
    return name + plus + variants + ("," if mark else "") + parameters.replace("&", ",").replace("/", "_")


@contextlib.contextmanager
def new_run_folder(out: Path | None, spec: str, seed: int) -> Iterator[Path]:
    """Make the folder of a new run, `out` or `runs/<scenario>/<time>-s<seed>`, and be its only writer.

    Raises:
        UsageError: `out` holds a run already, or another process writes there.
        OSError: it cannot be made.
    """
    missing = _missing(_RUNS / scenario_folder_name(spec) if out is None else out)
    folder = _fresh_folder(spec, seed) if out is None else out
    try:
        with only_writer(folder):
            if (folder / CONFIG).exists():
                raise OptionError("out", f"{out} holds a run already; resume it, or choose another folder")
            yield folder
    except Exception:
        _remove_empty(missing)
        raise


def _fresh_folder(spec: str, seed: int) -> Path:
    """Make a folder that no other run has."""
    parent = _RUNS / scenario_folder_name(spec)
    stamp = f"{time.strftime('%Y%m%d-%H%M%S')}-s{seed}"
    for attempt in range(100):
        folder = parent / (stamp if attempt == 0 else f"{stamp}-{attempt + 1}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        return folder
    raise UsageError(f"{parent}: a hundred runs were started in this second")


@contextlib.contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Be the one process that writes a folder, which is made; the system ends this when the process dies.

    Whoever looks at what the folder holds, to decide what to write, does so inside.

    Raises:
        UsageError: another process writes there; the message names it.
        OSError: the folder cannot be made or written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(hold(folder, _WRITER, _SECONDS_TO_WAIT))
        except HeldError as error:
            raise UsageError(f"{error}; wait until it ends, or choose another folder") from None
        yield


@contextlib.contextmanager
def new_folders(folder: Path) -> Iterator[set[Path]]:
    """Make a folder, and take it back if the block cannot even begin its work.

    Yields:
        The set to which the block adds what it has put there to begin with. If it raises, these go, and so do the
        folders that were made, unless they hold something else.

    Raises:
        OSError: it cannot be made.
    """
    missing = _missing(folder)
    folder.mkdir(parents=True, exist_ok=True)
    before, begun = set(folder.iterdir()), set[Path]()
    try:
        yield begun
    except Exception:
        if set(folder.iterdir()) <= before | begun:
            for path in {one for one in begun - before if one.exists()}:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        _remove_empty(missing)
        raise


def _missing(folder: Path) -> list[Path]:
    """The folders that have to be made for a folder, itself first."""
    return [one for one in (folder, *folder.parents) if not one.exists()]


def _remove_empty(folders: Iterable[Path]) -> None:
    """Remove folders, the inner ones first, up to one that holds something."""
    with contextlib.suppress(OSError):
        for one in folders:
            if one.exists():
                one.rmdir()


def _last_whole_line(file: IO[bytes]) -> bytes:
    """The last line that is written to its end, however long it is; empty if there is none."""
    start = file.seek(0, os.SEEK_END)
    tail = b""
    while start and tail.count(b"\n") < 2:
        start, end = max(0, start - 65_536), start
        file.seek(start)
        tail = file.read(end - start) + tail
    return b"".join(tail.split(b"\n")[-2:-1])
