"""In front of a server: who may speak to it, what a message may be, and how long a silent session keeps its place."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from typing import Any, Final, Literal
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from socialai_dsl.diagnostics import printable
from socialai_dsl.draws import MAX_SEED
from socialai_dsl.llm.completion import storable
from socialai_dsl.schema.scenario import TEST_SET

IDLE: Final = 900.0
"""Seconds that a session may be silent, unless the server is told otherwise."""
MOST_BYTES: Final = 1_000_000
"""The longest message."""
_LOOPBACK: Final = ("localhost", "127.0.0.1", "::1")
_EVERYWHERE: Final = ("", "0.0.0.0", "::")
_SESSIONS: Final = "/ws"
_GONE: Final = 1001
_CITED, _LONGEST = 60, 500
"""The most characters of what was given that a sentence repeats, and of a sentence."""

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]


class Beginning(BaseModel):
    """How an episode begins."""

    model_config = ConfigDict(extra="forbid", strict=True)

    seed: int | None = Field(None, ge=0, le=MAX_SEED)
    test_episode: int | None = Field(None, ge=0, lt=TEST_SET)
    episode_id: str | None = Field(None, max_length=255)


class _Playing(BaseModel):
    """What a session may say."""

    model_config = ConfigDict(extra="forbid", strict=True)

    type: Literal["reset", "step", "state", "close", "mcp"]
    data: dict[str, Any] | None = None


class _Step(BaseModel):
    """The body of a request to play."""

    model_config = ConfigDict(strict=True)

    action: dict[str, Any]


class _Played(BaseModel):
    """What a session says to play."""

    model_config = ConfigDict(strict=True)

    data: dict[str, Any]


class Gate:
    """An ASGI application in front of another one.

    A browser sends requests to this machine for whatever page asks for it, so a request must name this server as its
    host, and come from no page of another one.

    Args:
        app: what it stands in front of.
        hosts: names of this server, beside those of the loopback interface.
        idle: seconds after which a session ends that sends nothing.
    """

    def __init__(self, app: App, hosts: Iterable[str] = (), idle: float = IDLE) -> None:
        self._app = app
        named = (host.strip().strip("[]").rstrip(".").lower() for host in hosts)
        self._hosts = {*_LOOPBACK, *(host for host in named if host not in _EVERYWHERE)}
        self._idle = idle

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Hand a connection on, or refuse it."""
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        refusal = self._refusal(scope)
        if refusal is not None:
            return await _refuse(scope, send, 403, refusal)
        if scope["type"] == "websocket":
            session = _Session(receive, send, self._idle, scope["path"].endswith(_SESSIONS))
            return await self._app(scope, session.receive, session.send)
        body = await _body(receive)
        if body is None:
            return await _refuse(scope, send, 413, f"got a body of more than {MOST_BYTES} bytes")
        try:
            body = _checked_body(scope["path"], body)
        except ValueError as error:
            return await _refuse(scope, send, 422, sentence(error))
        whole: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def again() -> Message:
            return whole.pop() if whole else await receive()

        return await self._app(scope, again, send)

    def _refusal(self, scope: Message) -> str | None:
        """Why a connection is refused; None if it is not."""
        headers = [(name.lower(), value.decode("latin-1")) for name, value in scope["headers"]]
        asked = [value for name, value in headers if name == b"host"]
        if len(asked) != 1 or _host(f"//{asked[0]}") not in self._hosts:
            said = ", ".join(map(printable, asked)) or "none"
            return f"Host: got {said[:80]}, which this server is not called; --allow NAME gives it a name"
        for name, value in headers:
            if name == b"origin" and _host(value) not in self._hosts:
                return (
                    f"Origin: got {printable(value)[:80]}, a page of another server; --allow NAME lets it in"
                )
        return None


class _Session:
    """The messages of one connection.

    Args:
        receive: the next one from the client. send: takes one for it.
        idle: seconds after which silence ends the connection.
        plays: whether it speaks as `_Playing` says.
    """

    def __init__(self, receive: Receive, send: Send, idle: float, plays: bool) -> None:
        self._receive, self._send = receive, send
        self._idle, self._plays = idle, plays
        self._ended = False

    async def receive(self) -> Message:
        """The next message that is one; others are answered here, and the session goes on."""
        while not self._ended:
            try:
                message = await asyncio.wait_for(self._receive(), self._idle)
            except TimeoutError:
                reason = f"the session was silent for {self._idle:g} s"
                await self.send({"type": "websocket.close", "code": _GONE, "reason": reason})
                break
            if message["type"] != "websocket.receive":
                return message
            try:
                return {"type": "websocket.receive", "text": _checked_message(message, self._plays)}
            except ValueError as error:
                told = {"type": "error", "data": {"message": sentence(error), "code": "VALIDATION_ERROR"}}
                await self.send({"type": "websocket.send", "text": json.dumps(told)})
        return {"type": "websocket.disconnect", "code": _GONE}

    async def send(self, message: Message) -> None:
        """Send a message, unless the session has ended."""
        if not self._ended:
            self._ended = message["type"] == "websocket.close"
            await self._send(message)


def _host(address: str) -> str | None:
    """The host of an address, as it is compared."""
    try:
        return (urlsplit(address).hostname or "").rstrip(".")
    except ValueError:
        return None


def _checked_message(message: Message, plays: bool) -> str:
    """A message of a session as JSON. Raises ValueError if it is none."""
    text = message.get("text")
    if text is None:
        raise ValueError("got bytes, expected text")
    if len(text) > MOST_BYTES:
        raise ValueError(f"got {len(text)} characters, expected at most {MOST_BYTES}")
    found = _json(text)
    kind = _Playing.model_validate(found).type if plays else None
    if kind == "reset":
        Beginning.model_validate(found.get("data", {}))
    elif kind == "step":
        _Played.model_validate(found)
    elif kind in ("state", "close") and "data" in found:
        raise ValueError("data: there is no such key")
    return _written(found)


def _checked_body(path: str, body: bytes) -> bytes:
    """The body of a request as JSON; one without a body stays so. Raises ValueError if it is none."""
    if not body.strip():
        return body
    found = _json(body)
    if path.endswith("/reset"):
        Beginning.model_validate(found)
    if path.endswith("/step"):
        _Step.model_validate(found)
    return _written(found).encode()


def _json(text: str | bytes) -> Any:
    """What JSON says. Raises ValueError if it is none."""
    try:
        return json.loads(text, parse_constant=_no_number, object_hook=storable)
    except RecursionError:
        raise ValueError("got JSON that is nested too deep") from None
    except ValueError as error:
        raise ValueError(f"got what is no JSON ({error})") from None


def _written(found: Any) -> str:
    """What was read, as JSON. Raises ValueError where that has no number for it, such as for 1e999."""
    try:
        return json.dumps(found, allow_nan=False)
    except RecursionError:
        raise ValueError("got JSON that is nested too deep") from None


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number")


def sentence(error: ValueError) -> str:
    """What is wrong with something given: what was got, and what was expected."""
    if not isinstance(error, ValidationError):
        return printable(str(error))[:_LONGEST]
    return "; ".join(_told(one) for one in error.errors(include_url=False))[:_LONGEST]


def _told(error: Mapping[str, Any]) -> str:
    """One mistake in a sentence."""
    where = printable(".".join(map(str, error["loc"])))[:_CITED]
    if error["type"] == "extra_forbidden":
        return f"{where}: there is no such key"
    if error["type"] == "missing":
        return f"{where}: it is missing"
    expected = error["msg"].removeprefix("Input should be ")
    if error["type"] in ("model_type", "dict_type"):
        expected = "an object"
    elif expected.startswith(("less", "greater")):
        expected = f"a number {expected}"
    return f"{where}{': ' * bool(where)}got {printable(repr(error['input'])[:_CITED])}, expected {expected}"


async def _body(receive: Receive) -> bytes | None:
    """The body of a request; None if it is too long, or was not sent to its end."""
    body = b""
    while True:
        message = await receive()
        body += bytes(message.get("body", b""))
        if len(body) > MOST_BYTES or message["type"] != "http.request":
            return None
        if not message.get("more_body"):
            return body


async def _refuse(scope: Message, send: Send, status: int, detail: str) -> None:
    """Answer with a status and a sentence; a websocket that is not accepted has no place for the sentence."""
    if scope["type"] == "websocket":
        return await send({"type": "websocket.close", "code": 1008, "reason": detail[:120]})
    content = json.dumps({"detail": detail}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(content)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    return await send({"type": "http.response.body", "body": content})
