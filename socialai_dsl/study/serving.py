"""Serves a study until it is ended."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import uvicorn

from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.runs.lock import HeldError, hold
from socialai_dsl.study.messages import LARGEST
from socialai_dsl.study.server import StudyServer
from socialai_dsl.web.pages import origin_of

_WRITER: Final = "server"


def serve(
    loaded: LoadedStudy,
    folder: Path,
    host: str,
    port: int,
    public: str | None,
    embed: Collection[str],
    links: int,
    say: Callable[[str], None],
) -> None:
    """Serve a study until Ctrl-C; what a folder holds already is gone on with.

    Args:
        loaded: the study.
        folder: for all that is stored; it is made.
        host: the address to listen at.
        port: likewise; 0 takes a free one.
        public: the address that a proxy serves.
        embed: origins of pages of other servers that may let people take part.
        links: how many new participants are told their links.
        say: takes lines for whoever runs the study.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it holds another study, another process serves it, or nothing can listen there.
    """
    if public is not None and (
        urlsplit(public).scheme not in ("http", "https") or not urlsplit(public).netloc
    ):
        raise OptionError("public", f"got {public!r}, expected an address such as https://study.example.org")
    origins = [_origin(address, loaded) for address in embed]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with hold(folder, _WRITER):
            listening = _listen(host, port)
            server = StudyServer(loaded, folder, host, public, origins)
            shown = f"[{host}]" if ":" in host else "127.0.0.1" if host == "0.0.0.0" else host
            address = (public or f"http://{shown}:{listening.getsockname()[1]}").rstrip("/")
            say(f"study {loaded.study.study}: {address}/join\nall that is stored: {folder}")
            for origin in origins:
                say(f"pages of {origin} may let people take part")
            say("Ctrl-C ends it, and the same command goes on")
            with contextlib.suppress(KeyboardInterrupt):
                asyncio.run(_served(server, listening, address, links, say))
    except HeldError as error:
        raise UsageError(str(error)) from None


def _origin(address: str, loaded: LoadedStudy) -> str:
    """The origin of pages that may let people take part in a study. Raises OptionError."""
    origin, study = origin_of(address), loaded.study
    if origin is None:
        raise OptionError(
            "embed", f"got {address!r}, expected the origin of a page, such as https://lab.example.org"
        )
    own = [f"`{key}`" for key in ("instructions", "questions") if getattr(study, key)]
    own += ["`questions` of blocks"] if any(block.questions for block in study.blocks) else []
    if own:
        raise OptionError(
            "embed",
            f"{study.study} has {' and '.join(own)}, which a page that embeds a study shows itself; take them out",
        )
    return origin


async def _served(
    server: StudyServer, listening: socket.socket, address: str, links: int, say: Callable[[str], None]
) -> None:
    for _ in range(links):
        say(f"{address}{await server.invite()}")
    await uvicorn.Server(config_of(server)).serve(sockets=[listening])


def config_of(server: StudyServer) -> uvicorn.Config:
    """How the server is run: no addresses are logged, and messages and open connections are bounded."""
    return uvicorn.Config(
        server.app,
        log_level="error",
        access_log=False,
        ws="websockets-sansio",
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,
        ws_ping_interval=20,
        ws_ping_timeout=20,
        timeout_graceful_shutdown=2,
    )


def _listen(host: str, port: int) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        return socket.create_server((host, port), family=family, backlog=1024)
    except OSError as error:
        raise OptionError("port", f"{host}:{port}: {error.strerror or error}") from None
