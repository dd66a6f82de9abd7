"""Requests to an OpenAI-compatible endpoint, with retries until an answer or a final error."""

from __future__ import annotations

import asyncio
import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from email.utils import parsedate_to_datetime
from time import time
from typing import Any, Final

import httpx

from socialai_dsl.diagnostics import printable
from socialai_dsl.llm.actions import ToolCall

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
_MOST_BYTES: Final = 4_000_000
_CITED: Final = 200


class EndpointError(Exception):
    """The endpoint does not answer, or refuses; the message says in one line what was tried and what came of it."""


@dataclass(frozen=True)
class Usage:
    """The tokens and cost of requests.

    Attributes:
        prompt, completion: tokens. cost: in US dollars; None if prices are not known.
        estimated: whether the server did not say how many tokens there were, so that four characters count as one.
    """

    prompt: int = 0
    completion: int = 0
    cost: float | None = None
    estimated: bool = False

    @property
    def tokens(self) -> int:
        """Of prompts and completions."""
        return self.prompt + self.completion

    def __add__(self, other: Usage) -> Usage:
        costs = [cost for cost in (self.cost, other.cost) if cost is not None]
        return Usage(
            self.prompt + other.prompt,
            self.completion + other.completion,
            sum(costs) if costs else None,
            self.estimated or other.estimated,
        )


@dataclass(frozen=True)
class Answer:
    """A model's answer: text, the tools that it calls, and the usage."""

    text: str
    calls: tuple[ToolCall, ...]
    usage: Usage


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
        """Connections for many requests; to be closed."""
        headers = {"Authorization": f"Bearer {self.key}"} if self.key else {}
        return httpx.AsyncClient(headers=headers, timeout=httpx.Timeout(None, connect=_CONNECT_SECONDS))

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

        Raises:
            EndpointError: there was no answer, or a refusal.
        """
        body = {"model": self.model, "messages": list(messages), **more}
        body |= {name: value for name, value in self.options.items() if value is not None}
        what, wait, strange = "", 0.0, 0
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
            if status == httpx.codes.OK:
                answer = self._answer(content, messages)
                if answer is not None:
                    return answer
                what, strange = f"the answer is no completion: {_cited(content)}", strange + 1
            elif status in _PASSING:
                what, wait = f"status {status}: {_cited(content)}", _retry_after(headers)
            else:
                raise self._failure(f"status {status}: {_cited(content)}")
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

    def _answer(self, content: bytes, messages: Sequence[Message]) -> Answer | None:
        """What a completion holds; None if it is none."""
        try:
            found = json.loads(content)
            message = found["choices"][0]["message"]
            text = message.get("content") or message.get("refusal") or ""
            calls = tuple(
                ToolCall(call["function"]["name"], call["function"]["arguments"])
                for call in message.get("tool_calls") or ()
            )
            usage = found.get("usage") or {}
            counts = usage.get("prompt_tokens"), usage.get("completion_tokens")
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return None
        if not isinstance(text, str) or not all(isinstance(part, str) for call in calls for part in call):
            return None
        prompt, completion = (count if isinstance(count, int) and count >= 0 else None for count in counts)
        estimated = prompt is None or completion is None
        if prompt is None or completion is None:
            prompt, completion = len(json.dumps(messages)) // 4, len(content) // 4
        return Answer(
            text, calls, Usage(prompt, completion, self._cost(usage, prompt, completion), estimated)
        )

    def _cost(self, usage: Mapping[str, Any], prompt: int, completion: int) -> float | None:
        """US dollars: by the prices given, else as the server says."""
        if self.prices is not None:
            return (prompt * self.prices[0] + completion * self.prices[1]) / 1e6
        told = usage.get("cost")
        return float(told) if isinstance(told, int | float) and told >= 0 else None

    def _failure(self, what: str) -> EndpointError:
        text = f"model {self.model!r} at {self.address}: {what}"
        return EndpointError(printable(text.replace(self.key, "***") if self.key else text))


def _retry_after(headers: httpx.Headers) -> float:
    """Seconds that the server asks to wait, as a number or as a date."""
    given = headers.get("retry-after", "")
    try:
        wait = float(given)
    except ValueError:
        try:
            wait = parsedate_to_datetime(given).timestamp() - time()
        except ValueError:
            return 0.0
    return min(max(wait, 0.0), _LONGEST_WAIT)


def _cited(content: bytes) -> str:
    """What a server said, in one line."""
    try:
        found = json.loads(content)
        text = str(found["error"]["message"])
    except (ValueError, LookupError, TypeError, RecursionError):
        text = content[: 4 * _CITED].decode(errors="replace")
    text = " ".join(text.split())
    return (text if len(text) <= _CITED else f"{text[:_CITED]}…") or "nothing"
