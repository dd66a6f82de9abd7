"""The engine's tasks and return codes, shared with the compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum


class RoomError(RuntimeError):
    """No room that was drawn for an episode is as the scenario's `require` asks.

    Attributes:
        rows: those of the batch in which it is so; in the others all was done.
    """

    def __init__(self, message: str, rows: Sequence[int] = ()) -> None:
        super().__init__(message, rows)
        self.rows = rows

    def __str__(self) -> str:
        """The message."""
        return str(self.args[0])


TERMINATED = 1
TRUNCATED = 2

BAD_ACTION = -1
"""Returned instead of stepping if an action is outside its space."""

NO_ROOM = -(1 << 32)
"""Added to what is returned for each row that found no room as required; `Ports.refused` tells which."""


class Task(IntEnum):
    """The task of a call of `serve`."""

    STEP_NEXT = 0  # step; an episode that has ended is reset by the next step
    STEP_SAME = 1  # step; an episode that ends is reset at once, its last observation is kept
    STEP_ONLY = 2  # step; resets are the caller's
    RESET = 3  # reset the chosen rows to the episode named by their keys
