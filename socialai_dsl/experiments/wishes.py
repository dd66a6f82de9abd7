"""What people want of runs that may be at work elsewhere: to be given up, or tried again."""

from __future__ import annotations

import contextlib

from socialai_dsl.experiments import claims
from socialai_dsl.experiments.folder import CANCEL, Run, State, Status, UnreadableError


def cancel(run: Run) -> None:
    """Give a run up: at once if nobody works on it, else within seconds by who does."""
    run.ask_to_cancel()
    _settle(run, "cancelled")


def retry(run: Run) -> bool:
    """Let a run that failed or was cancelled wait again; False if somebody works on it."""
    with contextlib.suppress(FileNotFoundError):
        (run.path / CANCEL).unlink()
    return _settle(run, "waiting")


def _settle(run: Run, state: State) -> bool:
    """Change the state of a run that nobody works on; whether that was so."""
    claim = claims.claim(run.path)
    if claim is None:
        return False
    try:
        try:
            status = run.status()
        except UnreadableError:
            status = Status()  # what it said is lost; what the run has computed is not
        status.end("its process was gone", status.heartbeat)
        status.state, status.message = state, None
        run.write_status(status)
    finally:
        claim.release()
    return True
