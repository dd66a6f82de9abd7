"""All runs of an experiment to their end, on any engine: what another machine works on is waited for, or taken over."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Final

from socialai_dsl.experiments.engines import Engine, Handle
from socialai_dsl.experiments.folder import Run
from socialai_dsl.experiments.work import Outcome

SECONDS_BETWEEN_LOOKS: Final = 0.2
SECONDS_BEFORE_ASKING_AGAIN: Final = 3.0
_ATTEMPTS_OF_THE_ENGINE: Final = 3
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
    work = {run.id: engine.submit(folder, run.id) for run in runs}
    again: dict[str, float] = {}
    failures: dict[str, int] = {}
    known = {run.id: run for run in runs}
    try:
        while work or again:
            for identity in [identity for identity, handle in work.items() if handle.done()]:
                outcome, message = _outcome(work.pop(identity), failures, identity)
                if outcome is Outcome.HELD:
                    again[identity] = time.monotonic() + SECONDS_BEFORE_ASKING_AGAIN
                else:
                    ended(known[identity], outcome, message)
            for identity in [i for i, moment in again.items() if moment <= time.monotonic()]:
                del again[identity]
                work[identity] = engine.submit(folder, identity)
            yield
            time.sleep(SECONDS_BETWEEN_LOOKS)
    finally:
        engine.stop()


def _outcome(handle: Handle, failures: dict[str, int], identity: str) -> tuple[Outcome, str]:
    """What came of a run; what an engine failed at is tried again some times, since the run is as it was."""
    try:
        return handle.result()
    except Exception as error:
        failures[identity] = failures.get(identity, 0) + 1
        if failures[identity] < _ATTEMPTS_OF_THE_ENGINE:
            return Outcome.HELD, ""
        return Outcome.FAILED, f"{type(error).__name__}: {error}"
