"""Before a server: strangers are refused, silence ends a session, and whatever is no message is answered."""

import asyncio
import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from socialai_dsl.cli.main import main
from socialai_dsl.llm.gate import IDLE, MOST_BYTES, Gate

KNOWN = ((b"host", b"localhost:8000"),)


async def served(scope: Any, receive: Any, send: Any) -> None:
    """Answers each request with its body, and each message of a session with the word `played`."""
    if scope["type"] == "http":
        body = (await receive())["body"]
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": body})
        return
    while (message := await receive())["type"] != "websocket.disconnect":
        kind = message["type"].removeprefix("websocket.")
        await send(
            {"type": "websocket.accept"}
            if kind == "connect"
            else {"type": "websocket.send", "text": "played"}
        )


def asked(scope: dict[str, Any], messages: list[dict[str, Any]], **options: Any) -> list[dict[str, Any]]:
    """What a client is sent that says this and is silent from then on."""
    sent: list[dict[str, Any]] = []
    waiting = iter(messages)

    async def receive() -> Any:
        message = next(waiting, None)
        return message if message is not None else await asyncio.Event().wait()

    async def send(message: Any) -> None:
        sent.append(dict(message))

    gate = Gate(served, **{"idle": 0.01, **options})
    asyncio.run(gate({"path": "/reset", "headers": KNOWN, **scope}, receive, send))
    return sent


def posted(body: bytes, path: str = "/reset") -> tuple[int, str]:
    """The status of a request, and what it is answered."""
    start, content = asked({"type": "http", "path": path}, [{"type": "http.request", "body": body}])
    return start["status"], content["body"].decode()


def said(*messages: Any) -> list[str]:
    """What a session is told for each message that it sends."""
    received = [
        {"type": "websocket.receive", "bytes" if isinstance(one, bytes) else "text": one} for one in messages
    ]
    opened, *answers, closed = asked(
        {"type": "websocket", "path": "/ws"}, [{"type": "websocket.connect"}, *received]
    )
    assert opened["type"] == "websocket.accept"
    assert (closed["code"], closed["reason"]) == (1001, "the session was silent for 0.01 s")
    return [answer["text"] for answer in answers]


@pytest.mark.parametrize(
    ("headers", "let_in"),
    [
        ([(b"host", b"localhost")], True),
        ([(b"host", b"127.0.0.1:8000")], True),
        ([(b"host", b"[::1]:8000")], True),
        ([(b"Host", b"LocalHost:1")], True),
        ([(b"host", b"lab.example:8000")], True),
        ([(b"host", b"localhost:1"), (b"origin", b"http://localhost:2")], True),
        ([(b"host", b"localhost:1"), (b"origin", b"https://lab.example")], True),
        ([], False),
        ([(b"host", b"")], False),
        ([(b"host", b"evil.example")], False),
        ([(b"host", b"localhost.evil.example")], False),
        ([(b"host", b"localhost@evil.example")], False),
        ([(b"host", b"0.0.0.0:8000")], False),
        ([(b"host", b"[")], False),
        ([(b"host", b"\xff")], False),
        ([(b"host", b"localhost"), (b"host", b"evil.example")], False),
        ([(b"host", b"localhost"), (b"origin", b"null")], False),
        ([(b"host", b"localhost"), (b"origin", b"http://evil.example")], False),
        ([(b"host", b"localhost"), (b"origin", b"http://localhost.evil.example")], False),
        ([(b"host", b"localhost"), (b"origin", b"")], False),
    ],
)
def test_only_those_who_call_it_by_its_name_are_let_in(headers: list[Any], let_in: bool) -> None:
    hosts = ("0.0.0.0", "lab.example")
    start, body = asked(
        {"type": "http", "headers": headers}, [{"type": "http.request", "body": b"{}"}], hosts=hosts
    )
    assert start["status"] == (200 if let_in else 403)
    assert let_in or "--allow NAME" in json.loads(body["body"])["detail"]
    opened, *_ = asked(
        {"type": "websocket", "headers": headers}, [{"type": "websocket.connect"}], hosts=hosts
    )
    assert opened["type"] == ("websocket.accept" if let_in else "websocket.close")


HUGE = b"1" + b"0" * 30
WRONG = [
    (b'{"seed": ' + HUGE + b"}", f"seed: got {HUGE.decode()}, expected a number less than or equal to"),
    (b'{"seed": -1}', "seed: got -1, expected a number greater than or equal to 0"),
    *(
        (b'{"seed": ' + odd + b"}", "seed: got")
        for odd in (b'"7"', b"true", b"1.5", b"[1]", b"{}", b'"\\ud800"')
    ),
    (b'{"test_episode": 500}', "test_episode: got 500, expected a number less than 500"),
    (b'{"test_episode": 1000000000}', "test_episode: got 1000000000"),
    (b'{"episode_id": 7}', "episode_id: got 7"),
    (b'{"sead": 7}', "sead: there is no such key"),
    (b"[1]", "got [1], expected an object"),
    (b'{"seed": NaN}', "NaN is no number"),
    (b'{"seed": 1e999}', "seed: got inf"),
    (b"[" * 100_000, "nested too deep"),
    (b"{", "got what is no JSON"),
    (b"\xff\xfe", "got what is no JSON"),
]


@pytest.mark.parametrize(("body", "wrong"), WRONG, ids=range(len(WRONG)))
def test_a_wrong_beginning_is_answered_with_what_is_wrong(body: bytes, wrong: str) -> None:
    status, told = posted(body)
    assert status == 422
    assert wrong in json.loads(told)["detail"]
    if body.isascii():
        (answer, again) = said(f'{{"type": "reset", "data": {body.decode()}}}', '{"type": "reset"}')
        assert json.loads(answer)["data"]["code"] == "VALIDATION_ERROR"
        assert again == "played"


def test_the_help_names_the_time_of_silence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--help"]) == 0
    assert f"(default: {IDLE:g})" in " ".join(capsys.readouterr().out.split())


def test_what_is_right_passes_as_it_is() -> None:
    for body in (b"", b"{}", b'{"seed": 7, "episode_id": "a"}', b'{"test_episode": 499}'):
        assert posted(body) == (200, body.decode())
    assert posted(b'{"action": {"message": "Act: left"}}', "/step")[0] == 200
    assert posted(b'{"action": 7}', "/step") == (422, '{"detail": "action: got 7, expected an object"}')
    assert posted(b"x" * (MOST_BYTES + 1))[0] == 413
    step = '{"type": "step", "data": {"message": "\\ud800"}}'
    assert said('{"type": "reset", "data": {"seed": 1}}', step, '{"type": "state"}') == ["played"] * 3
    assert posted(b'{"episode_id": "\\ud800"}') == (200, '{"episode_id": "?"}'), "half a character is none"


@pytest.mark.parametrize(
    "odd",
    [
        "{",
        "7",
        "null",
        "[]",
        '{"type": "state", "data": {}}',
        b"\x00\xff",
        '{"type": "fly"}',
        '{"type": "step"}',
        "[" * 99_999,
    ],
)
def test_what_is_no_message_is_answered_and_the_session_goes_on(odd: Any) -> None:
    answer, again = said(odd, '{"type": "state"}')
    assert json.loads(answer)["type"] == "error"
    assert json.loads(answer)["data"]["message"]
    assert again == "played"


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | st.just("\ud800"),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from("type data seed test_episode episode_id message".split()), inner)
    ),
    max_leaves=8,
)
MESSAGES = st.builds(
    lambda kind, data: {"type": kind, "data": data}, st.sampled_from("reset step state mcp".split()), JSON
)


@given(st.lists((JSON | MESSAGES).map(json.dumps) | st.binary(max_size=9) | st.text(max_size=9), max_size=4))
@settings(max_examples=150, deadline=None)
def test_whatever_is_sent_is_played_or_answered(messages: list[str | bytes]) -> None:
    answers = said(*messages)
    assert len(answers) == len(messages)
    assert all(answer == "played" or json.loads(answer)["data"]["message"] for answer in answers)


@given(
    JSON.map(json.dumps).map(str.encode) | st.binary(max_size=20),
    st.sampled_from(["/reset", "/step", "/mcp"]),
)
@settings(max_examples=150, deadline=None)
def test_whatever_is_posted_passes_or_is_answered(body: bytes, path: str) -> None:
    status, told = posted(body, path)
    assert status == 200 or (status == 422 and json.loads(told)["detail"])
