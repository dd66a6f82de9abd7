"""One game for several people, each in a browser of their own: a step is taken when all of them have chosen.

The game is a window's. Whoever has the link to another seat of it sees, hears and does what that seat does, and
nothing else. Who does not choose in time, or leaves, is stood in for by whoever the window has for that seat.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Callable
from typing import Final

from starlette.websockets import WebSocket

from socialai_dsl.studio.engine import Engine, EngineLostError
from socialai_dsl.studio.messages import (
    ANSWERS,
    WINDOW_QUESTIONS,
    Act,
    Auto,
    Choose,
    Chosen,
    Glance,
    Glanced,
    Guests,
    Question,
    Refused,
    parsed,
)
from socialai_dsl.web.connection import close, contents, send, send_soon

NO_GAME: Final = 4404
TAKEN: Final = 4409
PUSHED: Final = 0
"""The number of messages that answer no question; windows number theirs from 1."""
_GOING_ON: Final = ("draw", "begin", "show", "act", "auto", "back", "place")
"""After these the game is at another moment."""


class _Guest:
    """A person on a seat.

    Attributes:
        socket: the connection. chosen: the action for the next step.
        plays: whether the seat is one of the game that goes on now, and not that of the window.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket
        self.chosen: list[int] | None = None
        self.plays = False


class SharedGame:
    """The game of a window as far as others take part.

    Args:
        engine: the window's process.
        play: puts a question about the game behind those that wait for their answers.
        tell: sends a message to the window.

    Attributes:
        seconds: how long the others wait for somebody, once one has chosen; None: for ever.
    """

    def __init__(self, engine: Engine, play: Callable[[Question], None], tell: Callable[[str], None]) -> None:
        self._engine, self._play, self._tell = engine, play, tell
        self._guests: dict[str, _Guest] = {}
        self._own: Act | Auto | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._ended = False
        self._said = Guests(id=PUSHED, do="guests", chosen={}, own=False)
        self.seconds: float | None = None

    async def seat(self, socket: WebSocket, seat: str) -> None:
        """Let a person have a seat until the connection ends."""
        if seat in self._guests:
            await close(socket, TAKEN, "somebody has this seat already; the page tries again")
            return
        guest = self._guests[seat] = _Guest(socket)
        try:
            await self._show(seat, guest)
            self._say_who_chooses()
            async for content in contents(socket):
                await self._hear(guest, content)
        finally:
            del self._guests[seat]
            self._advance()

    def holds_back(self, asked: Question) -> bool:
        """Whether a question of the window waits for the others; one that leads elsewhere ends all waiting."""
        if isinstance(asked, Act | Auto):
            if self._ended or not any(guest.plays for guest in self._guests.values()):
                return False
            self._give_up("you have chosen anew")
            self._own = asked
            self._advance()
            return True
        if asked.do in _GOING_ON:
            self._begin_anew("the step was given up")
        return False

    async def changed(self, asked: Question) -> None:
        """Show the others what came of a question of the window that was answered."""
        if asked.do in _GOING_ON:
            for seat, guest in tuple(self._guests.items()):
                await self._show(seat, guest)

    async def end(self) -> None:
        """Send everybody away: the window is closed."""
        self._begin_anew("")
        for guest in tuple(self._guests.values()):
            await close(guest.socket, NO_GAME, "the window of this game was closed")

    async def _hear(self, guest: _Guest, content: str | bytes) -> None:
        """Take what a person has chosen, or say why it cannot be done."""
        asked = parsed(WINDOW_QUESTIONS, content if isinstance(content, str) else "")
        if not isinstance(asked, Choose):
            why = asked.refused if isinstance(asked, Refused) else f"got {asked.do!r}, expected 'choose'"
            await send(guest.socket, Refused(id=asked.id, refused=why).model_dump_json())
            return
        text = await self._asked(asked)
        await send(guest.socket, text)
        answer = ANSWERS.validate_json(text)
        if isinstance(answer, Chosen):
            guest.chosen = answer.action
            self._advance()

    async def _show(self, seat: str, guest: _Guest) -> None:
        text = await self._asked(Glance(id=PUSHED, do="glance", seat=seat))
        answer = ANSWERS.validate_json(text)
        guest.plays = isinstance(answer, Glanced)
        if isinstance(answer, Glanced):
            self._ended = answer.success is not None
        await send(guest.socket, text)

    async def _asked(self, question: Choose | Glance) -> str:
        """The answer of the window's process."""
        try:
            return await self._engine.ask(question)
        except EngineLostError as lost:
            return Refused(id=question.id, refused=str(lost)).model_dump_json()

    def _advance(self) -> None:
        """Take the step if nobody is waited for any more; if somebody is, not for longer than is said."""
        waits = [guest for guest in self._guests.values() if guest.plays and guest.chosen is None]
        if self._own is not None and not waits:
            self._step(self._own)
        elif self._own is None and not self._choices():
            self._stop_waiting()
        elif self._timer is None and self.seconds is not None:
            self._timer = asyncio.get_running_loop().call_later(self.seconds, self._time_out)
        self._say_who_chooses()

    def _time_out(self) -> None:
        """Take the step without those who are late."""
        self._timer = None
        self._step(self._own or Act(id=PUSHED, do="act", stands_in=True))
        self._say_who_chooses()

    def _step(self, own: Act | Auto) -> None:
        choices, self._own = self._choices(), None
        self._forget()
        self._play(own.model_copy(update={"acts": choices}))

    def _choices(self) -> dict[str, list[int]]:
        return {seat: guest.chosen for seat, guest in self._guests.items() if guest.chosen is not None}

    def _begin_anew(self, why: str) -> None:
        """Forget what was chosen."""
        self._give_up(why)
        self._forget()
        self._say_who_chooses()

    def _give_up(self, why: str) -> None:
        """Answer the window, whose step is not taken."""
        if self._own is not None:
            self._tell(Refused(id=self._own.id, refused=why).model_dump_json())
            self._own = None

    def _stop_waiting(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _forget(self) -> None:
        self._stop_waiting()
        for guest in self._guests.values():
            guest.chosen = None

    def _say_who_chooses(self) -> None:
        """Tell everybody who has chosen, if they do not know."""
        chosen = {seat: guest.chosen is not None for seat, guest in self._guests.items()}
        said = Guests(id=PUSHED, do="guests", chosen=chosen, own=self._own is not None)
        if said != self._said:
            self._said = said
            self._tell(said.model_dump_json())
            for guest in self._guests.values():
                send_soon(guest.socket, said.model_dump_json())


class Invitations:
    """The links to seats.

    Args:
        secret: a link is made from; it stays the same as long as this does.
    """

    def __init__(self, secret: str) -> None:
        self._secret = secret.encode()
        self._open: dict[str, tuple[SharedGame, str]] = {}

    def invite(self, game: SharedGame, window: str, seat: str) -> str:
        """The code of a link to a seat of the game of a window; the same after the window was loaded again."""
        code = hmac.new(self._secret, f"{window} {seat}".encode(), "sha256").hexdigest()[:32]
        self._open[code] = game, seat
        return code

    def find(self, code: str | None) -> tuple[SharedGame, str] | None:
        """The game and the seat of a link; None where there is none."""
        return None if code is None else self._open.get(code)

    def withdraw(self, game: SharedGame) -> None:
        """Let links to a game lead nowhere."""
        self._open = {code: found for code, found in self._open.items() if found[0] is not game}
