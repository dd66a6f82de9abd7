"""Brings all runs of an experiment to their ends, on any engine; runs of another command are waited for."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Final

from socialai_dsl.errors import UnreadableError, described_error
from socialai_dsl.experiments.engines import Engine, Handle
from socialai_dsl.experiments.folder import PlannedRun
from socialai_dsl.experiments.work import End, Outcome, finished

SECONDS_BETWEEN_LOOKS: Final = 0.2
SECONDS_BEFORE_ASKING_AGAIN: Final = 2.0


def drive(
    folder: Path,
    runs: Sequence[PlannedRun],
    engine: Engine,
    ended: Callable[[PlannedRun, Outcome, str], None],
) -> Generator[None, None, None]:
    """Work on runs until each has come to an end; yields several times a second, so that the caller can look around.

    Args:
        folder: the experiment's.
        runs: which runs.
        engine: who works on them; stopped when the iterator is closed.
        ended: told of each run that has come to its end.
    """
    waiting, work = {run.id: run for run in runs}, dict[str, tuple[PlannedRun, Handle]]()
    ask_again = time.monotonic()
    try:
        while work or waiting:
            for run, handle in [pair for pair in work.values() if pair[1].done()]:
                del work[run.id]
                outcome, message = _outcome(handle)
                if outcome is Outcome.HELD:
                    waiting[run.id] = run
                else:
                    ended(run, outcome, message)
            if time.monotonic() >= ask_again:
                ask_again = time.monotonic() + SECONDS_BEFORE_ASKING_AGAIN
                free = []
                for run in list(waiting.values()):
                    end = _known(run)
                    if end is None:
                        free.append(waiting.pop(run.id))
                    elif end[0] is not Outcome.HELD:
                        ended(waiting.pop(run.id), *end)
                handles = engine.submit(folder, [run.id for run in free]) if free else []
                work |= {run.id: (run, handle) for run, handle in zip(free, handles, strict=True)}
            yield
            time.sleep(SECONDS_BETWEEN_LOOKS)
    finally:
        engine.stop()


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM stop the block as Ctrl-C does.

    Raises:
        KeyboardInterrupt: the block was stopped; the message says that the same command goes on.
    """

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt("stopped; the same command goes on from here") from None
    finally:
        signal.signal(signal.SIGTERM, before)


def _known(run: PlannedRun) -> End | None:
    """What came of a run, or that another command works on it; None if it is to be given to the engine."""
    try:
        return finished(run) or ((Outcome.HELD, "") if run.worker is not None else None)
    except (OSError, UnreadableError) as error:
        return Outcome.FAILED, described_error(error)


def _outcome(handle: Handle) -> End:
    """What came of a run; or what the engine failed at, after as many tries as it makes. The run is as it was."""
    try:
        end: End = handle.result()
    except Exception as error:
        said = str(error).strip().splitlines() or [""]
        return Outcome.FAILED, f"{type(error).__name__}: {said[-1]}"
    return end
