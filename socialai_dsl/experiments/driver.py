"""Brings all runs of an experiment to their ends, on any engine; runs of another command are waited for."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Final

from socialai_dsl.experiments.engines import Engine, Handle
from socialai_dsl.experiments.folder import Run, UnreadableError, is_locked, said_of
from socialai_dsl.experiments.work import End, Outcome, finished

SECONDS_BETWEEN_LOOKS: Final = 0.2
SECONDS_BEFORE_ASKING_AGAIN: Final = 2.0
_ATTEMPTS_OF_THE_ENGINE: Final = 5
"""How often an engine may fail at a run, through no fault of the run's, before that is called a failure."""


def drive(
    folder: Path, runs: Sequence[Run], engine: Engine, ended: Callable[[Run, Outcome, str], None]
) -> Generator[None, None, None]:
    """Work on runs until each has come to an end; yields several times a second, so that the caller can look around.

    Args:
        folder: the experiment's.
        runs: which runs.
        engine: who works on them; stopped when the iterator is closed.
        ended: told of each run that has come to its end.
    """
    known = {run.id: run for run in runs}
    work: dict[str, Handle] = {}
    failures: dict[str, int] = {}
    # Runs that are to be given to the engine, and when.
    waiting = dict.fromkeys(known, 0.0)
    try:
        while work or waiting:
            for identity in [identity for identity, handle in work.items() if handle.done()]:
                outcome, message = _outcome(work.pop(identity), failures, identity)
                if outcome is Outcome.HELD:
                    waiting[identity] = time.monotonic() + SECONDS_BEFORE_ASKING_AGAIN
                else:
                    ended(known[identity], outcome, message)
            free = []
            for identity in [identity for identity, moment in waiting.items() if moment <= time.monotonic()]:
                waiting[identity] = time.monotonic() + SECONDS_BEFORE_ASKING_AGAIN
                known_end, is_held = _known(known[identity])
                if known_end is not None:
                    ended(known[identity], *known_end)
                elif not is_held:
                    free.append(identity)
                if known_end is not None or not is_held:
                    del waiting[identity]
            if free:
                work |= zip(free, engine.submit(folder, free), strict=True)
            yield
            time.sleep(SECONDS_BETWEEN_LOOKS)
    finally:
        engine.stop()


def _known(run: Run) -> tuple[End | None, bool]:
    """What came of a run, if that is known, and whether somebody works on it; then no engine is asked."""
    try:
        return finished(run), is_locked(run.path)
    except (OSError, UnreadableError) as error:
        return (Outcome.FAILED, said_of(error)), False


def _outcome(handle: Handle, failures: dict[str, int], identity: str) -> End:
    """What came of a run; what an engine failed at is tried again some times, since the run is as it was."""
    try:
        outcome, message = handle.result()
        return Outcome(outcome), message
    except Exception as error:
        failures[identity] = failures.get(identity, 0) + 1
        if failures[identity] < _ATTEMPTS_OF_THE_ENGINE:
            return Outcome.HELD, ""
        said = str(error).strip().splitlines() or [""]
        return Outcome.FAILED, f"{type(error).__name__}: {said[-1]}"
