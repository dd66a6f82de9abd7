"""The server of the studio: one page, a websocket for the scenario and its game, one for the language server."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
from collections.abc import AsyncIterator, Callable
from html import escape
from pathlib import Path
from typing import Any, Final

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from socialai_dsl.authoring.templates import TEMPLATES, template_files
from socialai_dsl.loader.shipped import file_of, shipped_scenarios, variants_of
from socialai_dsl.replay.scripts import static_text
from socialai_dsl.studio.engine import Engine, EngineLostError, start_worker
from socialai_dsl.studio.files import ConflictError, FileError, Folder
from socialai_dsl.studio.session import ASKED
from socialai_dsl.studio.worker import answer_window, serve_language
from trainer.shipped import PREFIX, shipped_agents

LARGEST_MESSAGE: Final = 2 << 20
_PLAYERS: Final = (None, "me", "script", "random")
_CHECK_SECONDS: Final = 90.0
_LOADING_SECONDS: Final = 60.0
_USUAL_SECONDS: Final = 10.0
_OWN: Final = ("studio.js", "studio.css", "editor.js")
_SHARED: Final = ("dom.js", "panels.js", "room.js", "tiles.js", "trace.js", "pages.css")
_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="style-nonce" content="{nonce}">
<title>{title}</title>
<link rel="stylesheet" href="/static/pages.css">
<link rel="stylesheet" href="/static/studio.css">
<link rel="icon" href="data:,">
</head>
<body data-root="{root}" data-open="{opened}">
<noscript>The studio needs scripts.</noscript>
<script type="module" src="/static/studio.js"></script>
</body>
</html>
"""


class Studio:
    """The server of one folder.

    Args:
        root: the folder. opened: the scenario that is shown first, as seen from it; empty for the first one.
        token: what a browser has to know. host: the address that is listened at.
    """

    def __init__(self, root: Path, opened: str, token: str, host: str) -> None:
        self._folder = Folder(root)
        self._opened, self._token, self._host = opened, token, host
        self.app = Starlette(
            routes=[
                Route("/", self._page),
                Route("/static/{name}", self._static),
                WebSocketRoute("/session", self._session),
                WebSocketRoute("/language", self._language),
            ],
            lifespan=self._lifespan,
        )

    @contextlib.asynccontextmanager
    async def _lifespan(self, app: Starlette) -> AsyncIterator[None]:
        del app
        loading = asyncio.create_task(self._load())
        yield
        await loading

    async def _load(self) -> None:
        """Load what every window's process needs before the first window waits for it."""
        with contextlib.suppress(EngineLostError):  # the first window tries again, and says why not
            await (await start_worker(answer_window, self._folder.root)).stop()

    # -- pages -----------------------------------------------------------------------------------------------

    async def _page(self, request: Request) -> Response:
        if not self._is_known(request.query_params.get("token")) or not self._is_own_host(
            request.headers.get("host")
        ):
            words = "This address lacks the token that `socialai studio` has printed; open the whole address."
            return PlainTextResponse(words, 403)
        nonce = secrets.token_urlsafe(16)
        page = _PAGE.format(
            nonce=nonce,
            title=escape(f"studio: {self._folder.root.name}"),
            root=escape(str(self._folder.root)),
            opened=escape(self._opened),
        )
        return self._guarded(HTMLResponse(page), nonce)

    async def _static(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name in _SHARED:
            text = static_text(name)
        elif name in _OWN:
            text = (Path(__file__).parent / "static" / name).read_text(encoding="utf-8")
        else:
            return PlainTextResponse("there is no such file", 404)
        kind = "text/css" if name.endswith(".css") else "text/javascript"
        return self._guarded(Response(text, media_type=kind), "")

    @staticmethod
    def _guarded(response: Response, nonce: str) -> Response:
        response.headers.update(
            {
                "Content-Security-Policy": "default-src 'none'; script-src 'self'; connect-src 'self'; "
                f"img-src 'self' data:; style-src 'self' 'nonce-{nonce}'; "
                "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                "Referrer-Policy": "no-referrer",
                "X-Content-Type-Options": "nosniff",
                "Cache-Control": "no-store",
            }
        )
        return response

    # -- websockets ------------------------------------------------------------------------------------------

    async def _session(self, socket: WebSocket) -> None:
        if not await self._welcome(socket):
            return
        # A check has a process of its own, so that playing goes on.
        engine, checking = Engine(self._folder.root), Engine(self._folder.root)
        try:
            while True:
                text = await socket.receive_text()
                try:
                    asked = json.loads(text)
                    number, name = asked.pop("id"), str(asked.get("do"))
                except (ValueError, KeyError, AttributeError, RecursionError):
                    await socket.close(1003, "expected a JSON object with `id` and `do`")
                    return
                answered = self._answer(checking if name == "check" else engine, name, asked)
                if name == "check":
                    task = asyncio.create_task(self._send(socket, number, answered))
                    task.add_done_callback(lambda done: done.cancelled() or done.exception())
                else:
                    await self._send(socket, number, answered)
        except (WebSocketDisconnect, RuntimeError):  # the window was closed
            pass
        finally:
            await engine.stop()
            await checking.stop()

    @staticmethod
    async def _send(socket: WebSocket, number: Any, answered: Any) -> None:
        await socket.send_text(json.dumps({"id": number, **(await answered)}))

    async def _answer(self, engine: Engine, name: str, asked: dict[str, Any]) -> dict[str, Any]:
        """What a window is told."""
        try:
            if name in ASKED:
                self._place(asked)
                loads = asked.get("player") not in _PLAYERS
                seconds = _CHECK_SECONDS if name == "check" else _LOADING_SECONDS if loads else _USUAL_SECONDS
                return await engine.ask(asked, seconds)
            found = _FILES.get(name)
            if found is None:
                return {"refused": f"got {name!r}, which nobody can be asked for"}
            asked.pop("do")
            return await asyncio.to_thread(found, self._folder, **asked)
        except ConflictError as conflict:
            return {"refused": str(conflict), "conflict": True}
        except EngineLostError as lost:
            return {"refused": str(lost), "lost": True}
        except FileError as error:
            return {"refused": str(error)}
        except TypeError:
            return {"refused": f"got {name!r} with other things than it needs"}

    def _place(self, asked: dict[str, Any]) -> None:
        """Put whole paths where a window names files of the folder."""
        if "path" in asked:
            asked["path"] = str(self._folder.path(str(asked["path"])))
        player = asked.get("player")
        if player not in (*_PLAYERS, *_shipped_players()):
            if player not in self._folder.runs():
                raise FileError(f"{player}: there is no such run in the folder")
            asked["player"] = str(self._folder.root / player)

    async def _language(self, socket: WebSocket) -> None:
        """Hand the messages of an editor to a language server and back."""
        if not await self._welcome(socket):
            return
        try:
            worker = await start_worker(serve_language, self._folder.root)
        except EngineLostError as lost:
            await socket.close(1011, str(lost))
            return
        back = asyncio.create_task(_relay(worker.reader, socket))
        try:
            while True:
                content = (await socket.receive_text()).encode()
                worker.writer.write(b"Content-Length: %d\r\n\r\n%s" % (len(content), content))
                await worker.writer.drain()
        except (WebSocketDisconnect, RuntimeError, OSError):
            pass
        finally:
            back.cancel()
            await worker.stop()

    async def _welcome(self, socket: WebSocket) -> bool:
        """Accept a window that knows the token and comes from our own page."""
        host, origin = socket.headers.get("host"), socket.headers.get("origin")
        known = self._is_known(socket.query_params.get("token"))
        if not known or not self._is_own_host(host) or origin != f"http://{host}":
            await socket.close(1008)
            return False
        await socket.accept()
        return True

    def _is_known(self, token: str | None) -> bool:
        return token is not None and secrets.compare_digest(token.encode(), self._token.encode())

    def _is_own_host(self, host: str | None) -> bool:
        """Whether the page was asked for under our own address, not under a name that leads here."""
        name = (host or "").rpartition(":")[0]
        return self._host not in ("127.0.0.1", "::1") or name in ("127.0.0.1", "localhost", "[::1]")


async def _relay(stream: asyncio.StreamReader, socket: WebSocket) -> None:
    """Hand on what a language server says."""
    with contextlib.suppress(asyncio.IncompleteReadError, RuntimeError, WebSocketDisconnect):
        while True:
            head = await stream.readuntil(b"\r\n\r\n")
            lines = [line.partition(b":") for line in head.lower().split(b"\r\n")]
            length = next(int(value) for name, _, value in lines if name == b"content-length")
            await socket.send_text((await stream.readexactly(length)).decode())


# -- files ------------------------------------------------------------------------------------------------------------


def _shipped_players() -> list[str]:
    """The trained agents that ship, as `Session.begin` knows them."""
    return [PREFIX + name for name in shipped_agents()]


def _list(folder: Folder) -> dict[str, Any]:
    return {
        "files": folder.scenarios(),
        "runs": [*folder.runs(), *_shipped_players()],
        "shipped": shipped_scenarios(),
        "templates": TEMPLATES,
    }


def _read(folder: Folder, name: str) -> dict[str, Any]:
    text, known = folder.read(name)
    draft = folder.draft(name)
    return {"text": text, "digest": known, "draft": draft if draft != text else None}


def _save(folder: Folder, name: str, text: str, digest: str | None) -> dict[str, Any]:
    return {"digest": folder.write(name, text, digest)}


def _draft(folder: Folder, name: str, text: str | None) -> dict[str, Any]:
    if text is None:
        folder.forget_draft(name)
    else:
        folder.keep_draft(name, text)
    return {}


def _copy(folder: Folder, shipped: str) -> dict[str, Any]:
    """Copy a shipped scenario with its script into the folder."""
    if shipped not in shipped_scenarios():
        raise FileError(f"{shipped!r}: there is no such shipped scenario")
    name = folder.create(f"{shipped}.yaml", file_of(shipped).read_text(encoding="utf-8"))
    if "oracle" in variants_of(shipped):
        script = file_of(shipped, "oracle")
        stem = name.removesuffix(".yaml")
        if script.stem != "oracle":
            text = script.read_text(encoding="utf-8")
            folder.create(f"{stem}_oracle.yaml", text.replace(f"of: {shipped}\n", f"of: {stem}\n"))
    return {"name": name}


def _create(folder: Folder, template: str, called: str) -> dict[str, Any]:
    """Write the files of a template under a name."""
    if template not in TEMPLATES or not called.isidentifier():
        raise FileError(f"{called!r}: expected a word as a name, and one of {', '.join(TEMPLATES)}")
    files = template_files(template, called)
    taken = [path.name for path in files if (folder.root / path).exists()]
    if taken:
        raise FileError(f"{taken[0]} exists already")
    names = [folder.create(path.name, text) for path, text in files.items()]
    return {"name": names[0]}


def _add(folder: Folder, name: str, text: str) -> dict[str, Any]:
    return {"name": folder.create(name, text)}


_FILES: Final[dict[str, Callable[..., dict[str, Any]]]] = {
    "list": _list,
    "read": _read,
    "save": _save,
    "draft": _draft,
    "copy": _copy,
    "create": _create,
    "add": _add,
}
"""What a window may ask about files."""
