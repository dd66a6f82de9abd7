"""The server of a study: a secret link for each participant, one page, and a websocket on which the server decides."""

from __future__ import annotations

import asyncio
import contextlib
import csv
import hmac
import io
import json
import logging
import os
import re
import secrets
import time
from collections.abc import AsyncIterator, Callable, Collection
from pathlib import Path
from typing import Any, Final, NamedTuple

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from socialai_dsl.atomic import write_text
from socialai_dsl.checking.studies import PICTURES, LoadedStudy
from socialai_dsl.errors import UsageError
from socialai_dsl.study.live import Live
from socialai_dsl.study.messages import joining
from socialai_dsl.study.words import words_of
from socialai_dsl.web.connection import close, contents, send
from socialai_dsl.web.pages import Address, guarded, page, static_file

KEY: Final = "key"
RECRUITED: Final = "recruited.csv"
UNKNOWN: Final = 4404
REFUSED: Final = 4403
_KEY_BYTES: Final = 32
_TICK: Final = 0.25
_MOST_JOINING: Final = 200
"""How many may join at once; after that as many in a second."""
_MOST_SECONDS: Final = 20
"""In which a page of somebody else has to say for whom it takes part."""
_MOST_WAITING: Final = 64
"""Screens that wait to be sent to a page; one that reads none of so many is closed."""
_OWN: Final = ("connection.js", "old.js", "screen.js", "study.css", "study.js")


class _Refusal(NamedTuple):
    """Why somebody may not take part: the name of the text that says it, and the status."""

    word: str
    status: int


class StudyServer:
    """The server of a study.

    Args:
        loaded: the study. folder: holds everything that is stored. host: the address that is listened at.
        public: what a proxy is asked for, such as `https://study.example.org`.
        embed: origins of pages of other servers that may let people take part, such as `https://lab.example.org`.
        clock: seconds that never go back, by which others are waited for.
        simulated: whether those who take part are simulated.

    Attributes:
        live: the study as it goes on.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it holds another study, see `Live`.
    """

    def __init__(
        self,
        loaded: LoadedStudy,
        folder: Path,
        host: str,
        public: str | None = None,
        embed: Collection[str] = (),
        clock: Callable[[], float] = time.monotonic,
        simulated: bool = False,
    ) -> None:
        self._loaded, self._folder = loaded, folder
        self._words = words_of(loaded.study.language)
        self._address = Address(host, public, embed)
        self.live = Live(loaded, folder, clock, simulated)
        self._key = _key(folder / KEY)
        self._recruited = _recruited(folder / RECRUITED)
        self._codes = {self.code(person): person for person in self.live.progress.people}
        self._joining = asyncio.Lock()  # so that nobody who comes twice at once gets two links
        self._may_join = float(_MOST_JOINING)
        self.app = Starlette(
            routes=[
                Route("/", self._front),
                Route("/join", self._join),
                Route("/p/{code}", self._page),
                Route("/static/{name}", self._static),
                Route("/picture/{number:int}", self._picture),
                WebSocketRoute("/seat/{code}", self._seat),
                WebSocketRoute("/embed", self._embedded),
            ],
            lifespan=self._lifespan,
        )

    def code(self, person: str) -> str:
        """The secret of a participant's link."""
        return hmac.new(self._key, person.encode(), "sha256").hexdigest()[:40]

    def person(self, code: str) -> str:
        """The participant whose link has this secret."""
        return self._codes[code]

    async def invite(self) -> str:
        """The path of the link of a new participant. Raises OSError where that cannot be stored."""
        return f"/p/{await self._joined()}"

    async def _joined(self) -> str:
        """The secret of a new participant. Raises OSError where that cannot be stored."""
        person = await self.live.join()
        code = self.code(person)
        self._codes[code] = person
        return code

    @contextlib.asynccontextmanager
    async def _lifespan(self, app: Starlette) -> AsyncIterator[None]:
        del app
        logging.getLogger("uvicorn.error").addFilter(_is_failure)
        for arena in self.live.arenas.values():
            arena.warm(8)
        ticking = asyncio.create_task(self._tick())
        yield
        ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await ticking
        await self.live.close()

    async def _tick(self) -> None:
        while True:
            await asyncio.sleep(_TICK)
            self._may_join = min(_MOST_JOINING, self._may_join + _MOST_JOINING * _TICK)
            await self.live.tick()

    # -- pages -----------------------------------------------------------------------------------------------

    async def _front(self, request: Request) -> Response:
        return self._said("unknown", 404) if self._is_ours(request) else _refused()

    async def _join(self, request: Request) -> Response:
        """Give whoever comes a link of their own, and whoever comes again from a platform the one they have."""
        if not self._is_ours(request):
            return _refused()
        if request.method == "HEAD":  # asks whether there is something, and does not come
            return guarded(Response())
        given = request.query_params.get(self._loaded.study.recruit.id, "")[:200]
        found = await self._admitted(given)
        return self._said(*found) if isinstance(found, _Refusal) else _to(f"/p/{found}")

    async def _admitted(self, given: str) -> str | _Refusal:
        """The secret of whoever comes by an id: the one they have, or that of a new participant."""
        async with self._joining:
            known = self._recruited.get(given) if given else None
            if known is not None:
                if self._loaded.study.recruit.on_return == "refuse":
                    return _Refusal("again", 403)
                return self.code(known)
            if self.live.full():
                return _Refusal("full", 403)
            if self._may_join < 1:
                return _Refusal("fast", 429)
            self._may_join -= 1
            try:
                code = await self._joined()
                if given:
                    self._remember(given, self._codes[code])
            except OSError:
                return _Refusal("full_disk", 507)
            return code

    def _remember(self, given: str, person: str) -> None:
        """Keep a platform's id, apart from the data. Raises OSError where that cannot be stored."""
        row = io.StringIO()
        csv.writer(row).writerow((person, given))
        with open(self._folder / RECRUITED, "ab", opener=_private) as file:
            whole = file.tell()
            try:
                file.write(row.getvalue().encode())
                file.flush()
                os.fsync(file.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(whole)  # a part of a row would spoil the next one
                raise
        self._recruited[given] = person

    async def _page(self, request: Request) -> Response:
        if not self._is_ours(request):
            return _refused()
        if request.path_params["code"] not in self._codes:
            return self._said("unknown", 404)
        words = self._words
        return page(
            "study.js",
            "study.css",
            words["title"],
            words["script"],
            self._loaded.study.language,
            older="old.js",
            words=json.dumps(words, ensure_ascii=False),
        )

    async def _static(self, request: Request) -> Response:
        return static_file(request.path_params["name"], _OWN, Path(__file__).parent / "static")

    async def _picture(self, request: Request) -> Response:
        number, shown = request.path_params["number"], list(self._loaded.pictures.values())
        if not self._is_ours(request) or number >= len(shown):
            return PlainTextResponse("there is no such picture", 404)
        return guarded(FileResponse(shown[number], media_type=PICTURES[shown[number].suffix.lower()]))

    def _said(self, word: str, status: int) -> Response:
        return guarded(PlainTextResponse(self._words[word], status))

    def _is_ours(self, request: Request) -> bool:
        return self._address.is_own(request.headers.get("host"))

    # -- websockets ------------------------------------------------------------------------------------------

    async def _seat(self, socket: WebSocket) -> None:
        """Let a participant's page take part until the connection ends."""
        if not self._address.comes_from_us(socket.headers.get("host"), socket.headers.get("origin")):
            await close(socket, 1008)
            return
        await socket.accept()
        person = self._codes.get(socket.path_params["code"])
        if person is None:
            await close(socket, UNKNOWN)
            return
        await self._take_part(socket, person)

    async def _embedded(self, socket: WebSocket) -> None:
        """Let a page of somebody else let a participant take part, until the connection ends."""
        if not self._address.is_own(socket.headers.get("host")):
            await close(socket, 1008)
            return
        await socket.accept()
        origin = socket.headers.get("origin")
        if origin is None or not self._address.admits(origin):
            await self._refuse(socket, "origin", origin=origin or "null")
            return
        try:
            async with asyncio.timeout(_MOST_SECONDS):
                message = joining(await anext(contents(socket), ""))
        except TimeoutError:
            message = None
        if message is None:
            await self._refuse(socket, "consent")
            return
        code = message.code or await self._admitted(message.id or "")
        if isinstance(code, str):
            if code not in self._codes:
                code = _Refusal("forgotten", 404)
            elif not self.live.agree(self._codes[code], origin, message.simulated):
                code = _Refusal("full", 403)
        if isinstance(code, _Refusal):
            await self._refuse(socket, code.word)
            return
        person = self._codes[code]
        joined = {
            "do": "joined",
            "code": code,
            "language": self._loaded.study.language,
            "words": self._words,
            "done": self.live.progress.gone_on_from(self.live.progress.people[person]),
        }
        await self._take_part(socket, person, joined)

    async def _refuse(self, socket: WebSocket, word: str, **values: str) -> None:
        """Say why a page may not let anybody take part, and close."""
        await send(
            socket, json.dumps({"do": "refused", "why": word, "say": self._words[word].format(**values)})
        )
        await close(socket, REFUSED)

    async def _take_part(self, socket: WebSocket, person: str, first: dict[str, Any] | None = None) -> None:
        """Let a participant take part until the connection ends.

        Args:
            socket: to their page.
            person: who it is.
            first: what a page of somebody else is told before everything else; None for our own page.
        """
        screens: asyncio.Queue[str] = asyncio.Queue()
        closing: set[asyncio.Task[None]] = set()

        def leave(code: int, why: str) -> None:
            closing.add(asyncio.get_running_loop().create_task(close(socket, code, why)))

        def show(screen: dict[str, Any]) -> None:
            if screens.qsize() >= _MOST_WAITING:
                leave(1008, "")
                return
            screens.put_nowait(json.dumps(screen, ensure_ascii=False, separators=(",", ":")))

        async def write() -> None:
            while True:
                await send(socket, await screens.get())

        writing = asyncio.create_task(write())
        if first is not None:
            show(first)
        own = await self.live.come(person, show, leave, elsewhere=first is not None)
        try:
            async for content in contents(socket):
                await self.live.hear(own, content)
        finally:
            writing.cancel()
            self.live.go(own)


def _to(path: str) -> Response:
    return guarded(RedirectResponse(path, 303))


def _refused() -> Response:
    return guarded(PlainTextResponse("This is not the address of the study.", 403))


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)


def _key(file: Path) -> bytes:
    """The secret that links are made from, the same as long as the folder is there.

    Raises:
        OSError: it cannot be read or written.
        UsageError: it is damaged.
    """
    with contextlib.suppress(FileNotFoundError):
        written = file.read_text(encoding="ascii").strip()
        if re.fullmatch(rf"[0-9a-f]{{{2 * _KEY_BYTES}}}", written):
            return bytes.fromhex(written)
        if written:
            raise UsageError(f"{file}: got something else, expected the {2 * _KEY_BYTES} digits of a secret")
    # There is none, or its disk was full when it was to be written, before any link was made.
    made = secrets.token_bytes(_KEY_BYTES)
    os.close(os.open(file, os.O_WRONLY | os.O_CREAT, 0o600))
    write_text(file, made.hex() + "\n")  # which keeps these permissions
    return made


def _recruited(file: Path) -> dict[str, str]:
    """Platforms' ids -> participants. A row that was cut off, whose participant got no link, is taken out."""
    if not file.exists():
        return {}
    content = file.read_bytes()
    whole = content.rfind(b"\n") + 1
    if whole < len(content):
        os.truncate(file, whole)
    rows = csv.reader(io.StringIO(content[:whole].decode(), newline=""))
    return {row[1]: row[0] for row in rows if len(row) == 2}


def _is_failure(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError))
