"""A connected window: its messages are read as they come, and answered by its files, its game and its checks."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from socialai_dsl.studio import messages
from socialai_dsl.studio.drafts import new_window
from socialai_dsl.studio.engine import Engine, EngineLostError
from socialai_dsl.studio.files import ConflictError, FileError, Folder
from socialai_dsl.studio.filing import Filing
from socialai_dsl.studio.messages import WINDOW_QUESTIONS, Refused, parsed

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
    """

    def __init__(self, socket: WebSocket, folder: Folder, windows: Windows) -> None:
        self._socket, self._folder, self._windows = socket, folder, windows
        self._name = windows.enter()
        self._game, self._checks = Engine(folder.root), Engine(folder.root)
        # Files, the game and checks do not wait for each other; within each, answers come in the order of questions.
        self._files, self._plays, self._claims = (_Lane(_MOST_WAITING) for _ in range(3))

    async def serve(self) -> None:
        """Answer until the window is closed; then nothing of it is left but its drafts."""
        filing = asyncio.create_task(self._work(self._files, self._ask_files))
        others = [
            asyncio.create_task(self._work(self._plays, self._game.ask)),
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
            await self._game.stop()
            await self._checks.stop()
            await self._files.put(None)
            await filing
            self._windows.leave(self._name)

    async def _take(self, content: str | bytes) -> None:
        """Put a message into its lane, or say at once why it has none."""
        if isinstance(content, bytes):
            await self._send(_refusal(None, "got a binary message, expected JSON as text"))
            return
        asked = parsed(WINDOW_QUESTIONS, content)
        if isinstance(asked, Refused):
            await self._send(asked.model_dump_json())
            return
        if isinstance(asked, messages.FileQuestion):
            lane = self._files
        else:
            lane = self._claims if isinstance(asked, messages.Check | messages.Test) else self._plays
        try:
            lane.put_nowait(asked)
        except asyncio.QueueFull:
            await self._send(_refusal(asked.id, f"{_MOST_WAITING} questions wait already for their answers"))

    async def _work(self, lane: _Lane, ask: Callable[[Any], Awaitable[str]]) -> None:
        """Answer the questions of a lane until None comes; no question ends it."""
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
            await self._send(answer)

    async def _ask_files(self, asked: Any) -> str:
        if isinstance(asked, messages.Hello):
            if asked.window is not None:
                self._name = await self._windows.rename(self._name, asked.window)
            reply = {"window": self._name}
        else:
            filing = Filing(self._folder, self._name, self._windows.names)
            reply = await asyncio.to_thread(filing.answer, asked)
        return json.dumps({"id": asked.id, "do": asked.do, **reply})

    async def _send(self, text: str) -> None:
        with suppress(RuntimeError, WebSocketDisconnect):  # it was closed, which its reader is told as well
            await self._socket.send_text(text)


async def contents(socket: WebSocket) -> AsyncIterator[str | bytes]:
    """What comes over a connection until it is closed."""
    while (message := await socket.receive())["type"] == "websocket.receive":
        text = message.get("text")
        yield text if text is not None else message.get("bytes") or b""


async def close(socket: WebSocket, code: int, why: str | None = None) -> None:
    """Close a connection, if the other side has not."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close(code, why)


def _refusal(number: int | None, why: str, *, conflict: bool = False, lost: bool = False) -> str:
    return Refused(id=number, refused=why, conflict=conflict, lost=lost).model_dump_json()
