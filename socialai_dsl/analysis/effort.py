"""The budget of an analysis: rooms, states and time, and the report of its progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Final, TypeVar

EPISODES: Final = 200
"""How many episodes of each agent tell the coverage of a scenario."""

Tell = Callable[[str], None]
"""Takes a line about how far something is."""

_QUIET: Final = 1.0
"""Seconds after which progress is told, and between two such lines."""

T = TypeVar("T")


def why_no_more(interrupted: bool, command: str = "") -> str:
    """Why something was not tried to its end; `command` has the option, if it is not the one that tells."""
    return "it was interrupted" if interrupted else f"`{command}--seconds` gives more time"


class OutOfTimeError(Exception):
    """The time of a task is spent, or an interruption was requested, before anything was found out."""


class Clock:
    """When to stop.

    Args:
        seconds: how long there is from now on; None: for ever.
        tell: takes a line about progress, at most one a second.
    """

    def __init__(self, seconds: float | None = None, tell: Tell | None = None) -> None:
        now = time.monotonic()
        self._until = None if seconds is None else now + seconds
        self._tell, self._last = tell, now
        self._whole, self._interrupted = self, False

    @property
    def interrupted(self) -> bool:
        """Whether an interruption was requested."""
        return self._whole._interrupted

    @property
    def is_over(self) -> bool:
        """Whether the time is spent, or an interruption was requested."""
        return self.interrupted or (self._until is not None and time.monotonic() >= self._until)

    @property
    def left(self) -> float | None:
        """Seconds; None: for ever."""
        return None if self._until is None else max(0.0, self._until - time.monotonic())

    def part(self, tasks: float) -> Clock:
        """A clock for the next of several tasks that share the time left; of 2.5, for two of five."""
        own = Clock(None if self.left is None else self.left / tasks, self._tell)
        own._whole = self._whole
        return own

    @contextmanager
    def limiting(self) -> Iterator[None]:
        """Within the block `keep_time` looks at this clock."""
        token = _limit.set(self)
        try:
            yield
        finally:
            _limit.reset(token)

    def interrupt(self) -> None:
        """Stop as soon as possible, and tell what is known."""
        self._whole._interrupted = True

    @contextmanager
    def until_interrupted(self) -> Iterator[None]:
        """Ctrl-C ends the block, and requests an interruption."""
        try:
            yield
        except KeyboardInterrupt:
            self.interrupt()

    def progress(self, what: str) -> None:
        """Tell how far it is, if it is time for that."""
        now = time.monotonic()
        if self._tell is not None and now - self._whole._last >= _QUIET:
            self._whole._last = now
            self._tell(what)


_limit: ContextVar[Clock | None] = ContextVar("limit", default=None)


def keep_time() -> None:
    """Give up what is being done once the clock that limits it is over.

    Raises:
        OutOfTimeError: it is.
    """
    clock = _limit.get()
    if clock is not None and clock.is_over:
        raise OutOfTimeError


@dataclass(frozen=True)
class Effort:
    """How much is tried: the rooms 0, 1, ... of a seed, a number of states of each, and a time."""

    rooms: int = 100
    seed: int = 0
    states: int = 50_000
    clock: Clock = field(default_factory=Clock, compare=False)

    def each_room(self, what: str, find: Callable[[int], T], complete: Callable[[T], bool]) -> Iterator[T]:
        """Results room by room, until the time is spent or an interruption.

        Args:
            what: for progress, such as `needs: ada`.
            find: looks at one room.
            complete: whether what was found is more than that the time was spent.
        """
        for room in range(self.rooms):
            over = self.clock.is_over
            if over:
                return
            self.clock.progress(f"{what}: room {room} of {self.rooms}")
            try:
                with self.clock.limiting():
                    found = find(room)
            except OutOfTimeError:
                return
            except KeyboardInterrupt:
                self.clock.interrupt()
                return
            if self.clock.is_over and not complete(found):
                return
            yield found
