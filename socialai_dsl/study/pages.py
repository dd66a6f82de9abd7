"""The page that a participant has open: what it is shown, in order, and how much it may send."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from socialai_dsl.study.messages import Screen

_BURST: Final = 60
_PER_SECOND: Final = 20
"""Messages that a page may send: at once, and in each second."""


@dataclass(eq=False)
class _Due:
    """A screen, and whether all that led to it is stored."""

    screen: Screen
    stored: bool = False


@dataclass(eq=False)
class Page:
    """An open page of a participant.

    Attributes:
        person: whose. send: takes what is to be shown. leave: closes the connection with a code and words.
        connection: which of the participant's it is, from 1. sign: when it was last heard.
        on: the name of the screen that it shows, or will.
        knows: the game of which it has been told what can be done and said.
        elsewhere: whether it is a page of somebody else, which keeps data of its own.
    """

    person: str
    send: Callable[[Screen], None]
    leave: Callable[[int, str], None]
    connection: int
    sign: float
    on: str | None = None
    knows: str | None = None
    elsewhere: bool = False
    _tokens: float = _BURST
    _due: deque[_Due] = field(default_factory=deque)

    def may_speak(self, now: float) -> bool:
        """Whether it has not sent too much; counts one more message."""
        self._tokens = min(_BURST, self._tokens + (now - self.sign) * _PER_SECOND)
        self.sign = now
        self._tokens -= 1
        return self._tokens >= 0

    def will_show(self, screen: Screen) -> _Due:
        """A screen that is shown behind those before it, once `show` is told that it may be."""
        self.on = screen["on"]
        self._due.append(_Due(screen))
        return self._due[-1]

    def show(self, due: _Due) -> None:
        """Show a screen, as soon as those before it are."""
        due.stored = True
        while self._due and self._due[0].stored:
            self.send(self._due.popleft().screen)

    def show_at_once(self, screen: Screen) -> None:
        """Show a screen in place of those that have not been shown, of which nothing is true any more."""
        self._due.clear()
        self.on = screen["on"]
        self.send(screen)
