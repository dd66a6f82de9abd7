"""Requests to an OpenAI-compatible endpoint, with retries until an answer or a final error."""

from __future__ import annotations

import asyncio
import json
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from email.utils import parsedate_to_datetime
from math import isfinite
from time import time
from typing import Any, Final

import httpx

from socialai_dsl.diagnostics import printable
from socialai_dsl.llm.actions import ToolCall
from socialai_dsl.llm.completion import (
    UNREADABLE,
    Completion,
    Stop,
    looks_like_one,
    read_completion,
    read_error,
)

OPENAI: Final = "https://api.openai.com/v1"
Message = Mapping[str, Any]
"""A message of a conversation, as the interface takes it."""

_TRIES: Final = 6
_FIRST_WAIT: Final = 1.0
_LONGEST_WAIT: Final = 120.0
_PASSING: Final = frozenset({408, 409, 425, 429, 500, 502, 503, 504, 529})
"""Statuses after which it is worth trying again."""
_LOST: Final = (httpx.ReadError, httpx.WriteError, httpx.RemoteProtocolError)
"""A connection that was there and broke."""
_CONNECT_SECONDS: Final = 15.0
_REFUSING: Final = frozenset({400, 413, 422, 500})
"""Statuses with which servers refuse a conversation that they cannot take."""
_FULL: Final = re.compile(
    r"context[ _-]?(?:length|size|window|limit)|maximum (?:model|prompt|input|sequence) length|max_model_len"
    r"|(?:prompt|input|request|conversation)\b.{0,40} (?:is )?too (?:long|large)\b.{0,20}(?:token|context|\Z)"
    r"|too many (?:input )?tokens|longer than the (?:model|maximum)|exceeds? the (?:model|maximum number of tokens)"
    r"|input token count|must have less than \d+ tokens|inputs? tokens \+|reduce the length of the messages",
    re.IGNORECASE,
)
"""How servers say that a conversation is longer than the model's context."""
_RATE: Final = re.compile(r"rate.?limit|per (?:minute|day)|quota", re.IGNORECASE)
_FILTERED: Final = re.compile(
    r"content_(?:policy|filter)|content management policy|ResponsibleAI", re.IGNORECASE
)
_MOST_BYTES: Final = 4_000_000
_UNREAD: Final = 2
"""How often a completion without a message is asked for again before it counts as the answer."""
_CITED: Final = 200
_SHORTEST_KEY: Final = 8
"""A shorter one is a word such as `none` that servers without keys are given, and stands in other words."""


class EndpointError(Exception):
    """The endpoint does not answer, or refuses; the message says in one line what was tried and what came of it."""


class ContextFull(EndpointError):  # noqa: N818 - it says what was found
    """A conversation is longer than the model's context."""


@dataclass(frozen=True)
class Usage:
    """The tokens and cost of requests.

    Attributes:
        prompt, completion: tokens. cost: in US dollars; None if the price of any of them is not known.
        reasoning: those tokens of completions that are thoughts, as far as the server counts them.
        estimated: whether the server did not say how many tokens there were, so that four characters count as one.
    """

    prompt: int = 0
    completion: int = 0
    cost: float | None = None
    estimated: bool = False
    reasoning: int = 0

    @property
    def tokens(self) -> int:
        """Of prompts and completions."""
        return self.prompt + self.completion

    def __add__(self, other: Usage) -> Usage:
        costs = [one.cost for one in (self, other) if one.tokens or one.cost is not None]
        return Usage(
            self.prompt + other.prompt,
            self.completion + other.completion,
            sum(cost for cost in costs if cost is not None) if costs and None not in costs else None,
            self.estimated or other.estimated,
            self.reasoning + other.reasoning,
        )


@dataclass(frozen=True)
class Answer:
    """A model's answer.

    Attributes:
        text: the reply. calls: the tools that it calls. usage: what it took.
        reasoning: thoughts that the server keeps apart from the reply.
        stop: why it ended before its end. reason: the server's own word for how it ended.
    """

    text: str
    calls: tuple[ToolCall, ...] = ()
    usage: Usage = field(default_factory=Usage)
    reasoning: str = ""
    stop: Stop = ""
    reason: str = ""


@dataclass(frozen=True)
class Endpoint:
    """Where a model is asked, and how.

    Attributes:
        model: its name there. base_url: of the interface, without `/chat/completions`.
        key: sent with each request; neither printed nor stored.
        options: of each request, such as `temperature`; None leaves one out.
        timeout: seconds that a whole answer may take.
        prices: US dollars for a million tokens of prompts and of completions, if known.
    """

    model: str
    base_url: str = OPENAI
    key: str = field(default="", repr=False)
    options: Mapping[str, Any] = field(default_factory=dict)
    timeout: float = 120.0
    prices: tuple[float, float] | None = None

    @property
    def address(self) -> str:
        """Where requests go."""
        return f"{self.base_url.rstrip('/')}/chat/completions"

    def client(self) -> httpx.AsyncClient:
        """Connections for many requests; to be closed.

        Raises:
            EndpointError: the proxy that the environment names cannot be used.
        """
        headers = {"Authorization": f"Bearer {self.key}"} if self.key else {}
        try:
            return httpx.AsyncClient(headers=headers, timeout=httpx.Timeout(None, connect=_CONNECT_SECONDS))
        except (ImportError, ValueError, httpx.InvalidURL) as error:
            raise self._failure(f"the proxy of the environment cannot be used ({error})") from None

    async def ask(
        self,
        client: httpx.AsyncClient,
        messages: Sequence[Message],
        more: Mapping[str, Any],
        known: bool = True,
    ) -> Answer:
        """The model's answer to a conversation.

        What passes (rate limits, errors of the server, lost connections, answers that are none) is tried again, as
        late as the server asks for, six times in all.

        Args:
            client: of this endpoint.
            messages: the conversation.
            more: of the request: `tools`, `response_format`, `grammar`.
            known: whether the endpoint has answered before. If not, its address is probably wrong when nothing that
                could be an answer comes back twice.

        A completion without a message, or one that a filter held back, is an answer with a `stop`.

        Raises:
            ContextFull: the conversation is longer than the model's context.
            EndpointError: there was no answer, or a refusal.
        """
        body = {"model": self.model, "messages": list(messages), **more}
        body |= {name: value for name, value in self.options.items() if value is not None}
        what, wait, strange, unread = "", 0.0, 0, 0
        for attempt in range(_TRIES):
            if attempt:
                if strange == 2 and not known:
                    break
                await asyncio.sleep(max(wait, _FIRST_WAIT * 2 ** (attempt - 1) * random.uniform(0.75, 1.25)))
            wait = 0.0
            try:
                # httpx's own limit starts anew with every byte.
                async with asyncio.timeout(self.timeout):
                    status, headers, content = await self._post(client, body)
            except (httpx.InvalidURL, httpx.UnsupportedProtocol) as error:
                raise self._failure(f"that is no URL ({error})") from None
            except TimeoutError:
                what, strange = f"it took longer than {self.timeout:g} s", strange + 1
                continue
            except httpx.HTTPError as error:
                # A server may close a connection just as it is used again; this says nothing about the address.
                what = f"no connection ({str(error) or type(error).__name__})"
                strange += not isinstance(error, _LOST)
                continue
            refused = _refusal(status, content) if status in _REFUSING else None
            if status == httpx.codes.OK:
                found = _completion(content)
                unread += found is UNREADABLE
                if found is not None and (found is not UNREADABLE or unread > _UNREAD):
                    return self._answer(found, content, messages)
                what, strange = f"the answer is no completion: {_cited(content)}", strange + (found is None)
            elif refused == "context":
                raise ContextFull(str(self._failure(f"status {status}: {_cited(content)}")))
            elif refused is not None:
                return self._answer(Completion("", stop=refused), content, messages)
            elif status in _PASSING:
                what, wait = f"status {status}: {_cited(content)}", _retry_after(headers)
            else:
                moved = f", moved to {headers['location']}" if "location" in headers else ""
                raise self._failure(f"status {status}{moved}: {_cited(content)}")
        raise self._failure(what)

    async def _post(
        self, client: httpx.AsyncClient, body: Mapping[str, Any]
    ) -> tuple[int, httpx.Headers, bytes]:
        """Status, headers and content of an answer, of which no more is read than an answer can have."""
        async with client.stream("POST", self.address, json=body) as response:
            content = b""
            async for chunk in response.aiter_bytes():
                content += chunk
                if len(content) > _MOST_BYTES:
                    break
            return response.status_code, response.headers, content

    def _answer(self, found: Completion, content: bytes, messages: Sequence[Message]) -> Answer:
        """A completion with what it took; without a count four characters are a token, read or, if none was, sent."""
        prompt, completion = found.prompt_tokens, found.completion_tokens
        estimated = prompt is None or completion is None
        if prompt is None or completion is None:
            written = "".join((found.text, found.reasoning, *(word for call in found.calls for word in call)))
            prompt, completion = len(json.dumps(messages)) // 4, len(written or content) // 4
        cost = found.cost
        if self.prices is not None:
            cost = (prompt * self.prices[0] + completion * self.prices[1]) / 1e6
        usage = Usage(prompt, completion, cost, estimated, found.reasoning_tokens or 0)
        return Answer(found.text, found.calls, usage, found.reasoning, found.stop, found.reason)

    def _failure(self, what: str) -> EndpointError:
        text = f"model {self.model!r} at {self.address}: {what}"
        hidden = text.replace(self.key, "***") if len(self.key) >= _SHORTEST_KEY else text
        return EndpointError(printable(hidden))


def _completion(content: bytes) -> Completion | None:
    """The completion that was sent; one that goes on beyond all measure was too long."""
    if len(content) > _MOST_BYTES and looks_like_one(content):
        return Completion("", stop="length")
    return read_completion(content)


def _refusal(status: int, content: bytes) -> Stop | None:
    """Whether a conversation is refused because it is too long, or because of what it says; None for other reasons."""
    said = " ".join(read_error(content)).strip() or content[:1000].decode(errors="replace")
    if _FULL.search(said) and not _RATE.search(said):
        return "context"
    return "content_filter" if status == httpx.codes.BAD_REQUEST and _FILTERED.search(said) else None


def _retry_after(headers: httpx.Headers) -> float:
    """Seconds that the server asks to wait, as a number or as a date."""
    given = headers.get("retry-after", "")
    try:
        wait = float(given)
    except ValueError:
        try:
            wait = parsedate_to_datetime(given).timestamp() - time()
        except (ValueError, TypeError, OverflowError):
            return 0.0
    return min(max(wait, 0.0), _LONGEST_WAIT) if isfinite(wait) else 0.0


def _cited(content: bytes) -> str:
    """What a server said, in one line."""
    text = read_error(content)[0] or content[: 4 * _CITED].decode(errors="replace")
    text = " ".join(text.split())
    return (text if len(text) <= _CITED else f"{text[:_CITED]}…") or "nothing"
