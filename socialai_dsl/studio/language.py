"""Between an editor and its language server: JSON-RPC messages, checked, about files of the opened folder alone."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import Annotated, Any, Final, Literal
from urllib.parse import unquote, urlsplit

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, TypeAdapter, ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect

from socialai_dsl.studio.engine import Worker
from socialai_dsl.studio.files import FileError, Folder
from socialai_dsl.studio.messages import LARGEST_MESSAGE, problem
from socialai_dsl.web.connection import close, contents

_MOST_WAITING: Final = 1000
_NO_REQUEST: Final = -32600
_Number = int | str


class _Rpc(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    jsonrpc: Literal["2.0"]


class _Call(_Rpc):
    """A request, or without a number a notification."""

    id: _Number | None = None
    method: str
    params: dict[str, Any] | None = None


class _Result(_Rpc):
    """What the editor answers to a request of the server."""

    id: _Number
    result: Any = None
    error: dict[str, Any] | None = None


def _kind(message: Any) -> str:
    return "call" if isinstance(message, dict) and "method" in message else "result"


_MESSAGES: Final[TypeAdapter[Any]] = TypeAdapter(
    Annotated[Annotated[_Call, Tag("call")] | Annotated[_Result, Tag("result")], Discriminator(_kind)]
)


async def serve_editor(socket: WebSocket, worker: Worker, folder: Folder) -> None:
    """Hand messages on until the editor or the server has ended."""
    waiting: asyncio.Queue[bytes] = asyncio.Queue(_MOST_WAITING)
    tasks = [
        asyncio.create_task(_read(socket, waiting, folder)),
        asyncio.create_task(_hand_on(waiting, worker)),
        asyncio.create_task(_hand_back(worker, socket)),
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    await close(socket, 1011, "the language server has ended; connect again")


async def _read(socket: WebSocket, waiting: asyncio.Queue[bytes], folder: Folder) -> None:
    """Check what the editor says. A server that does not keep up is given up."""
    async for content in contents(socket):
        wrong = _problem(content, folder)
        if wrong is None:
            assert isinstance(content, str)
            waiting.put_nowait(content.encode())
        else:
            with suppress(RuntimeError, WebSocketDisconnect):
                await socket.send_text(_refusal(content, wrong))


async def _hand_on(waiting: asyncio.Queue[bytes], worker: Worker) -> None:
    with suppress(OSError):
        while True:
            content = await waiting.get()
            worker.writer.write(b"Content-Length: %d\r\n\r\n%s" % (len(content), content))
            await worker.writer.drain()


async def _hand_back(worker: Worker, socket: WebSocket) -> None:
    with suppress(asyncio.IncompleteReadError, OSError, RuntimeError, ValueError, WebSocketDisconnect):
        while True:
            head = await worker.reader.readuntil(b"\r\n\r\n")
            lines = [line.partition(b":") for line in head.lower().split(b"\r\n")]
            length = next(int(value) for name, _, value in lines if name == b"content-length")
            await socket.send_text((await worker.reader.readexactly(length)).decode())


def _problem(content: str | bytes, folder: Folder) -> str | None:
    """The reason why a message is not handed on."""
    if isinstance(content, bytes):
        return "got a binary message, expected JSON as text"
    if len(content) > LARGEST_MESSAGE:
        return f"got a message of {len(content)} characters, expected at most {LARGEST_MESSAGE}"
    try:
        message = _MESSAGES.validate_json(content)
    except ValidationError as error:
        return problem(error)
    document = (message.params or {}).get("textDocument") if isinstance(message, _Call) else None
    if document is None:
        return None
    uri = document.get("uri") if isinstance(document, dict) else None
    if not isinstance(uri, str):
        return "`params.textDocument.uri`: expected the address of a file"
    return _outside(uri, folder)


def _outside(uri: str, folder: Folder) -> str | None:
    """What keeps an address from being that of a file of the folder."""
    try:
        split = urlsplit(uri)
        path = unquote(split.path, errors="strict")
        root = str(folder.root).rstrip("/") + "/"
        if split.scheme != "file" or split.netloc or split.query or not path.startswith(root):
            return "lies outside of the opened folder"
        folder.path(path.removeprefix(root))
    except FileError as error:
        return str(error)
    except ValueError:
        return "got an address that cannot be read"
    return None


def _refusal(content: str | bytes, why: str) -> str:
    """An error as JSON-RPC has it."""
    number = None
    with suppress(ValidationError):
        number = _Numbered.model_validate_json(content[:LARGEST_MESSAGE]).id
    return json.dumps({"jsonrpc": "2.0", "id": number, "error": {"code": _NO_REQUEST, "message": why}})


class _Numbered(BaseModel):
    model_config = ConfigDict(strict=True)

    id: _Number
