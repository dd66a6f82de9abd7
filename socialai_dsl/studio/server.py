"""The server of the studio: one page, a websocket for the scenario and its game, one for the language server."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Final

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from socialai_dsl.studio import MOST_WINDOWS
from socialai_dsl.studio.engine import EngineLostError, start_worker
from socialai_dsl.studio.files import Folder
from socialai_dsl.studio.language import serve_editor
from socialai_dsl.studio.messages import LARGEST_MESSAGE
from socialai_dsl.studio.sharing import NO_GAME, Invitations
from socialai_dsl.studio.window import Window, Windows
from socialai_dsl.studio.worker import answer_window, serve_language
from socialai_dsl.web.connection import close
from socialai_dsl.web.pages import Address, page, static_file

LARGEST_FRAME: Final = 32 * LARGEST_MESSAGE
"""Bytes of a message that is read at all; a longer one ends its connection."""
WRONG_TOKEN: Final = 4403
NO_ROOM: Final = 4429
_OWN: Final = (
    "editor.js",
    "found.js",
    "guest.js",
    "line.js",
    "parts.js",
    "studio.css",
    "studio.js",
    "writing.js",
)


class Studio:
    """The server of one folder.

    Args:
        root: the folder. opened: the scenario that is shown first, as seen from it; empty for the first one.
        token: what a browser has to know. host: the address that is listened at. most: how many windows may be open.
    """

    def __init__(self, root: Path, opened: str, token: str, host: str, most: int = MOST_WINDOWS) -> None:
        self._folder = Folder(root)
        self._opened, self._token, self._most = opened, token, most
        self._address = Address(host)
        self._windows, self._editors, self._invitations = Windows(), 0, Invitations(token)
        self.app = Starlette(
            routes=[
                Route("/", self._page),
                Route("/static/{name}", self._static),
                WebSocketRoute("/session", self._session),
                WebSocketRoute("/language", self._language),
                Route("/guest", self._guest_page),
                WebSocketRoute("/seat", self._seat),
            ],
            lifespan=self._lifespan,
        )

    @contextlib.asynccontextmanager
    async def _lifespan(self, app: Starlette) -> AsyncIterator[None]:
        del app
        # Bytes that are no text end a connection, as websockets have it; that is no failure of the server.
        logging.getLogger("uvicorn.error").addFilter(_is_failure)
        loading = asyncio.create_task(self._load())
        yield
        await loading

    async def _load(self) -> None:
        """Load what every window's process needs before the first window waits for it."""
        with contextlib.suppress(EngineLostError):  # the first window tries again, and says why not
            await (await start_worker(answer_window, self._folder.root)).stop()

    # -- pages -----------------------------------------------------------------------------------------------

    async def _page(self, request: Request) -> Response:
        if not self._is_known(request.query_params.get("token")) or not self._address.is_own(
            request.headers.get("host")
        ):
            words = "This address lacks the token that `socialai studio` has printed; open the whole address."
            return PlainTextResponse(words, 403)
        title, root = f"studio: {self._folder.root.name}", str(self._folder.root)
        return self._filled("studio.js", title, root, self._opened)

    async def _guest_page(self, request: Request) -> Response:
        """The page of a person who was invited to a seat; whether the link is good its connection is told."""
        if not self._address.is_own(request.headers.get("host")):
            return PlainTextResponse("This is not the address of the studio.", 403)
        return self._filled("guest.js", "a game for several")

    @staticmethod
    def _filled(script: str, title: str, root: str = "", opened: str = "") -> Response:
        """The page with one of our scripts."""
        words = "The studio needs scripts."
        return page(script, "studio.css", title, words, root=root, open=opened)

    async def _static(self, request: Request) -> Response:
        return static_file(request.path_params["name"], _OWN, Path(__file__).parent / "static")

    # -- websockets ------------------------------------------------------------------------------------------

    async def _session(self, socket: WebSocket) -> None:
        if await self._welcome(socket) and await self._has_room(socket, len(self._windows.names)):
            await Window(socket, self._folder, self._windows, self._invitations).serve()

    async def _language(self, socket: WebSocket) -> None:
        if not await self._welcome(socket) or not await self._has_room(socket, self._editors):
            return
        self._editors += 1
        try:
            worker = await start_worker(serve_language, self._folder.root)
            try:
                await serve_editor(socket, worker, self._folder)
            finally:
                await worker.stop()
        except EngineLostError as lost:
            await close(socket, 1011, str(lost))
        finally:
            self._editors -= 1

    async def _seat(self, socket: WebSocket) -> None:
        """Let a person who has the link to it have a seat of a window's game."""
        if not await self._comes_from_us(socket):
            return
        found = self._invitations.find(socket.query_params.get("code"))
        if found is None:
            words = "this game is not open now; the page goes on when it is, or ask for another link"
            await close(socket, NO_GAME, words)
            return
        game, seat = found
        await game.seat(socket, seat)

    async def _welcome(self, socket: WebSocket) -> bool:
        """Accept a window that knows the token and comes from our own page.

        A page from elsewhere hears nothing; ours, which tries again after the server was started anew, hears why not.
        """
        if not await self._comes_from_us(socket):
            return False
        if not self._is_known(socket.query_params.get("token")):
            await close(
                socket, WRONG_TOKEN, "another studio answers here now; open the address that it has printed"
            )
            return False
        return True

    async def _comes_from_us(self, socket: WebSocket) -> bool:
        """Accept a connection from our own page."""
        if not self._address.comes_from_us(socket.headers.get("host"), socket.headers.get("origin")):
            await close(socket, 1008)
            return False
        await socket.accept()
        return True

    async def _has_room(self, socket: WebSocket, opened: int) -> bool:
        """Whether one more window may open; it is told why not."""
        if opened < self._most:
            return True
        words = f"as many windows are open as may be ({self._most}); close one, or start the studio with more --windows"
        await close(socket, NO_ROOM, words)
        return False

    def _is_known(self, token: str | None) -> bool:
        return token is not None and secrets.compare_digest(token.encode(), self._token.encode())


def _is_failure(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError))
