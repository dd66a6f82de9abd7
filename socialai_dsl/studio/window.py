"""A connected window: its messages are read as they come, and answered by its files, its game and its checks."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable
from typing import Any, Final

from starlette.websockets import WebSocket

from socialai_dsl.studio import messages
from socialai_dsl.studio.drafts import new_window
from socialai_dsl.studio.engine import Engine, EngineLostError
from socialai_dsl.studio.files import ConflictError, FileError, Folder
from socialai_dsl.studio.filing import Filing
from socialai_dsl.studio.messages import WINDOW_QUESTIONS, Refused, parsed
from socialai_dsl.studio.sharing import Invitations, SharedGame
from socialai_dsl.web.connection import contents, send, send_soon

_CLAIM_SECONDS: Final = 1.0
_MOST_WAITING: Final = 200
_log: Final = logging.getLogger(__name__)

_Lane = asyncio.Queue[Any]


class Windows:
    """The windows that are open, by name."""

    def __init__(self) -> None:
        self._gone: dict[str, asyncio.Event] = {}

    @property
    def names(self) -> frozenset[str]:
        """The windows that are open."""
        return frozenset(self._gone)

    def enter(self) -> str:
        """Add a window; its name."""
        name = new_window()
        self._gone[name] = asyncio.Event()
        return name

    def leave(self, name: str) -> None:
        """Remove a window."""
        self._gone.pop(name).set()

    async def rename(self, name: str, wanted: str) -> str:
        """The name that a window had before it was loaded again; its present one if another window has that name.

        That may be its own former connection, which then ends any moment.
        """
        if wanted in self._gone and wanted != name:
            try:
                await asyncio.wait_for(self._gone[wanted].wait(), _CLAIM_SECONDS)
            except TimeoutError:
                return name
        if wanted in self._gone:
            return name
        self._gone[wanted] = self._gone.pop(name)
        return wanted


class Window:
    """A window, from its first message until it is closed.

    Args:
        socket: the connection, accepted.
        folder: its files.
        windows: all windows.
        invitations: to seats of their games.
    """

    def __init__(self, socket: WebSocket, folder: Folder, windows: Windows, invitations: Invitations) -> None:
        self._socket, self._folder, self._windows, self._invitations = socket, folder, windows, invitations
        self._name = windows.enter()
        self._game, self._checks = Engine(folder.root), Engine(folder.root)
        # Files, the game and checks do not wait for each other; within each, answers come in the order of questions.
        self._files, self._plays, self._claims = (_Lane(_MOST_WAITING) for _ in range(3))
        self._shared = SharedGame(self._game, self._put, lambda said: send_soon(socket, said))

    async def serve(self) -> None:
        """Answer until the window is closed; then nothing of it is left but its drafts."""
        filing = asyncio.create_task(self._work(self._files, self._ask_files))
        others = [
            asyncio.create_task(self._work(self._plays, self._game.ask, self._shared.changed)),
            asyncio.create_task(self._work(self._claims, self._checks.ask)),
        ]
        try:
            async for content in contents(self._socket):
                await self._take(content)
        finally:
            # What was typed last is still kept; nobody waits for the rest.
            for task in others:
                task.cancel()
            await asyncio.gather(*others, return_exceptions=True)
            self._invitations.withdraw(self._shared)
            await self._shared.end()
            await self._game.stop()
            await self._checks.stop()
            await self._files.put(None)
            await filing
            self._windows.leave(self._name)

    async def _take(self, content: str | bytes) -> None:
        """Put a message into its lane, or say at once why it has none."""
        if isinstance(content, bytes):
            await send(self._socket, _refusal(None, "got a binary message, expected JSON as text"))
            return
        asked = parsed(WINDOW_QUESTIONS, content)
        if isinstance(asked, Refused):
            await send(self._socket, asked.model_dump_json())
            return
        if isinstance(asked, messages.FileQuestion) or not self._shared.holds_back(asked):
            self._put(asked)

    def _put(self, asked: Any) -> None:
        """Put a question into its lane."""
        if isinstance(asked, messages.FileQuestion):
            lane = self._files
        else:
            lane = self._claims if isinstance(asked, messages.Check | messages.Test) else self._plays
        try:
            lane.put_nowait(asked)
        except asyncio.QueueFull:
            why = f"{_MOST_WAITING} questions wait already for their answers"
            send_soon(self._socket, _refusal(asked.id, why))

    async def _work(
        self,
        lane: _Lane,
        ask: Callable[[Any], Awaitable[str]],
        after: Callable[[Any], Awaitable[None]] | None = None,
    ) -> None:
        """Answer the questions of a lane until None comes; no question ends it. What comes `after` each is told it."""
        while (asked := await lane.get()) is not None:
            try:
                answer = await ask(asked)
            except ConflictError as conflict:
                answer = _refusal(asked.id, str(conflict), conflict=True)
            except EngineLostError as lost:
                answer = _refusal(asked.id, str(lost), lost=True)
            except FileError as error:
                answer = _refusal(asked.id, str(error))
            except Exception as error:
                _log.exception("the studio has failed")
                said = f"the studio has failed; please report it: {type(error).__name__}: {error}"
                answer = _refusal(asked.id, said)
            await send(self._socket, answer)
            if after is not None:
                await after(asked)

    async def _ask_files(self, asked: Any) -> str:
        if isinstance(asked, messages.Hello):
            if asked.window is not None:
                self._name = await self._windows.rename(self._name, asked.window)
            reply = {"window": self._name}
        elif isinstance(asked, messages.Invite):
            self._shared.seconds = asked.seconds
            reply = {"code": self._invitations.invite(self._shared, self._name, asked.seat)}
        else:
            filing = Filing(self._folder, self._name, self._windows.names)
            reply = await asyncio.to_thread(filing.answer, asked)
        return json.dumps({"id": asked.id, "do": asked.do, **reply})


def _refusal(number: int | None, why: str, *, conflict: bool = False, lost: bool = False) -> str:
    return Refused(id=number, refused=why, conflict=conflict, lost=lost).model_dump_json()
