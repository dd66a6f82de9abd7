"""Brings one run to its end: locked, run as processes of `socialai`, resumed, recorded."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import IO, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.errors import UnreadableError, described_error
from socialai_dsl.experiments.document import OF_OWN_CODE
from socialai_dsl.experiments.folder import PlannedRun, read_experiment, runs_of
from socialai_dsl.runs.folder import (
    CANCEL,
    CHECKPOINTS,
    CONFIG,
    OPTIONS,
    RESULT,
    TESTS,
    scenario_folder_name,
)
from socialai_dsl.runs.lock import HeldError
from socialai_dsl.runs.status import State, Status
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX, UNTRAINED
from socialai_dsl.trainer.files import checkpoint_files

PROGRAM = "socialai_dsl"
"""The module that is run for each run, with the words of the command line."""
PLAYED: Final = "played"
"""The folder in a run's where `socialai evaluate` plays."""
_ASKED: Final = {"episodes": "eval_episodes", "trials": "trials"}
"""Options of `socialai evaluate` and what an experiment calls them."""

_SECONDS_BETWEEN_LOOKS: Final = 0.2
_SECONDS_TO_SAVE: Final = 10.0
"""How long a process that is ended may take to save its checkpoint."""
_CRASHES_IN_PLACE: Final = 3
"""How often a process may die without having got further before its run counts as failed."""


class Outcome(StrEnum):
    """What came of working on a run."""

    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    STOPPED = "stopped"
    HELD = "held"  # another process works on it


End = tuple[Outcome, str]
"""What came of a run, and what a person should know."""

Stop = Callable[[], bool]


class _StoppedError(Exception):
    """The run is to be left as it stands."""


class _CancelledError(Exception):
    """The run is to be given up."""


class _FailedError(Exception):
    """A process ended with an error; the message is what it said."""


def perform(folder: Path, run_id: str, stop: Stop = lambda: False) -> End:
    """Bring one run of an experiment to its end, from wherever it stands. All engines call this function.

    Args:
        folder: the experiment's.
        run_id: which run.
        stop: asked several times a second whether the run is to be left as it stands; engines that stop their workers
            by other means leave it out.

    Returns:
        What came of it. Errors of the run and of its folder are no exceptions: they stop this run, and no other.
    """
    try:
        run = next(run for run in runs_of(folder, read_experiment(folder)) if run.id == run_id)
        return finished(run) or _performed_alone(run, stop)
    except (OSError, UnreadableError) as error:
        return Outcome.FAILED, described_error(error)


def finished(run: PlannedRun) -> End | None:
    """What came of a run that has come to its end; None if there is something left to do.

    Raises:
        OSError, UnreadableError: its folder does not tell.
    """
    status = run.status
    if status.state == "done" and not run.missing_tests:
        return Outcome.DONE, ""
    if status.state in ("failed", "cancelled"):
        return Outcome(status.state), status.message or ""
    return None


def cancel(run: PlannedRun) -> None:
    """Give a run up: at once if no process works on it, else by the worker, which lets it save first."""
    run.folder.mkdir(parents=True, exist_ok=True)
    (run.folder / CANCEL).touch()
    _settle(run, "cancelled")


def retry(run: PlannedRun) -> bool:
    """Let a run that failed or was cancelled wait again; False if a process works on it."""
    (run.folder / CANCEL).unlink(missing_ok=True)
    return _settle(run, "waiting")


def _settle(run: PlannedRun, state: State) -> bool:
    """Change the state of a run that no process works on; whether that was so."""
    try:
        with run.worker_lock():
            try:
                status = run.status
            except UnreadableError:
                status = Status()  # what it said is lost; what the run has computed is not
            status.end("its process was gone", run.last_sign)
            status.state, status.message = state, None
            run.write_status(status)
    except HeldError:
        return False
    return True


def _performed_alone(run: PlannedRun, stop: Stop) -> End:
    run.folder.mkdir(parents=True, exist_ok=True)
    try:
        with run.worker_lock():
            # It may have come to its end, or been given up, just before it was ours.
            return finished(run) or _Work(run, stop).perform()
    except HeldError:
        return Outcome.HELD, ""


class _Work:
    """Work on one run; the caller holds its lock."""

    def __init__(self, run: PlannedRun, stop: Stop) -> None:
        self._run = run
        self._stop = stop
        self._status = Status()
        self._condition = run.condition

    def perform(self) -> End:
        """Train, test, and write down what came of it."""
        self._status = self._run.status
        self._status.end("its process was gone", self._run.last_sign)
        try:
            self._train()
            self._test()
        except (_StoppedError, KeyboardInterrupt):  # the latter is how Ray says it in its worker
            return self._leave("waiting", "stopped", Outcome.STOPPED)
        except SystemExit:  # Slurm takes the machine away
            self._leave("waiting", "stopped", Outcome.STOPPED)
            raise
        except _CancelledError:
            return self._leave("cancelled", "cancelled", Outcome.CANCELLED)
        except _FailedError as error:
            return self._leave("failed", str(error), Outcome.FAILED)
        return self._leave("done", "done", Outcome.DONE)

    def _leave(self, state: State, reason: str, outcome: Outcome) -> End:
        self._status.end(reason)
        self._status.state = state
        self._status.message = reason if state == "failed" else None
        self._run.write_status(self._status)
        return outcome, self._status.message or ""

    @property
    def _is_trained(self) -> bool:
        return bool(self._condition["agent"] == "ppo")

    # -- the two parts of a run ------------------------------------------------------------------------------

    def _train(self) -> None:
        """Train if the agent is to be trained, and play its own test set."""
        died_at: list[int] = []
        while not self._has_result():
            # All may be played already, and have been left while it was moved.
            crash = None if (self._played / RESULT).exists() else self._process(self._run_command())
            if crash is None and self._run.is_played:
                self._take_results()
            if crash is None:
                assert self._has_result(), "internal: a run that ended well has no result"
                return
            died_at.append(self._run.checkpoint_frames or 0)
            if died_at[-_CRASHES_IN_PLACE:] == [died_at[-1]] * _CRASHES_IN_PLACE:
                raise _FailedError(
                    f"{crash}, {_CRASHES_IN_PLACE} times after {died_at[-1]:,} frames; was there too little memory?"
                )
            self._status.end(crash)

    def _has_result(self) -> bool:
        return self._run.result is not None

    def _test(self) -> None:
        """Play the other scenarios."""
        missing = self._run.missing_tests
        if not missing:
            return
        self._status.end("trained")
        crashes = 0
        with tempfile.TemporaryFile() as output:
            while (crash := self._process(self._test_command(missing), output)) is not None:
                crashes += 1
                if crashes == _CRASHES_IN_PLACE:
                    raise _FailedError(f"{crash}, {crashes} times while playing {', '.join(missing)}")
                self._status.end(crash)
                output.seek(0)  # the next process writes where this one stopped
                output.truncate()
            output.seek(0)
            found = json.loads(output.read())
        figures = {
            name: entry["eval"] | {"program_sha256": entry["program_sha256"]}
            for name, entry in zip(missing, found, strict=True)
        }
        write_json(self._run.folder / TESTS, self._run.tested | figures)

    @property
    def _played(self) -> Path:
        """Where `socialai evaluate` leaves what it has played; it writes the result last."""
        return self._run.folder / PLAYED / scenario_folder_name(self._condition["scenario"])

    def _take_results(self) -> None:
        """Move what `socialai evaluate` left for the scenario to where a run has it, its result last."""
        for path in sorted(self._played.iterdir(), key=lambda path: path.name == RESULT):
            there = self._run.folder / path.name
            if there.is_dir():
                shutil.rmtree(there)
            path.replace(there)
        shutil.rmtree(self._run.folder / PLAYED)

    @property
    def _own_code(self) -> dict[str, str]:
        """The code of the user's own by which the agent plays, by option, which no checkpoint may name alone."""
        options = self._condition["options"]
        return {name: options[name] for name in OF_OWN_CODE if ":" in str(options.get(name, ""))}

    def _play_command(self) -> list[str]:
        condition, options = self._condition, self._condition["options"]
        asked = dict(options.get("model", {}))
        switches = [f"--{name}" for name, value in asked.items() if value is True]
        values = {
            name.replace("_", "-"): value for name, value in asked.items() if not isinstance(value, bool)
        }
        values |= {name: options[key] for name, key in _ASKED.items() if key in options}
        agent = condition["agent"]
        if agent != "oracle" and not agent.startswith((MODEL_PREFIX, RIVAL_PREFIX)):
            values |= {"seed": self._run.seed} | ({} if agent in UNTRAINED else {"device": options["device"]})
        values |= self._own_code
        words = [word for name, value in values.items() for word in (f"--{name}", str(value))]
        out = ["--out", str(self._run.folder / PLAYED), "--json"]
        return ["evaluate", agent, "--on", condition["scenario"], *words, *switches, *out]

    def _run_command(self) -> list[str]:
        if self._run.is_played:
            return self._play_command()
        folder = self._run.folder
        config = folder / CONFIG
        if self._is_trained and config.exists() and checkpoint_files(folder / CHECKPOINTS):
            return ["run", "--resume", str(folder), "--json"]
        config.unlink(missing_ok=True)  # of a process that was killed before there was anything to resume
        write_json(folder / OPTIONS, self._run.options)
        return ["run", "--config", str(folder / OPTIONS), "--out", str(folder), "--json"]

    def _test_command(self, scenarios: Sequence[str]) -> list[str]:
        condition, options = self._condition, self._condition["options"]
        agent = str(self._run.folder) if self._is_trained else condition["agent"]
        command = [
            "evaluate",
            agent,
            "--episodes",
            str(options["eval_episodes"]),
        ]
        if agent not in UNTRAINED:
            command += ["--device", options["device"]]
        if agent not in ("oracle", str(self._run.folder)):
            command += ["--seed", str(self._run.seed)]
        command += [word for name, value in self._own_code.items() for word in (f"--{name}", value)]
        return [*command, *(word for name in scenarios for word in ("--on", name)), "--json"]

    # -- processes -------------------------------------------------------------------------------------------

    def _process(self, arguments: Sequence[str], output: IO[bytes] | None = None) -> str | None:
        """Run one process of `socialai` to its end; what killed it, if something did.

        Raises:
            _FailedError: it ended with an error.
            _StoppedError, _CancelledError: it was ended.
        """
        self._heed_wishes()
        with tempfile.TemporaryFile() as said:
            child = self._start(arguments, output, said)
            try:
                # What training starts from; testing starts where training ended.
                self._status.begin(child.pid, self._run.checkpoint_frames or 0)
                self._run.write_status(self._status)
                self._wait(child)
            finally:
                _end(child)
                assert child.stdin is not None, "internal: the pipe was asked for"
                child.stdin.close()
            if child.returncode > 0:
                raise _FailedError(_last_line(said) or f"exit code {child.returncode}, and no word")
        return f"killed by signal {signal.Signals(-child.returncode).name}" if child.returncode else None

    def _start(
        self, arguments: Sequence[str], output: IO[bytes] | None, said: IO[bytes]
    ) -> subprocess.Popen[bytes]:
        threads = str(self._condition["options"].get("threads", 1))
        return subprocess.Popen(
            [sys.executable, "-m", "socialai_dsl.experiments.ends_with_parent", PROGRAM, *arguments],
            stdin=subprocess.PIPE,  # closed when we die, see `ends_with_parent`
            stdout=subprocess.DEVNULL if output is None else output,
            stderr=said,
            env=os.environ
            | dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), threads),
            start_new_session=True,  # so that Ctrl-C reaches us alone
        )

    def _wait(self, child: subprocess.Popen[bytes]) -> None:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(_SECONDS_BETWEEN_LOOKS)
                return
            self._heed_wishes()

    def _heed_wishes(self) -> None:
        if self._stop():
            raise _StoppedError
        if self._run.is_cancelled:
            raise _CancelledError


def _end(child: subprocess.Popen[bytes]) -> None:
    """End a process, if it still runs. What it does not save in time is trained again, to the same bits."""
    child.terminate()
    try:
        child.wait(_SECONDS_TO_SAVE)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()


def _last_line(stream: IO[bytes]) -> str:
    """The last line of a file that says anything."""
    stream.seek(max(0, stream.seek(0, os.SEEK_END) - 65_536))
    lines = stream.read().decode("utf-8", "replace").split("\n")
    return next((line.rstrip() for line in reversed(lines) if line.strip()), "")
