"""What an OpenAI-compatible server answers, checked where it arrives: every server has its own way with it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

from pydantic import (
    AliasChoices,
    BaseModel,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from socialai_dsl.llm.actions import ToolCall

Stop = Literal["", "length", "content_filter", "refusal", "unreadable", "context"]
"""Why a reply ended before its end: it was too long, a filter held it back, the model refused, the server sent nothing
that can be read, or the conversation is longer than the model's context; empty for one that the model ended."""

_STOPS: Final[dict[str, Stop]] = {
    **dict.fromkeys(("length", "max_tokens", "max_output_tokens", "max_length", "model_length"), "length"),
    **dict.fromkeys(
        ("content_filter", "content_filtered", "safety", "recitation", "blocklist", "prohibited_content"),
        "content_filter",
    ),
    **dict.fromkeys(("sensitive", "spii", "guardrail_intervened"), "content_filter"),
    "refusal": "refusal",
}
_MOST_TOKENS: Final = 10**12
_LONGEST_REASON: Final = 80
_EVENTS: Final = (b"data:", b"event:", b"id:", b"retry:", b":")
"""How a stream of events begins."""
_DONE: Final = b"[DONE]"
"""The last event."""


def _as_given(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """What is of another type than expected says nothing."""
    try:
        return handler(value)
    except ValidationError:
        return None


_Perhaps = WrapValidator(_as_given)
_Text = Annotated[str | None, _Perhaps]
_Count = Annotated[int | None, Field(ge=0, le=_MOST_TOKENS), _Perhaps]


class _Part(BaseModel):
    """A part of a content: text, thoughts, a refusal (which is apart from what it says), or something else."""

    type: _Text = None
    text: _Text = None
    refusal: _Text = None
    thinking: Annotated[str | list[_Part] | None, _Perhaps] = None

    def texts(self) -> Iterator[tuple[bool, str]]:
        """Pieces of text, each with whether it is thought."""
        if isinstance(self.thinking, str):
            yield True, self.thinking
        for part in self.thinking if isinstance(self.thinking, list) else ():
            yield from ((True, text) for _, text in part.texts())
        yield self.type in ("thinking", "reasoning"), self.text or ""


class _Function(BaseModel):
    name: _Text = None
    arguments: Any = None

    @property
    def written(self) -> str:
        """The arguments as JSON: some servers send the object itself."""
        if self.arguments is None or isinstance(self.arguments, str):
            return self.arguments or ""
        return json.dumps(self.arguments)


class _Call(BaseModel):
    index: _Count = None
    function: Annotated[_Function | None, _Perhaps] = None


class _Message(BaseModel):
    content: str | list[str | _Part] | _Part | None = None
    refusal: _Text = None
    reasoning_content: _Text = None
    reasoning: _Text = None
    tool_calls: Annotated[list[_Call] | None, _Perhaps] = None
    function_call: Annotated[_Function | None, _Perhaps] = None

    @property
    def parts(self) -> list[str | _Part]:
        """Those of the content."""
        return self.content if isinstance(self.content, list) else [self.content or ""]

    def texts(self) -> Iterator[tuple[bool, str]]:
        """Pieces of text, each with whether it is thought."""
        yield True, self.reasoning_content or self.reasoning or ""
        for part in self.parts:
            yield from [(False, part)] if isinstance(part, str) else part.texts()

    def refusals(self) -> Iterator[str]:
        """Pieces of a refusal."""
        yield self.refusal or ""
        yield from (part.refusal or "" for part in self.parts if isinstance(part, _Part))

    def functions(self) -> Iterator[tuple[int, _Function]]:
        """Functions that are called, or further pieces of them, each with the number of its call."""
        given = self.tool_calls or ([_Call(function=self.function_call)] if self.function_call else [])
        numbers = {call.index for call in given}
        for place, call in enumerate(given):
            # Whole messages often number nothing, or give all calls the same number.
            number = call.index if len(numbers) == len(given) else None
            yield place if number is None else number, call.function or _Function()


class _Choice(BaseModel):
    message: _Message = Field(validation_alias=AliasChoices("message", "delta"))
    finish_reason: _Text = None


class _Details(BaseModel):
    reasoning_tokens: _Count = None


class _Usage(BaseModel):
    prompt_tokens: _Count = None
    completion_tokens: _Count = None
    completion_tokens_details: Annotated[_Details | None, _Perhaps] = None
    cost: Annotated[float | None, Field(ge=0, allow_inf_nan=False), _Perhaps] = None


class _Completion(BaseModel):
    choices: list[_Choice] = Field(min_length=1)
    usage: Annotated[_Usage | None, _Perhaps] = None


class _Chunk(BaseModel):
    """An event of a stream."""

    choices: list[_Choice]
    usage: Annotated[_Usage | None, _Perhaps] = None


class _Named(BaseModel):
    message: _Text = None
    code: _Text = None
    type: _Text = None


class _Refusal(BaseModel):
    error: Annotated[_Named | str | None, _Perhaps] = None
    message: _Text = None
    detail: _Text = None


@dataclass(frozen=True)
class Completion:
    """A model's answer as a server sent it.

    Attributes:
        text: the reply. calls: the tools that it calls. reasoning: thoughts that the server keeps apart.
        stop: why it ended before its end. reason: the server's own word for how it ended.
        prompt_tokens, completion_tokens, reasoning_tokens: as the server counts them; None if it does not.
        cost: in US dollars, as the server says; None if it does not.
    """

    text: str
    calls: tuple[ToolCall, ...] = ()
    reasoning: str = ""
    stop: Stop = ""
    reason: str = ""
    prompt_tokens: int | None = None
    completion_tokens: int | None = None
    reasoning_tokens: int | None = None
    cost: float | None = None


UNREADABLE: Final = Completion("", stop="unreadable")
"""A completion in which there is no message."""


def looks_like_one(content: bytes) -> bool:
    """Whether what a server sends begins like a completion, however it goes on."""
    return content.lstrip().startswith((b"{", *_EVENTS))


def read_completion(content: bytes) -> Completion | None:
    """The completion that a server sent, `UNREADABLE` for one of another form; None if it is no completion at all.

    Some servers stream whatever they are asked: a stream that came to its end is put together.
    """
    if content.lstrip().startswith(_EVENTS):
        return _streamed(content)
    found = _json(content)
    try:
        completion = _Completion.model_validate(found)
    except ValidationError:
        return UNREADABLE if isinstance(found, dict) and "choices" in found else None
    choice = completion.choices[0]
    return _made([choice.message], choice.finish_reason, completion.usage)


def _streamed(content: bytes) -> Completion | None:
    """The completion whose pieces are events; None if they are no pieces of one, or not all."""
    # Bytes end lines as events do; a text would also end them at signs such as U+2028, which JSON can hold.
    data = [line.removeprefix(b"data:").strip() for line in content.splitlines() if line.startswith(b"data:")]
    try:
        chunks = [_Chunk.model_validate(_json(event)) for event in data if event != _DONE]
    except ValidationError:
        return None
    choices = [choice for chunk in chunks for choice in chunk.choices[:1]]
    reason = next((choice.finish_reason for choice in reversed(choices) if choice.finish_reason), None)
    if reason is None and _DONE not in data:
        return None
    usage = next((chunk.usage for chunk in reversed(chunks) if chunk.usage), None)
    return _made([choice.message for choice in choices], reason, usage)


def _made(messages: list[_Message], finish_reason: str | None, usage: _Usage | None) -> Completion:
    """A completion of a message, or of its pieces."""
    usage = usage or _Usage()
    pieces = [piece for message in messages for piece in message.texts()]
    text = "".join(piece for thought, piece in pieces if not thought)
    calls = _calls(function for message in messages for function in message.functions())
    refused = "" if text or calls else "".join(piece for one in messages for piece in one.refusals())
    reason = (finish_reason or "")[:_LONGEST_REASON]
    return Completion(
        refused or text,
        calls,
        "".join(piece for thought, piece in pieces if thought),
        _STOPS.get(reason.lower(), "refusal" if refused else ""),
        reason,
        usage.prompt_tokens,
        usage.completion_tokens,
        (usage.completion_tokens_details or _Details()).reasoning_tokens,
        usage.cost,
    )


def _calls(functions: Iterable[tuple[int, _Function]]) -> tuple[ToolCall, ...]:
    """Calls of tools, from their pieces."""
    calls: dict[int, ToolCall] = {}
    for number, piece in functions:
        begun = calls.get(number, ToolCall("", ""))
        calls[number] = ToolCall(begun.name or piece.name or "", begun.arguments + piece.written)
    return tuple(ToolCall(call.name, call.arguments or "{}") for call in calls.values())


def read_error(content: bytes) -> tuple[str, str]:
    """What a server says in place of a completion, and the code that it gives."""
    try:
        found = _Refusal.model_validate(_json(content))
    except ValidationError:
        return "", ""
    error = found.error if isinstance(found.error, _Named) else _Named(message=found.error)
    return error.message or found.message or found.detail or "", error.code or error.type or ""


def _json(content: bytes) -> Any:
    """JSON, with what no text can hold replaced; None if it is not."""
    try:
        text = content.decode("utf-8-sig", errors="replace")
        return json.loads(text, object_hook=storable)
    except (ValueError, RecursionError):
        return None


def storable(found: dict[str, Any]) -> dict[str, Any]:
    """An object of JSON whose texts can be written: halves of characters, which JSON can hold, are replaced."""
    return {key: _whole(value) for key, value in found.items()}


def _whole(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", errors="replace").decode()
    return [_whole(one) for one in value] if isinstance(value, list) else value
