"""What comes and goes over a connection to a browser, which may close at any moment."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress

from starlette.websockets import WebSocket, WebSocketDisconnect

_sending: set[asyncio.Task[None]] = set()


async def contents(socket: WebSocket) -> AsyncIterator[str | bytes]:
    """What comes over a connection until it is closed."""
    while (message := await socket.receive())["type"] == "websocket.receive":
        text = message.get("text")
        yield text if text is not None else message.get("bytes") or b""


async def send(socket: WebSocket, text: str) -> None:
    """Send a message, unless the connection was closed, which its reader is told as well."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.send_text(text)


def send_soon(socket: WebSocket, text: str) -> None:
    """`send`, without waiting for it."""
    task = asyncio.get_running_loop().create_task(send(socket, text))
    _sending.add(task)
    task.add_done_callback(_sending.discard)


async def close(socket: WebSocket, code: int, why: str | None = None) -> None:
    """Close a connection, if the other side has not."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close(code, why)
