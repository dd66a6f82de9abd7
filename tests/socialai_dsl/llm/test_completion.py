"""What servers answer: each way of writing a message is read, and whatever else comes is an answer that counts."""

import json
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from socialai_dsl.llm.actions import ToolCall
from socialai_dsl.llm.completion import UNREADABLE, Completion, read_completion, read_error

LEFT = ToolCall("move", '{"direction": "left"}')


def sent(message: Any, **more: Any) -> bytes:
    return json.dumps({"choices": [{"message": message, **more}]}).encode()


def calling(name: Any, arguments: Any) -> dict[str, Any]:
    return {"content": None, "tool_calls": [{"id": "1", "function": {"name": name, "arguments": arguments}}]}


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (sent({"content": "Act: left"}), Completion("Act: left")),
        (sent({"content": [{"type": "text", "text": "Act: "}, {"text": "left"}]}), Completion("Act: left")),
        (sent({"content": ["Act: left", {"type": "image_url", "image_url": {}}]}), Completion("Act: left")),
        (sent({"content": {"type": "text", "text": "Act: left"}}), Completion("Act: left")),
        (
            sent({"content": [{"type": "thinking", "thinking": [{"type": "text", "text": "Hm"}]}, {"text": "left"}]}),
            Completion("left", reasoning="Hm"),
        ),
        (sent({"content": "left", "reasoning_content": "Hm"}), Completion("left", reasoning="Hm")),
        (sent({"content": None, "reasoning": "Act: left"}), Completion("", reasoning="Act: left")),
        (sent({"content": "left", "reasoning": {"a": 1}}), Completion("left")),
        (sent({"content": None}), Completion("")),
        (sent({}), Completion("")),
        (sent(calling("move", '{"direction": "left"}')), Completion("", (LEFT,))),
        (sent(calling("move", {"direction": "left"})), Completion("", (LEFT,))),
        (sent(calling("move", None)), Completion("", (ToolCall("move", "{}"),))),
        (sent(calling(7, [1])), Completion("", (ToolCall("", "[1]"),))),
        (sent({"function_call": {"name": "move", "arguments": LEFT.arguments}}), Completion("", (LEFT,))),
        (sent({"content": "left", "tool_calls": 7}), Completion("left")),
        (sent({"content": None, "refusal": "No."}), Completion("No.", stop="refusal")),
        (sent({"content": [{"type": "refusal", "refusal": "No."}]}), Completion("No.", stop="refusal")),
        (sent({"content": [{"refusal": "No."}, {"text": "left"}]}), Completion("left")),
        (
            sent({"tool_calls": [{"index": 0, "function": LEFT._asdict()}, {"index": 0, "function": LEFT._asdict()}]}),
            Completion("", (LEFT, LEFT)),
        ),
        (
            sent({"content": "Act"}, finish_reason="length"),
            Completion("Act", stop="length", reason="length"),
        ),
        (sent({"content": ""}, finish_reason="SAFETY"), Completion("", stop="content_filter", reason="SAFETY")),
        (sent({"content": "left"}, finish_reason="eos"), Completion("left", reason="eos")),
        (sent({"content": "left"}, finish_reason=["stop"]), Completion("left")),
        (sent({"content": "\ud83d left"}), Completion("? left")),
        (b"\xef\xbb\xbf" + sent({"content": "left"}), Completion("left")),
        (sent({"content": "left"})[:-1] + b', "usage": {"prompt_tokens": -1, "cost": NaN}}', Completion("left")),
        (sent({"content": "left"})[:-1] + b', "usage": "much"}', Completion("left")),
        (
            sent({"content": "left"})[:-1]
            + b', "usage": {"prompt_tokens": 3, "completion_tokens": 2, "cost": 0.5, '
            + b'"completion_tokens_details": {"reasoning_tokens": 1}}}',
            Completion("left", prompt_tokens=3, completion_tokens=2, reasoning_tokens=1, cost=0.5),
        ),
        *((text, UNREADABLE) for text in (b'{"choices": []}', b'{"choices": null}', b'{"choices": [null]}')),
        (b'{"choices": [{"text": "left"}]}', UNREADABLE),
        *((sent({"content": odd}), UNREADABLE) for odd in (7, True, [7])),
        *((text, None) for text in (b"", b"[1]", b"null", b"\xff\x00", b"<html>", b"[" * 100_000, b'{"a":' * 9000)),
        (b'{"choices": 1' + b"0" * 9000 + b"}", None),
    ],
)  # fmt: skip
def test_a_completion_is_read_as_servers_write_it(content: bytes, expected: Completion | None) -> None:
    assert read_completion(content) == expected


def events(*deltas: Any, reason: str | None = "stop", end: bytes = b"data: [DONE]\n\n") -> bytes:
    """A stream with an event of each delta."""
    chunks: list[Any] = [{"choices": [{"delta": delta}]} for delta in deltas]
    chunks += [{"choices": [{"delta": {}, "finish_reason": reason}]}]
    chunks += [{"choices": [], "usage": {"prompt_tokens": 3, "completion_tokens": 2}}]
    return b"".join(b"data: " + json.dumps(chunk).encode() + b"\n\n" for chunk in chunks) + end


def piece(index: int, **function: Any) -> dict[str, Any]:
    return {"tool_calls": [{"index": index, "function": function}]}


COUNTED: dict[str, Any] = {"reason": "stop", "prompt_tokens": 3, "completion_tokens": 2}


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (events({"content": ""}, {"content": "Act: "}, {"content": "left"}), Completion("Act: left", **COUNTED)),
        (b": ping\n\n" + events({"content": "left"}, end=b""), Completion("left", **COUNTED)),
        (b"event: message\r\n" + events({"content": [{"text": "left"}]}), Completion("left", **COUNTED)),
        (
            events({"reasoning_content": "Hm"}, {"reasoning": ", I"}, {"content": "left"}),
            Completion("left", reasoning="Hm, I", **COUNTED),
        ),
        (events({"refusal": "No"}, {"refusal": "."}), Completion("No.", stop="refusal", **COUNTED)),
        *((begin + events({"content": "left"}), Completion("left", **COUNTED)) for begin in (b"id: 1\n", b"\r\n\n")),
        (
            events({"content": "Act"}, reason="length"),
            Completion("Act", stop="length", **{**COUNTED, "reason": "length"}),
        ),
        (
            events(
                piece(0, name="move", arguments='{"direction"'), piece(0, arguments=': "left"}'), piece(1, name="say")
            ),
            Completion("", (LEFT, ToolCall("say", "{}")), **COUNTED),
        ),
        *((text, None) for text in (b"data: [1]\n\n", b"data: Welcome", b":", b"event: x", b"data: {\n" * 9000)),
        (events({"content": "lef"}, reason=None, end=b""), None),
        (events({"content": 7}), None),
    ],
)  # fmt: skip
def test_a_stream_that_nobody_asked_for_is_put_together(content: bytes, expected: Completion | None) -> None:
    assert read_completion(content) == expected


@given(st.text(st.characters(exclude_categories=["Cs"])))
@example("\u2028\u2029\x85\x1c")
def test_a_stream_holds_any_text(text: str) -> None:
    """Also signs that end lines of text, not of events: servers write them as they are."""
    chunk = json.dumps({"choices": [{"delta": {"content": text}}]}, ensure_ascii=False)
    found = read_completion(f"data: {chunk}\n\ndata: [DONE]\n\n".encode())
    assert found is not None
    assert found.text == text


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b'{"error": {"message": "No.", "code": "no"}}', ("No.", "no")),
        (b'{"error": {"message": "No.", "code": 400, "type": "bad"}}', ("No.", "bad")),
        (b'{"error": "No."}', ("No.", "")),
        (b'{"detail": "No."}', ("No.", "")),
        *((text, ("", "")) for text in (b"", b"[]", b"No.", b"\xff", b'{"error": [1]}', b"[" * 100_000)),
    ],
)
def test_an_error_is_read_likewise(content: bytes, expected: tuple[str, str]) -> None:
    assert read_error(content) == expected


KEYS = "choices message content refusal reasoning reasoning_content tool_calls function name arguments type text "
KEYS += "thinking finish_reason usage prompt_tokens completion_tokens cost error code detail"
LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just("\ud800")
OBJECTS = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS.split()), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(OBJECTS.map(lambda one: json.dumps(one).encode()) | OBJECTS.map(sent) | st.binary())
@settings(max_examples=500, deadline=None)
def test_whatever_a_server_sends_is_an_answer_or_none(content: bytes) -> None:
    found = read_completion(content)
    read_error(content)
    if found is not None:
        texts = [found.text, found.reasoning, *(part for call in found.calls for part in call)]
        "".join(texts).encode()  # can be written to a transcript
