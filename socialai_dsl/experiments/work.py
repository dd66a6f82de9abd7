"""One run from where it stands to its end: claimed, as processes of `socialai`, watched, resumed, written down."""

from __future__ import annotations

import collections
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import IO, Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.experiments import claims
from socialai_dsl.experiments.arguments import typed
from socialai_dsl.experiments.claims import Claim
from socialai_dsl.experiments.cores import lent_cores
from socialai_dsl.experiments.folder import (
    CHECKPOINTS,
    TESTS,
    Run,
    Status,
    UnreadableError,
    read_experiment,
    runs_of,
    said_of,
)

SECONDS_BETWEEN_SIGNS: Final = 5.0
PROGRAM = "socialai_dsl"
"""The module that is run for each run, with the words of the command line."""
_SECONDS_BETWEEN_LOOKS: Final = 0.2
_CRASHES_IN_PLACE: Final = 3
"""How often a process may die without having got further before its run counts as failed."""
_SECONDS_FOR_OLD_CHILDREN: Final = 2.5
"""How long a process that has lost its run may take to notice, see `leash`."""

Stop = Callable[[], bool]


class Outcome(StrEnum):
    """What came of working on a run."""

    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    STOPPED = "stopped"
    HELD = "held"  # somebody else works on it


class _StoppedError(Exception):
    """The run is to be left as it stands."""


class _CancelledError(Exception):
    """The run is to be given up."""


class _OvertakenError(Exception):
    """Somebody else works on it now."""


class _FailedError(Exception):
    """A process ended with an error; the message is what it said."""


def perform(
    folder: Path, run_id: str, stop: Stop, stale_after: float = claims.STALE_AFTER
) -> tuple[Outcome, str]:
    """Bring one run of an experiment to its end, from wherever it stands.

    Args:
        folder: the experiment's.
        run_id: which run.
        stop: asked several times a second whether the run is to be left as it stands.
        stale_after: seconds without a sign of life after which an owner elsewhere counts as gone.

    Returns:
        What came of it, and what a person should know. Errors of the run and of its folder are no exceptions: they
        stop this run, and no other.
    """
    try:
        document = read_experiment(folder)
        if document is None:
            raise UnreadableError(f"{folder}: this is no experiment's folder")
        run = next(run for run in runs_of(folder, document) if run.id == run_id)
        return _Work(run, stop).perform(stale_after)
    except (OSError, UnreadableError) as error:
        return Outcome.FAILED, said_of(error)


def perform_unasked(folder: str, run_id: str) -> tuple[str, str]:
    """`perform` for a process that a scheduler starts, and stops by a signal; plain words in and out."""
    outcome, message = perform(Path(folder), run_id, stop=lambda: False)
    return outcome.value, message


def finished(run: Run) -> tuple[Outcome, str] | None:
    """What came of a run that has come to its end, and a message; None if there is something left to do.

    Raises:
        OSError, UnreadableError: its folder does not tell.
    """
    status = run.status()
    if status.state == "done" and not run.missing_tests():
        return Outcome.DONE, ""
    if status.state in ("failed", "cancelled"):
        return Outcome(status.state), status.message or ""
    return None


class _Work:
    """Work on one run."""

    def __init__(self, run: Run, stop: Stop) -> None:
        self._run = run
        self._stop = stop
        self._status = Status()
        self._condition = run.condition

    def perform(self, stale_after: float) -> tuple[Outcome, str]:
        """Claim it, work, let go of it."""
        known = finished(self._run)
        if known is not None:
            return known
        before = claims.newest_claim(self._run.path)
        claim = claims.claim(self._run.path, stale_after)
        if claim is None:
            return Outcome.HELD, ""
        try:
            # It may have come to its end, or been given up, just before it was ours.
            return finished(self._run) or self._work(claim, before)
        finally:
            with contextlib.suppress(OSError):  # a claim whose process is gone counts as released as well
                claim.release()

    def _work(self, claim: Claim, before: Path | None) -> tuple[Outcome, str]:
        self._status = self._run.status()
        self._status.end("its process was gone", self._status.heartbeat)
        if before is not None:
            self._let_go(claims.owner_of(before) or {})
        try:
            self._train(claim)
            self._test(claim)
        except _OvertakenError:
            return Outcome.HELD, ""
        except (_StoppedError, KeyboardInterrupt):  # the latter is how a scheduler says it in its worker
            return self._leave("waiting", "stopped", Outcome.STOPPED)
        except SystemExit:  # Slurm takes the machine away
            self._leave("waiting", "stopped", Outcome.STOPPED)
            raise
        except _CancelledError:
            return self._leave("cancelled", "cancelled", Outcome.CANCELLED)
        except _FailedError as error:
            return self._leave("failed", str(error), Outcome.FAILED)
        return self._leave("done", "done", Outcome.DONE)

    def _let_go(self, owner: Mapping[str, Any]) -> None:
        """Wait until what an owner that is gone had started has noticed."""
        if "released" in owner:
            return
        end = time.monotonic() + _SECONDS_FOR_OLD_CHILDREN
        child = self._status.attempts[-1] if self._status.attempts else None
        here = owner.get("scope") == claims.scope()
        while time.monotonic() < end:
            if here and (child is None or claims.born(child["pid"]) != child.get("born")):
                return
            time.sleep(_SECONDS_BETWEEN_LOOKS)

    def _leave(self, state: str, reason: str, outcome: Outcome) -> tuple[Outcome, str]:
        self._status.end(reason)
        self._status.state = state  # type: ignore[assignment]
        self._status.message = reason if state == "failed" else None
        self._run.write_status(self._status)
        return outcome, self._status.message or ""

    # -- the two parts of a run ------------------------------------------------------------------------------

    def _train(self, claim: Claim) -> None:
        """Train if the agent is to be trained, and play its own test set."""
        died_at: list[int] = []
        while self._run.result() is None:
            crash = self._process(claim, self._run_command(), None)
            if crash is None:
                assert self._run.result() is not None, "internal: a run that ended well has no result"
                return
            died_at.append(self._run.checkpoint_frames() or 0)
            if died_at[-_CRASHES_IN_PLACE:] == [died_at[-1]] * _CRASHES_IN_PLACE:
                raise _FailedError(
                    f"{crash}, {_CRASHES_IN_PLACE} times after {died_at[-1]:,} frames; was there too little memory?"
                )
            self._status.end(crash)

    def _test(self, claim: Claim) -> None:
        """Play the other scenarios."""
        missing = self._run.missing_tests()
        if not missing:
            return
        self._status.end("trained")
        crashes = 0
        with tempfile.TemporaryFile() as output:
            while (crash := self._process(claim, self._test_command(missing), output)) is not None:
                crashes += 1
                if crashes == _CRASHES_IN_PLACE:
                    raise _FailedError(f"{crash}, {crashes} times while playing {', '.join(missing)}")
                self._status.end(crash)
                output.truncate(0)
            output.seek(0)
            found = json.loads(output.read())
        figures = {name: entry["eval"] for name, entry in zip(missing, found, strict=True)}
        write_json(self._run.path / TESTS, self._run.tested() | figures)

    def _run_command(self) -> list[str]:
        path, condition = self._run.path, self._condition
        config = path / "config.json"
        if (
            condition["agent"] == "ppo"
            and config.exists()
            and any((path / CHECKPOINTS).glob("*.safetensors"))
        ):
            return ["run", "--resume", str(path), "--json"]
        config.unlink(missing_ok=True)  # of a process that was killed before there was anything to resume
        command = ["run", condition["scenario"], "--agent", condition["agent"], "--seed", str(self._run.seed)]
        if condition["frames"] is not None:
            command += ["--frames", str(condition["frames"])]
        for key, value in condition["options"].items():
            command += typed(key, value)
        return [*command, "--out", str(path), "--json"]

    def _test_command(self, scenarios: Sequence[str]) -> list[str]:
        condition, options = self._condition, self._condition["options"]
        agent = str(self._run.path) if condition["agent"] == "ppo" else condition["agent"]
        command = [
            "evaluate",
            agent,
            "--episodes",
            str(options["eval_episodes"]),
            "--device",
            options["device"],
        ]
        if condition["agent"] != "ppo":
            command += ["--seed", str(self._run.seed)]
        if ":" in str(options.get("net", "")):
            command += ["--net", options["net"]]
        return [*command, *(word for name in scenarios for word in ("--on", name)), "--json"]

    # -- processes -------------------------------------------------------------------------------------------

    def _process(self, claim: Claim, arguments: Sequence[str], output: IO[bytes] | None) -> str | None:
        """Run one process of `socialai` to its end; what killed it, if something did.

        Raises:
            _FailedError: it ended with an error.
            _StoppedError, _CancelledError, _OvertakenError: it was ended.
        """
        self._heed_wishes()
        threads = int(self._condition["options"].get("threads", 1))
        with lent_cores(threads) as cores:
            child = self._start(claim, arguments, cores, threads, output)
            said: collections.deque[str] = collections.deque(maxlen=20)
            listener = threading.Thread(target=_listen, args=(child.stderr, said), daemon=True)
            listener.start()
            try:
                # What training starts from; testing starts where training ended.
                self._status.begin(child.pid, self._run.checkpoint_frames() or 0)
                self._run.write_status(self._status)
                self._watch(claim, child)
            finally:
                _end(child)
                listener.join()
        if child.returncode < 0:
            return f"killed by signal {signal.Signals(-child.returncode).name}"
        if child.returncode:
            reason = said[-1] if said else f"exit code {child.returncode}, and no word"
            raise _FailedError(reason)
        return None

    def _heed_wishes(self) -> None:
        if self._stop():
            raise _StoppedError
        if self._run.is_cancelled():
            raise _CancelledError

    def _start(
        self,
        claim: Claim,
        arguments: Sequence[str],
        cores: Sequence[int],
        threads: int,
        output: IO[bytes] | None,
    ) -> subprocess.Popen[bytes]:
        leash = [sys.executable, "-m", "socialai_dsl.experiments.leash", str(claim.path)]
        command = [*leash, ",".join(map(str, cores)), PROGRAM, *arguments]
        environment = os.environ | {
            name: str(threads) for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
        }
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,  # closed when we die, see `leash`
            stdout=subprocess.DEVNULL if output is None else output,
            stderr=subprocess.PIPE,
            env=environment,
            start_new_session=True,  # so that Ctrl-C reaches us alone
        )

    def _watch(self, claim: Claim, child: subprocess.Popen[bytes]) -> None:
        next_sign = time.monotonic() + SECONDS_BETWEEN_SIGNS
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(_SECONDS_BETWEEN_LOOKS)
                return
            self._heed_wishes()
            if time.monotonic() >= next_sign:
                next_sign = time.monotonic() + SECONDS_BETWEEN_SIGNS
                if not claim.renew():
                    raise _OvertakenError
                self._run.write_status(self._status)


def _listen(stream: IO[bytes] | None, said: collections.deque[str]) -> None:
    """Keep the last lines of a stream, and empty it, so that nobody waits for us."""
    assert stream is not None, "internal: the stream was asked for"
    with stream:
        for line in stream:
            text = line.decode("utf-8", "replace").rstrip()
            if text:
                said.append(text)


def _end(child: subprocess.Popen[bytes]) -> None:
    """End a process if it still runs; what it had not saved is trained again, to the same bits."""
    if child.poll() is None:
        child.kill()
        child.wait()
    assert child.stdin is not None, "internal: the pipe was asked for"
    child.stdin.close()
