"""`socialai evaluate llm:MODEL`: any endpoint, its faults, its costs, and going on where it was stopped."""

import base64
import gzip
import json
import random
import re
import time
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl import load
from socialai_dsl.checking.briefing import UNTOLD
from socialai_dsl.cli.main import main
from socialai_dsl.envs.asking import Question
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.episode import scripted_reply
from socialai_dsl.runs.folder import scenario_folder_name
from tests.quick import one_in
from tests.socialai_dsl.llm.endpoint import completion, endpoint, slowly, stream

pytest.importorskip("httpx", reason="language models need the extra llm")

Capture = pytest.CaptureFixture[str]
SECRET = "sk-very-secret"


@pytest.fixture(autouse=True)
def surroundings(monkeypatch: pytest.MonkeyPatch) -> None:
    """A key in the environment, no time to wait for, and no word about progress, however slow the machine is."""
    monkeypatch.setenv("OPENAI_API_KEY", SECRET)
    monkeypatch.setattr("socialai_dsl.evaluation.language_model._SECONDS_BETWEEN_LINES", 1e9)
    monkeypatch.setattr("socialai_dsl.llm.endpoint._FIRST_WAIT", 0.001)


def evaluate(url: str, out: Path, *more: str, on: str = "talkitout", episodes: int = 3) -> int:
    arguments = [
        "--on",
        on,
        "--episodes",
        str(episodes),
        "--base-url",
        url,
        "--out",
        str(out),
        "--record",
        "0",
        "--probes",
        "off",
    ]
    return main(["evaluate", "llm:stub", *arguments, *more])


def figures(out: Path, scenario: str = "talkitout") -> Any:
    return json.loads((out / scenario_folder_name(scenario) / "result.json").read_text(encoding="utf-8"))


def transcript(out: Path, number: int = 0, scenario: str = "talkitout") -> list[dict[str, Any]]:
    path = out / scenario_folder_name(scenario) / f"transcripts/episode-{number:03d}.jsonl"
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def script(scenario: str) -> Any:
    """A model that plays the scenario's script: it recognises the episode by its first observation."""
    playing: dict[str, Episode] = {}
    for number in range(10):
        episode = Episode(f"{scenario}+oracle")
        playing[episode.reset(test_episode=number)] = episode

    def respond(request: dict[str, Any]) -> str:
        episode = playing[request["messages"][1]["content"]]
        reply = scripted_reply(episode)
        episode.step(reply)
        return f"Let me think.\n{reply}"

    return respond


@pytest.mark.thorough("plays many episodes in text")
def test_a_model_that_knows_the_script_does_what_the_script_does(tmp_path: Path, capsys: Capture) -> None:
    assert main(["evaluate", "oracle", "--on", "talkitout", "--episodes", "8", "--json"]) == 0
    (expected,) = json.loads(capsys.readouterr().out)
    with endpoint(script("talkitout")) as stub:
        assert (
            evaluate(
                stub.url, tmp_path, "--history", "1000", "--concurrency", "3", "--record", "1", episodes=8
            )
            == 0
        )
    printed = capsys.readouterr().out
    result = figures(tmp_path)
    same = ("success_rate", "mean_length", "mean_return", "outcomes")
    assert {key: result["eval"][key] for key in same} == {key: expected["eval"][key] for key in same}
    assert result["agent"] == "llm:stub"
    assert result["eval"]["rules"] == pytest.approx(
        {r: expected["eval"]["rules"][r] for r in result["eval"]["rules"]}
    )
    replies = len(stub.requests)
    assert (result["eval"]["replies"], result["eval"]["invalid_replies"]) == (replies, 0)
    assert (result["eval"]["prompt_tokens"], result["eval"]["cost"]) == (10 * replies, None)
    assert list((tmp_path / "talkitout").glob("success-*.gif"))
    assert f"{10 * replies:,} read and {2 * replies:,} written" in printed


def test_a_session_of_several_trials_is_one_conversation(tmp_path: Path, capsys: Capture) -> None:
    """The model is shown all of the session, is told how episodes ended, and results are told by trial."""
    with endpoint(lambda request: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path, "--trials", "2", on="dance", episodes=4) == 0
        asked = len(stub.requests)
        assert evaluate(stub.url, tmp_path, "--trials", "2", on="dance", episodes=4) == 0
        assert len(stub.requests) == asked, "what was played is read from the transcripts"
        assert evaluate(stub.url, tmp_path, on="dance", episodes=4) == 2, "these transcripts are of sessions"
    assert "another trials" in capsys.readouterr().err
    told = [[message["content"] for message in request["messages"]] for request in stub.requests]
    assert all("You play 2 episodes in a row" in messages[0] for messages in told)
    longest = max(told, key=len)
    assert longest[1].startswith("Episode 1 of 2 begins")
    second = [text for text in longest if "Episode 2 of 2 begins" in text]
    assert len(second) == 1
    assert "The episode is over" in second[0].split("Episode 2 of 2 begins")[0]
    assert len(longest) == 2 * 2 * 20, "system, and two messages for each step of two episodes but the last"
    result = figures(tmp_path, "dance")
    assert result["trials"] == 2
    assert [trial["episodes"] for trial in result["eval"]["trials"]] == [2, 2]


TOLD = """\
scenario: told
about: The hypothesis is not told.
instructions: {en: Go., de: Geh.}
horizon: 3
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 5}
cast: {agent: {}}
outcome: [{success: t == 2}]
"""


def test_a_request_holds_the_whole_episode_or_says_what_it_leaves_out(tmp_path: Path) -> None:
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path / "whole", episodes=1) == 0
    whole = [message["content"] for message in stub.requests[-1]["messages"]]
    assert len(whole) == 2 * 100
    assert not [text for text in whole if "left out" in text]
    assert figures(tmp_path / "whole")["eval"]["actions"] == "prose and text, the whole episode"

    with endpoint(lambda _: "Act: left") as stub:
        options = ["--history", "3", "--temperature", "0.5", "--max-tokens", "50", "--goal", "Leave."]
        assert evaluate(stub.url, tmp_path, *options, "--concurrency", "1", episodes=1) == 0
    assert len(stub.requests) == 100
    last = stub.requests[-1]
    assert [message["role"] for message in last["messages"]] == ["system", *["user", "assistant"] * 2, "user"]
    assert last["messages"][0]["content"].endswith("Leave.")
    assert {key: figures(tmp_path)[key] for key in ("tell", "told", "view")} == {
        "tell": "goal",
        "told": "Leave.",
        "view": "seat",
    }
    manner = "prose and text, 3 observations, temperature 0.5, max tokens 50"
    assert figures(tmp_path)["eval"]["actions"] == manner
    assert last["messages"][2]["content"] == "Act: left"
    lines = sum(text.count("\n") + 1 for text in whole[1:-6:2])
    told = f"(97 earlier turns are left out here, {lines} lines of what you saw and heard.)\n\n"
    assert [message["content"] for message in last["messages"][1:]] == [told + whole[-5], *whole[-4:]]
    assert (last["model"], last["temperature"], last["max_tokens"]) == ("stub", 0.5, 50)
    assert "temperature" in stub.requests[0]
    records = transcript(tmp_path)
    assert len(records) == 100
    assert records[0]["reply"] == "Act: left"


def test_instructions_are_told_in_a_language_and_recorded(tmp_path: Path, capsys: Capture) -> None:
    """With other words, or none, the same folder holds other episodes."""
    scenario = tmp_path / "told.yaml"
    scenario.write_text(TOLD, encoding="utf-8")
    told = {}
    for name, options in (("own", []), ("german", ["--language", "de"]), ("nothing", ["--tell", "nothing"])):
        with endpoint(lambda _: "Act: left") as stub:
            command = [
                "evaluate",
                "llm:stub",
                "--base-url",
                stub.url,
                "--on",
                str(scenario),
                "--episodes",
                "1",
            ]
            assert main([*command, "--out", str(tmp_path / name), *options]) == 0
        result = json.loads((tmp_path / name / "told" / "result.json").read_text(encoding="utf-8"))
        settings = json.loads((tmp_path / name / "told" / "transcripts" / "settings.json").read_text("utf-8"))
        told[name] = {key: result[key] for key in ("tell", "told", "language") if key in result}
        assert told[name] == {key: settings[key] for key in ("tell", "told", "language") if key in settings}
        system = stub.requests[0]["messages"][0]["content"]
        assert system.endswith(
            f"An episode ends with success, with failure, or after 3 turns. {told[name].get('told', UNTOLD)}"
        )
        assert "hypothesis" not in system
    assert told == {
        "own": {"tell": "instructions", "told": "Go.", "language": "en"},
        "german": {"tell": "instructions", "told": "Geh.", "language": "de"},
        "nothing": {"tell": "nothing"},
    }
    capsys.readouterr()
    assert main([*command, "--out", str(tmp_path / "own"), "--language", "de"]) == 2
    assert "language, told; choose another folder" in capsys.readouterr().err


def test_json_and_tools(tmp_path: Path) -> None:
    with endpoint(lambda _: '{"move": "left", "say": null}') as stub:
        assert evaluate(stub.url, tmp_path / "json", "--mode", "json", episodes=1) == 0
    schema = stub.requests[0]["response_format"]["json_schema"]["schema"]
    assert "Open sesame" in schema["properties"]["say"]["enum"]
    assert figures(tmp_path / "json")["eval"]["invalid_replies"] == 0

    call = {"id": "7", "type": "function", "function": {"name": "move", "arguments": '{"direction": "left"}'}}
    with endpoint(lambda _: {"role": "assistant", "content": None, "tool_calls": [call]}) as stub:
        assert evaluate(stub.url, tmp_path / "tools", "--mode", "tools", episodes=1) == 0
    assert [tool["function"]["name"] for tool in stub.requests[0]["tools"]] == ["move", "say"]
    roles = [message["role"] for message in stub.requests[1]["messages"]]
    assert roles == ["system", "user", "assistant", "tool", "user"]
    assert figures(tmp_path / "tools")["eval"]["invalid_replies"] == 0

    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path / "grammar", "--grammar", episodes=1) == 0
    assert stub.requests[0]["grammar"].startswith('root ::= "Act: "')


def test_calls_that_are_none_are_repeated_as_servers_take_them(tmp_path: Path) -> None:
    """Servers refuse a conversation in which a tool has no name, or arguments that are no object."""
    given: Any = [
        ("move", '{"direction": "le'),
        ("move", '["left"]'),
        ("move", json.dumps({"direction": "left " * 2000})),
        ("", "{}"),
        ("functions.move <|x|>" * 9, '{"direction": "left"}'),
        ("move", '{"direction": "left"}'),
    ]

    def answer(request: dict[str, Any]) -> Any:
        said = [call["function"] for m in request["messages"] for call in m.get("tool_calls", ())]
        for one in said:
            if not re.fullmatch("[a-zA-Z0-9_-]{1,64}", one["name"]) or not isinstance(parsed(one), dict):
                return 400, {}, b'{"error": {"message": "no call of a tool"}}'
        name, arguments = given[min(len(said), len(given) - 1)]
        call = {"id": "7", "type": "function", "function": {"name": name, "arguments": arguments}}
        return {"role": "assistant", "content": None, "tool_calls": [call]}

    def parsed(call: dict[str, Any]) -> Any:
        try:
            return json.loads(call["arguments"])
        except ValueError:
            return None

    with endpoint(answer) as stub:
        assert evaluate(stub.url, tmp_path, "--mode", "tools", episodes=1) == 0
    assert figures(tmp_path)["eval"]["invalid_replies"] == len(given) - 1


FAULTS: dict[str, Any] = {
    "rate limit": (429, {"Retry-After": "0.01"}, b'{"error": {"message": "slow down"}}'),
    "server error": (500, {}, b"Internal Server Error"),
    "cut off": (200, {"Content-Length": "5000"}, completion("Act: left")),
    "cut between chunks": (
        200,
        {"Transfer-Encoding": "chunked"},
        [b"14\r\n" + completion("Act: left")[:20] + b"\r\n"],
    ),
    "cut in a chunk": (200, {"Transfer-Encoding": "chunked"}, [b"14\r\n" + completion("Act: left")[:10]]),
    "cut, but closed well": (200, {}, completion("Act: left")[:90]),
    "not JSON": (200, {}, b"<html>busy</html>"),
    "no choices": (200, {}, b'{"choices": []}'),
    "binary": (200, {}, bytes(range(256))),
    "deep": (200, {}, b"[" * 100_000),
    "odd date": (503, {"Retry-After": "Mon, 01 Jan 0001 00:00:00"}, b""),
    "no time": (429, {"Retry-After": "nan"}, b""),
    "empty body": (200, {}, b""),
    "a list": (200, {}, b"[1]"),
    "hung up": None,
    "wrong types": (200, {}, b'{"choices": [{"message": {"content": 7}}]}'),
}


@pytest.mark.parametrize("fault", one_in(4, FAULTS, "plays a command"))
def test_what_passes_is_waited_for(fault: str, tmp_path: Path) -> None:
    count = 0

    def respond(_: Any) -> Any:
        nonlocal count
        count += 1
        return FAULTS[fault] if count % 3 == 2 else "Act: done"

    with endpoint(respond) as stub:
        assert evaluate(stub.url, tmp_path) == 0
    result = figures(tmp_path)["eval"]
    assert (result["episodes"], result["replies"], result["invalid_replies"]) == (3, 3, 0)
    assert len(stub.requests) > 3


STALLS: dict[str, Any] = {
    "before the answer": lambda: time.sleep(3) or "Act: left",
    "after its head": lambda: (200, {}, slowly([completion("Act: left")], 3)),
    "drip by drip": lambda: (200, {}, slowly([b" "] * 100 + [completion("Act: left")], 0.03)),
}


@pytest.mark.parametrize("stall", one_in(3, STALLS, "waits for time-outs"))
def test_an_answer_that_takes_too_long_is_asked_for_again(stall: str, tmp_path: Path) -> None:
    with endpoint(lambda _: STALLS[stall]() if len(stub.requests) == 2 else "Act: done") as stub:
        assert evaluate(stub.url, tmp_path, "--timeout", "0.3", "--concurrency", "1") == 0
    assert len(stub.requests) > 3
    assert (figures(tmp_path)["eval"]["replies"], figures(tmp_path)["eval"]["invalid_replies"]) == (3, 0)


def test_an_endpoint_that_never_answers_ends_the_command(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: STALLS["before the answer"]()) as stub:
        assert evaluate(stub.url, tmp_path, "--timeout", "0.1", episodes=1) == 2
    assert "it took longer than 0.1 s" in capsys.readouterr().err
    assert len(stub.requests) == 2


def test_lost_connections_do_not_make_an_address_wrong(tmp_path: Path) -> None:
    replies = iter([None, None])
    with endpoint(lambda _: next(replies, "Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    assert len(stub.requests) == 3


def test_answers_without_an_action_count_as_invalid(tmp_path: Path) -> None:
    replies = iter([{"content": ""}, {"content": None, "refusal": "I cannot do that."}, "x" * 100_000])
    with endpoint(lambda _: next(replies, "Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    result = figures(tmp_path)["eval"]
    assert (result["replies"], result["invalid_replies"], result["stops"]) == (4, 2, {"refusal": 1})
    assert max(len(json.dumps(request)) for request in stub.requests) < 20_000


ODD: dict[str, Any] = {
    "no choices": b'{"choices": []}',
    "null": b'{"choices": null}',
    "wrong types": b'{"choices": [{"message": {"content": 7}}]}',
    "no message": b'{"choices": [{"message": null, "finish_reason": {}}], "usage": [1]}',
    "too long": b'{"choices": [{"message": {"content": "' + b"x" * 4_000_000 + b'"}}]}',
}


@pytest.mark.parametrize("odd", one_in(2, ODD, "plays a command"))
def test_a_completion_without_a_message_counts_apart(odd: str, tmp_path: Path, capsys: Capture) -> None:
    """Also the first answer of a server, and one that no further try improves."""
    with endpoint(
        lambda request: (200, {}, ODD[odd]) if len(request["messages"]) == 2 else "Act: done"
    ) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    found = figures(tmp_path)["eval"]
    assert (found["replies"], found["invalid_replies"], found["stopped_replies"]) == (2, 0, 1)
    (stop,) = found["stops"]
    assert stop == transcript(tmp_path)[0]["stop"] == ("length" if odd == "too long" else "unreadable")
    assert f"{stop} 1; 1 of them without an action, apart from the invalid ones" in capsys.readouterr().out


def test_replies_that_the_server_ends_count_apart(tmp_path: Path, capsys: Capture) -> None:
    filtered = b'{"error": {"code": "content_filter", "message": "The response was filtered."}}'
    replies = iter(
        [
            (200, {}, completion({"content": "I see a", "reasoning_content": "Hm. Act: left"}, "length")),
            (200, {}, completion("Act: left", "length")),
            (200, {}, completion("", "content_filter")),
            (400, {}, filtered),
            {"content": None, "refusal": "No."},
        ]
    )
    with endpoint(lambda _: next(replies, "Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    found = figures(tmp_path)["eval"]
    assert (found["replies"], found["invalid_replies"], found["stopped_replies"]) == (6, 0, 4)
    assert found["stops"] == {"content_filter": 2, "length": 2, "refusal": 1}
    assert "content_filter 2, length 2, refusal 1; 4 of them without an action" in capsys.readouterr().out
    first, second, *_ = transcript(tmp_path)
    assert (first["reasoning"], first["stop"], first["finish_reason"]) == (
        "Hm. Act: left",
        "length",
        "length",
    )
    assert "the server cut your reply off" in second["observation"]
    assert "Hm." not in json.dumps(stub.requests[-1])


def forever(piece: bytes) -> Any:
    """Goes on until nobody listens."""
    while True:
        yield piece


def test_a_server_that_streams_is_read_to_its_end(tmp_path: Path) -> None:
    with endpoint(lambda _: stream("Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    found = figures(tmp_path)["eval"]
    assert (found["replies"], found["prompt_tokens"], found["completion_tokens"]) == (1, 10, 2)


ENDLESS = {
    "events": stream("Act: ")[2].split(b"\n\n")[0] + b"\n\n",
    "comments": b": ping\n\n" * 1000,
    "blanks": b" " * 4096,
    "HTML": b"<p>Please wait</p>" * 100,
}


@pytest.mark.parametrize("what", one_in(2, ENDLESS, "reads much"))
def test_a_server_that_streams_for_ever_is_left(what: str, tmp_path: Path, capsys: Capture) -> None:
    """What begins like a reply was too long; anything else is none, and nothing is lost by either."""
    with endpoint(
        lambda request: "Act: left" if len(request["messages"]) < 6 else (200, {}, forever(ENDLESS[what]))
    ) as stub:
        code = evaluate(stub.url, tmp_path, "--on-invalid", "fail", episodes=1)
    if what in ("events", "comments"):
        assert code == 0
        assert figures(tmp_path)["eval"]["stops"] == {"length": 1}
    else:
        assert code == 2
        said = capsys.readouterr().err
        assert "the answer is no completion" in said
        assert said.count("\n") == 1
    assert [record["reply"] for record in transcript(tmp_path)][:2] == ["Act: left", "Act: left"]


FULL = {
    "OpenAI": (400, {}, b'{"error": {"message": "Too much.", "code": "context_length_exceeded"}}'),
    "vLLM": (
        400,
        {},
        b'{"object": "error", "message": "This model\'s maximum context length is 4096 tokens."}',
    ),
    "llama.cpp": (400, {}, b'{"error": {"message": "No.", "type": "exceed_context_size_error"}}'),
    "Anthropic": (400, {}, b'{"error": {"message": "prompt is too long: 208310 tokens > 200000 maximum"}}'),
    "TGI": (422, {}, b'{"error": "Input validation error: `inputs` must have less than 4096 tokens."}'),
    "Gemini": (400, {}, b'[{"error": {"message": "The input token count (9) exceeds the maximum number"}}]'),
    "without JSON": (413, {}, b"the request exceeds the available context size"),
}


@pytest.mark.parametrize("server", one_in(3, FULL, "plays a command"))
def test_a_full_context_ends_its_episode_and_no_other(server: str, tmp_path: Path, capsys: Capture) -> None:
    def respond(request: dict[str, Any]) -> Any:
        long = len(request["messages"]) > 8 and len(stub.requests) < 20
        return FULL[server] if long else "Act: left" if len(stub.requests) < 20 else "Act: done"

    with endpoint(respond) as stub:
        assert evaluate(stub.url, tmp_path, "--concurrency", "1", "--record", "2") == 0
        asked = len(stub.requests)
        found = figures(tmp_path)["eval"]
        full = round(3 * found["outcomes"]["context full"])
        assert full >= 1
        assert (found["episodes"], found["invalid_replies"], found["stopped_replies"]) == (3, 0, 0)
        assert found["stops"] == {"context": full}
        assert transcript(tmp_path)[-1]["stop"] == "context"
        assert "a conversation longer than the model's context" in capsys.readouterr().out
        assert evaluate(stub.url, tmp_path, "--concurrency", "1") == 0
    assert len(stub.requests) == asked, "nothing is asked again"
    ended = [
        trace["moments"][-1]["ended"]["name"] for trace in episodes_in(tmp_path / "talkitout/episode.html")
    ]
    assert "context full" in ended


def test_a_context_that_not_even_a_beginning_fits_in_is_told_of(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: FULL["OpenAI"]) as stub:
        assert evaluate(stub.url, tmp_path) == 2
    assert "status 400: Too much." in capsys.readouterr().err


def test_a_rate_limit_is_no_full_context(tmp_path: Path) -> None:
    limit = (
        b'{"error": {"message": "Request too large: 9000 tokens per minute", "code": "rate_limit_exceeded"}}'
    )
    replies = iter(["Act: left", (429, {}, limit)])
    with endpoint(lambda _: next(replies, "Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    assert figures(tmp_path)["eval"]["stops"] == {}


def test_thoughts_are_taken_away_before_anything_else(tmp_path: Path) -> None:
    thoughts = "<think>" + "What if I say Act: forward? " * 400 + "</think>"
    with endpoint(lambda request: thoughts + ("" if len(request["messages"]) == 2 else "Act: done")) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    found = figures(tmp_path)["eval"]
    assert (found["replies"], found["invalid_replies"]) == (2, 1)
    assert transcript(tmp_path)[0]["reply"] == thoughts
    assert "What if" not in json.dumps(stub.requests[1])


def test_a_reply_without_an_action_may_end_the_episode(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "no") as stub:
        assert evaluate(stub.url, tmp_path, "--on-invalid", "fail", "--record", "2") == 0
    assert figures(tmp_path)["eval"]["outcomes"]["invalid reply"] == 1
    assert "a reply without an action" in capsys.readouterr().out


def test_a_failure_loses_nothing_and_the_same_command_goes_on(tmp_path: Path, capsys: Capture) -> None:
    def respond(_: Any) -> Any:
        return (
            "Act: left"
            if len(stub.requests) <= 130
            else (401, {}, f'{{"error": "{SECRET} has no money"}}'.encode())
        )

    with endpoint(respond) as stub:
        assert evaluate(stub.url, tmp_path, "--concurrency", "1") == 2
        first = stub.url
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "model 'stub' at http://127.0.0.1:" in error
    assert "status 401" in error
    assert "are kept in" in error
    assert "not asked for again" in error
    assert not (tmp_path / "talkitout" / "result.json").exists()
    # A line that was being written when the power went.
    torn = tmp_path / "talkitout/transcripts/episode-001.jsonl"
    with open(torn, "a", encoding="utf-8") as file:
        file.write('{"reply": "Act: le')
    content = torn.read_bytes()
    assert main(["replay", str(tmp_path / "talkitout"), "-o", str(tmp_path / "page.html")]) == 0
    assert torn.read_bytes() == content, "who reads changes nothing"

    settings = tmp_path / "talkitout/transcripts/settings.json"
    with endpoint(lambda _: "Act: left") as stub:
        settings.write_text(settings.read_text().replace(first, stub.url))
        assert evaluate(stub.url, tmp_path, "--concurrency", "1") == 0
    assert len(stub.requests) == 300 - 130
    assert figures(tmp_path)["eval"]["replies"] == 300


@pytest.mark.thorough("several commands")
def test_a_budget_is_kept_to_and_can_be_added_to(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path, "--budget", "1_800", "--concurrency", "1") == 4
        assert len(stub.requests) == 150
        assert "1 of 3 episodes are over" in capsys.readouterr().err
        money = ["--budget", "0.000695 usd", "--prices", "0.5,1.0", "--concurrency", "1"]
        assert evaluate(stub.url, tmp_path, *money) == 4
        assert len(stub.requests) == 150 + 100
        assert evaluate(stub.url, tmp_path) == 0
    assert figures(tmp_path)["eval"]["replies"] == 300


def test_a_spent_budget_counts_every_episode_that_is_over(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path, on="dance") == 0
        first = tmp_path / "dance/transcripts/episode-000.jsonl"
        first.write_text("".join(first.read_text().splitlines(keepends=True)[:-2]))
        capsys.readouterr()
        asked = len(stub.requests)
        assert evaluate(stub.url, tmp_path, "--budget", "1", on="dance") == 4
        assert len(stub.requests) == asked + 1
    assert "2 of 3 episodes are over" in capsys.readouterr().err


def test_without_a_count_four_characters_of_what_the_model_wrote_are_a_token(tmp_path: Path) -> None:
    written = {"role": "assistant", "reasoning": "I wonder. " * 8, "content": "Act: done"}
    answer = {"choices": [{"index": 0, "message": written, "finish_reason": "stop"}], "id": "long" * 500}
    with endpoint(lambda _: (200, {}, json.dumps(answer).encode())) as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    found = figures(tmp_path)["eval"]
    assert (found["tokens_estimated"], found["completion_tokens"]) == (True, (80 + 9) // 4)
    assert found["prompt_tokens"] == len(json.dumps(stub.requests[0]["messages"])) // 4


def test_other_settings_need_another_folder(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path) == 0
        assert evaluate(stub.url, tmp_path, "--style", "grid", "--history", "2") == 2
    assert "played with another history, style; choose another folder" in capsys.readouterr().err


def test_episodes_of_another_text_are_kept_and_not_continued(tmp_path: Path, capsys: Capture) -> None:
    settings = tmp_path / "talkitout/transcripts/settings.json"
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
        assert figures(tmp_path)["eval"]["text"] == TextView.version
        content = json.loads(settings.read_text())
        assert content["text"] == TextView.version
        settings.write_text(json.dumps({**content, "text": TextView.version - 1}))
        assert evaluate(stub.url, tmp_path, episodes=2) == 2
    assert "played with another text; choose another folder" in capsys.readouterr().err
    assert main(["replay", str(tmp_path / "talkitout"), "--out", str(tmp_path / "page.html")]) == 0


def test_the_key_is_sent_and_appears_nowhere(tmp_path: Path, capsys: Capture, caplog: Any) -> None:
    caplog.set_level("DEBUG")
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path) == 0
        assert evaluate(stub.url.replace("http://", f"http://user:{SECRET}@"), tmp_path) == 2
    assert set(stub.keys) == {f"Bearer {SECRET}"}
    printed = capsys.readouterr()
    assert SECRET not in printed.out + printed.err + caplog.text
    assert not [
        path for path in tmp_path.rglob("*") if path.is_file() and SECRET.encode() in path.read_bytes()
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--base-url", "localhost:1"], "--base-url: got 'localhost:1', expected one such as http"),
        (["--base-url", "ftp://x"], "--base-url: got 'ftp://x'"),
        (
            ["--base-url", "http://127.0.0.1:1/v1"],
            "model 'm' at http://127.0.0.1:1/v1/chat/completions: no connection",
        ),
        (
            ["--key-from", "NO_SUCH_KEY"],
            "api.openai.com asks for a key, and the environment has none in NO_SUCH_KEY",
        ),
        (["--budget", "much"], "--budget: got 'much', expected an amount such as 200000 or 2.50usd"),
        (["--base-url", "http://127.0.0.1:99999/v1"], "--base-url: got 'http://127.0.0.1:99999/v1'"),
        (["--base-url", "http://[::1"], "--base-url: got 'http://[::1'"),
        (["--goal", "\udcff"], "--goal: got '\\udcff', expected a text in Unicode"),
        (["--budget", "1usd"], "--budget: an amount of money needs --prices"),
        (
            ["--prices", "1"],
            "--prices: got '1', expected two amounts such as 0.15,0.60, or a table such as prices.yaml",
        ),
        (["--prices", "nan,1"], "--prices: got 'nan,1', expected two amounts"),
        (["--prices", "none.yaml"], "--prices: none.yaml:1:1: S007 there is no such file"),
    ],
)
def test_mistakes_are_told_in_one_line(
    arguments: list[str], said: str, tmp_path: Path, capsys: Capture
) -> None:
    command = ["evaluate", "llm:m", "--on", "help", "--episodes", "1", "--out", str(tmp_path), *arguments]
    assert main(command) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("gpt-5: [1.25, 10]\nmm: [1, 2]", "prices.yaml has no prices of the model 'm'; it has gpt-5, mm"),
        ("M: [1, 2]", "prices.yaml has no prices of the model 'm'; it has M"),
        ("", "prices.yaml:1:1: got empty, expected models by name"),
        ("- m", "prices.yaml:1:1: got a list, expected models by name"),
        ("m: [1]", "prices.yaml:1:4: got [1], expected two amounts such as [0.15, 0.60]"),
        ("m: 1,2", "prices.yaml:1:4: got '1,2', expected two amounts such as [0.15, 0.60]"),
        ("m: [1, -2]", "prices.yaml:1:4: got [1, -2], expected two amounts such as [0.15, 0.60]"),
        ("m: [1, true]", "prices.yaml:1:4: got [1, True], expected two amounts such as [0.15, 0.60]"),
        ("m: [1, 2", "prices.yaml:1:4: S001 not YAML: "),
    ],
)
def test_a_table_of_prices_has_two_amounts_for_the_model(
    table: str, said: str, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("prices.yaml").write_text(table, encoding="utf-8")
    with endpoint(lambda _: "Act: done") as stub:
        command = ["evaluate", "llm:m", "--base-url", stub.url, "--on", "help", "--out", "out"]
        assert main([*command, "--episodes", "1", "--prices", "prices.yaml"]) == 2
    error = capsys.readouterr().err
    assert f"--prices: {said}" in error
    assert error.count("\n") == 1
    assert not stub.requests
    assert not Path("out").exists()


def test_a_table_has_the_prices_of_each_model_of_a_game(tmp_path: Path) -> None:
    table = tmp_path / "prices.yaml"
    table.write_text(
        "stub: [1, 2]  # dollars for a million tokens\norg/other:8b: [10, 20]\n", encoding="utf-8"
    )
    with endpoint(lambda _: "Act: left") as stub:
        options = ["--seat", "jill=llm:org/other:8b", "--prices", str(table)]
        assert evaluate(stub.url, tmp_path / "out", *options, on="together/help_together", episodes=1) == 0
    found = figures(tmp_path / "out", "together/help_together")["eval"]
    jill = found["models"]["jill"]
    assert found["cost"] == pytest.approx(found["replies"] * (10 * 1 + 2 * 2) / 1e6)
    assert jill["cost"] == pytest.approx(jill["replies"] * (10 * 10 + 2 * 20) / 1e6)


def test_the_cost_of_replies_some_of_which_had_no_prices_is_not_known(tmp_path: Path) -> None:
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path, "--budget", "60", "--concurrency", "1", on="dance") == 4
        assert evaluate(stub.url, tmp_path, "--prices", "1,2", on="dance") == 0
    assert figures(tmp_path, "dance")["eval"]["cost"] is None


@pytest.mark.parametrize("time", ["0", "-1", "nan", "inf", "soon"])
def test_a_time_out_is_a_time(time: str, capsys: Capture) -> None:
    assert main(["evaluate", "llm:m", "--on", "help", "--timeout", time]) == 2
    assert (
        f"--timeout: expected a number of seconds above 0, at most 31622400, got '{time}'"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ((404, {}, b'{"error": {"message": "no such model: stub"}}'), "status 404: no such model: stub"),
        ((200, {}, b"<html>Welcome</html>"), "the answer is no completion: <html>Welcome</html>"),
        ((400, {}, b"\x1b[2Junknown field tools\n" * 100), "status 400: \\x1b[2Junknown field tools"),
        ((308, {"Location": "https://other/v1"}, b""), "status 308, moved to https://other/v1: nothing"),
    ],
)
def test_endpoints_that_are_none_are_told_of_at_once(
    answer: Any, said: str, tmp_path: Path, capsys: Capture
) -> None:
    with endpoint(lambda _: answer) as stub:
        assert evaluate(stub.url, tmp_path) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert len(stub.requests) <= 2 * 4


def test_a_folder_in_which_nothing_was_played_takes_other_settings(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever mistypes an address or a model corrects it, and need not clean up; `none` as a key is no secret."""
    options, game = ["--seat", "jill=llm:other"], "together/help_together"
    monkeypatch.setenv("OPENAI_API_KEY", "on")
    assert evaluate("http://127.0.0.1:1/v1", tmp_path, *options, on=game, episodes=1) == 2
    error = capsys.readouterr().err
    assert "no connection" in error
    assert "kept" not in error
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path, *options, on=game, episodes=1) == 0
        assert evaluate(f"{stub.url}/v2", tmp_path, *options, on=game, episodes=1) == 2
    assert "played with another address" in capsys.readouterr().err


def test_progress_tells_of_costs(tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socialai_dsl.evaluation.language_model._SECONDS_BETWEEN_LINES", 0.0)
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path, "--prices", "1,2") == 0
    said = capsys.readouterr().err
    assert re.search(
        r"3 of 3 episodes, 0 successes, 0.0% invalid replies, 36 tokens, \$0.0000, 0 s left", said
    )


def episodes_in(page: Path) -> list[dict[str, Any]]:
    found = re.search(r'<script id="episodes"[^>]*>([^<]*)</script>', page.read_text(encoding="utf-8"))
    assert found is not None
    traces: list[dict[str, Any]] = json.loads(gzip.decompress(base64.b64decode(found.group(1))))
    return traces


def test_a_replay_shows_what_the_model_answered(tmp_path: Path, capsys: Capture) -> None:
    replies = iter(["I wonder.", "x" * 9000 + "\nAct: left", "Act: done"])
    with endpoint(lambda _: next(replies)) as stub:
        assert evaluate(stub.url, tmp_path, "--record", "1", "--on-invalid", "retry", episodes=1) == 0
    page = tmp_path / "talkitout" / "episode.html"
    assert str(page) in capsys.readouterr().out
    (trace,) = episodes_in(page)
    first, second = (moment["replies"] for moment in trace["moments"][1:])
    assert first[0]["text"] == "I wonder."
    assert first[0]["error"]
    assert first[1]["text"].startswith("… x")
    assert first[1]["text"].endswith("Act: left")
    assert "error" not in first[1]
    assert len(first[1]["text"]) < 1000
    assert second == [{"text": "Act: done"}]
    # The transcripts are enough: no model is asked.
    again = tmp_path / "again.html"
    assert main(["replay", str(page.parent), "-o", str(again)]) == 0
    assert episodes_in(again) == [trace]
    assert main(["replay", str(page.parent), "--test-episode", "1", "-o", str(again)]) == 2
    assert "--test-episode: got 1, expected less than 1" in capsys.readouterr().err


def test_a_replay_shows_a_reply_that_ended_the_episode(tmp_path: Path) -> None:
    replies = iter(["Act: left", "no"])
    with endpoint(lambda _: next(replies)) as stub:
        assert evaluate(stub.url, tmp_path, "--record", "1", "--on-invalid", "fail", episodes=1) == 0
    (trace,) = episodes_in(tmp_path / "talkitout" / "episode.html")
    _, step, end = trace["moments"]
    assert step["did"] == "left"
    assert "did" not in end
    assert end["replies"][0]["text"] == "no"
    assert end["ended"] == {"name": "invalid reply", "success": False, "text": "a reply without an action"}
    assert not list((tmp_path / "talkitout").glob("*.gif"))


def test_transcripts_of_another_scenario_are_not_replayed(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
    settings = tmp_path / "talkitout/transcripts/settings.json"
    settings.write_text(settings.read_text().replace('"program_sha256": "', '"program_sha256": "0'))
    command = ["replay", str(tmp_path / "talkitout"), "-o", str(tmp_path / "again.html")]
    assert main(command) == 2
    assert "holds episodes of another version of the scenario" in capsys.readouterr().err
    settings.write_text("[]")
    assert main(command) == 2
    assert "holds no transcripts of episodes" in capsys.readouterr().err


# -- probes ------------------------------------------------------------------------------------------------------------

BELIEF = "novel/sally_anne"
ALONE = ("--probes", "apart", "--concurrency", "1")


def knowing(scenario: str, answer: Any) -> Any:
    """A model that waits, and answers what `answer` makes of a question; episodes come one after the other."""
    following = Episode(scenario, probes=load(scenario))
    state: dict[str, Any] = {"number": -1}

    def respond(request: dict[str, Any]) -> str:
        if following.question is None and (state["number"] < 0 or following.result().ending):
            state["number"] += 1
            following.reset(test_episode=state["number"])
        asked = request["messages"][-1]["content"]
        if following.question is None:
            assert "A question, apart from your turns" not in asked
            following.step("Act: none")
            return "Act: none"
        question = following.question
        assert question.text in asked
        following.answer(question.right)
        return str(answer(question))

    return respond


def probes_of(out: Path, scenario: str = BELIEF) -> Any:
    return figures(out, scenario)["eval"]["probes"]


@pytest.mark.thorough("several commands")
def test_the_truth_is_right_and_a_wrong_answer_is_not(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(knowing(BELIEF, lambda question: f"Hm.\n**Answer: {question.right.upper()}**")) as stub:
        assert evaluate(stub.url, tmp_path / "right", *ALONE, on=BELIEF, episodes=2) == 0
    asked = {"asked": 2, "right": 2, "unread": 0, "chance": 0.5}
    assert probes_of(tmp_path / "right") == dict.fromkeys(("belief", "reality", "memory"), asked)
    assert "  belief   100.0% of 2 right, by chance 50.0%" in capsys.readouterr().out

    def other(question: Question) -> str:
        return next(answer for answer in question.answers if answer != question.right)

    with endpoint(knowing(BELIEF, lambda question: f"Answer: {other(question)}")) as wrong:
        assert evaluate(wrong.url, tmp_path / "wrong", *ALONE, on=BELIEF, episodes=2) == 0
    assert probes_of(tmp_path / "wrong")["belief"] == asked | {"right": 0}
    same = ("success_rate", "mean_length", "mean_return", "outcomes", "rules", "replies", "invalid_replies")
    results = [figures(tmp_path / name, BELIEF)["eval"] for name in ("right", "wrong")]
    assert [results[0][key] for key in same] == [results[1][key] for key in same]


@pytest.mark.thorough("plays many episodes in text")
def test_who_guesses_is_right_by_chance(tmp_path: Path) -> None:
    draw = random.Random(1)
    with endpoint(knowing("cointhief", lambda question: draw.choice(question.answers))) as stub:
        assert evaluate(stub.url, tmp_path, *ALONE, on="cointhief", episodes=30) == 0
    found = probes_of(tmp_path, "cointhief")
    assert found["belief"]["chance"] == pytest.approx(1 / 7)
    assert found["ignorance"]["chance"] == 0.5
    for score in found.values():
        chance = score["chance"]
        assert score["asked"] == 30
        assert abs(score["right"] / 30 - chance) < 4 * (chance * (1 - chance) / 30) ** 0.5


@pytest.mark.thorough("several commands")
def test_questions_stay_apart_from_play_unless_they_are_kept(tmp_path: Path) -> None:
    requests = {}
    for probes in ("apart", "kept", "off"):
        with endpoint(
            knowing(BELIEF, lambda _: "Answer: it's me") if probes != "off" else lambda _: "Act: none"
        ) as stub:
            options = ["--probes", probes, "--history", "1000", "--concurrency", "1"]
            assert evaluate(stub.url, tmp_path / probes, *options, on=BELIEF, episodes=1) == 0
        requests[probes] = [json.dumps(request["messages"]) for request in stub.requests]
    acted = [text for text in requests["apart"] if "apart from your turns" not in text]
    assert acted == requests["off"], "a model reads what it would without probes"
    assert len(requests["apart"]) == len(requests["off"]) + 3
    assert "apart from your turns" in requests["kept"][-1]
    assert "it's me" in requests["kept"][-1]
    assert probes_of(tmp_path / "kept")["belief"] == {"asked": 1, "right": 0, "unread": 1, "chance": 0.5}
    assert "probes" not in figures(tmp_path / "off", BELIEF)["eval"]


@pytest.mark.thorough("plays many episodes in text")
def test_answers_are_paid_for_once_and_count_for_the_budget(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(knowing(BELIEF, lambda question: f"Answer: {question.right}")) as stub:
        whole = tmp_path / "whole"
        assert evaluate(stub.url, whole, *ALONE, on=BELIEF, episodes=2) == 0
    expected = figures(whole, BELIEF)["eval"]
    assert expected["prompt_tokens"] == 10 * len(stub.requests)
    lines = (
        (whole / scenario_folder_name(BELIEF) / "transcripts/episode-000.jsonl")
        .read_text(encoding="utf-8")
        .splitlines()
    )
    at = next(number for number, line in enumerate(lines) if "probe" in json.loads(line))
    assert json.loads(lines[at])["probe"] == "belief"
    with endpoint(knowing(BELIEF, lambda question: f"Answer: {question.right}")) as again:
        calls = 0
        budget = 12 * (at + 2)  # two of three questions
        while evaluate(again.url, tmp_path / "parts", *ALONE, "--budget", f"{budget}", on=BELIEF, episodes=2):
            calls += 1
            assert "the budget is spent" in capsys.readouterr().err
            assert calls < 100
    assert calls >= 2
    assert len(again.requests) == len(stub.requests)
    resumed = figures(tmp_path / "parts", BELIEF)["eval"]
    assert resumed == expected


def test_other_probes_need_another_folder(tmp_path: Path, capsys: Capture) -> None:
    with endpoint(lambda _: "Act: done") as stub:
        assert evaluate(stub.url, tmp_path, episodes=1) == 0
        assert evaluate(stub.url, tmp_path, *ALONE, episodes=1) == 2
    assert "played with another probes" in capsys.readouterr().err


@pytest.mark.thorough("several commands")
def test_json_and_grammars_hold_answers_to_those_that_there_are(tmp_path: Path) -> None:
    with endpoint(lambda _: '{"move": "left", "say": null, "answer": "yes"}') as stub:
        assert evaluate(stub.url, tmp_path / "json", "--mode", "json", *ALONE, episodes=1) == 0
    schema = stub.requests[-1]["response_format"]["json_schema"]["schema"]
    assert schema["properties"]["answer"]["enum"] == ["no", "yes"]
    assert probes_of(tmp_path / "json", "talkitout")["promise"]["unread"] == 0
    call = {"id": "7", "type": "function", "function": {"name": "move", "arguments": '{"direction": "left"}'}}
    with endpoint(lambda _: {"role": "assistant", "content": "Answer: yes", "tool_calls": [call]}) as stub:
        assert evaluate(stub.url, tmp_path / "tools", "--mode", "tools", *ALONE, episodes=1) == 0
    assert "tools" not in stub.requests[-1]
    with endpoint(lambda _: "Act: left") as stub:
        assert evaluate(stub.url, tmp_path / "grammar", "--grammar", *ALONE, episodes=1) == 0
    assert stub.requests[-1]["grammar"] == 'root ::= "Answer: " ("no" | "yes")'


def test_scripts_are_not_asked(capsys: Capture) -> None:
    assert main(["evaluate", "oracle", "--on", BELIEF, "--episodes", "2", "--json"]) == 0
    assert "probes" not in json.loads(capsys.readouterr().out)[0]["eval"]


@pytest.mark.thorough("several commands")
def test_a_replay_passes_questions_over(tmp_path: Path) -> None:
    with endpoint(knowing(BELIEF, lambda question: f"Answer: {question.right}")) as stub:
        assert evaluate(stub.url, tmp_path, *ALONE, on=BELIEF, episodes=1) == 0
    assert (
        main(["replay", str(tmp_path / scenario_folder_name(BELIEF)), "-o", str(tmp_path / "again.html")])
        == 0
    )
    (trace,) = episodes_in(tmp_path / "again.html")
    told = [reply["text"] for moment in trace["moments"] for reply in moment.get("replies", ())]
    assert set(told) == {"Act: none"}
    assert len(told) == len(trace["moments"]) - 1
