"""What is written for OpenEnv and Inspect AI is executed in each run, with stand-ins where a library is missing."""

import asyncio
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from math import isnan
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from starlette.websockets import WebSocketDisconnect

import socialai_dsl.llm as llm
from socialai_dsl.checking.briefing import brief
from socialai_dsl.envs.factory import compiled, playable_of
from socialai_dsl.episodes.partners import beside
from socialai_dsl.frontend import load, load_experiment
from socialai_dsl.llm import Episode
from tests.socialai_dsl.llm.stand_ins import OPENENV, Model, TaskState, inspect_ai

with warnings.catch_warnings():  # some releases ask for another client
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

pytestmark = pytest.mark.filterwarnings("ignore")  # of the libraries
NAME = "testserver"  # how the client calls a server


@contextmanager
def imported(name: str, stand_ins: dict[str, ModuleType]) -> Iterator[Any]:
    """One of our modules, with stand-ins of what it imports; afterwards all of these are as they were.

    Other libraries that were imported meanwhile stay, since some cannot be imported twice.
    """
    before = dict(sys.modules)
    sys.modules.update(stand_ins)
    try:
        yield import_module(f"socialai_dsl.llm.{name}")
    finally:
        for made in [*stand_ins, *(one for one in sys.modules if one.startswith("socialai_dsl.llm."))]:
            del sys.modules[made]
        sys.modules.update(before)
        vars(llm).pop(name, None)


@pytest.fixture
def openenv() -> Iterator[Any]:
    with imported("openenv", {} if find_spec("openenv") else OPENENV) as module:
        yield module


@pytest.fixture
def client(openenv: Any) -> TestClient:
    return TestClient(openenv.application(beside([], "talkitout"), hosts=[NAME], idle=0.5))


def test_a_session_plays_an_episode(client: TestClient) -> None:
    alike = Episode("talkitout")
    with client.websocket_connect("/ws") as session:

        def say(kind: str, **data: Any) -> Any:
            session.send_json({"type": kind, **({"data": data} if kind != "state" else {})})
            return session.receive_json()["data"]

        assert "expected a reset first" in say("step", message="Act: left")["message"]
        assert "seed: got -1" in say("reset", seed=-1)["message"]
        told = say("reset", seed=7)["observation"]
        assert (told["text"], told["instructions"]) == (alike.reset(seed=7), alike.instructions)
        for reply in ("Act: left", '{"move": "left"}', "hm", "Act: done"):
            turn, told = alike.step(reply), say("step", message=reply)
            assert (told["observation"]["text"], told["done"]) == (turn.text, turn.done)
        assert (told["observation"]["success"], told["observation"]["ending"]) == (
            False,
            alike.result().ending,
        )
        state = say("state")
        assert (state["seed"], state["step_count"], state["invalid_replies"]) == (7, 4, 1)
        with pytest.raises(WebSocketDisconnect) as ended:
            session.receive_json()
        assert (ended.value.code, ended.value.reason) == (1001, "the session was silent for 0.5 s")


def test_a_request_that_cannot_be_done_is_answered_with_a_sentence(client: TestClient) -> None:
    assert client.post("/reset", json={"seed": 7}).status_code == 200
    for path, body in (("/reset", {"seed": 10**30}), ("/step", {"action": {"message": "Act: left"}})):
        answer = client.post(path, json=body)
        assert (answer.status_code, type(answer.json()["detail"])) == (422, str)
    assert client.post("/reset", headers={"Host": "evil.example"}).status_code == 403
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/ws", headers={"Origin": "null"}):
        pass


def test_a_session_is_told_of_the_task(openenv: Any) -> None:
    loaded = load("novel/fetch")
    for options in ({}, {"language": "de"}, {"tell": "nothing"}, {"goal": "Help."}):
        briefing = brief(loaded, **options)  # type: ignore[arg-type]
        env = openenv.ScenarioEnvironment(compiled(loaded), "prose", briefing)
        assert env.reset(seed=7).instructions.endswith(briefing.text())
        env.close()


def test_a_session_of_several_players_is_of_the_seat_that_is_left(openenv: Any) -> None:
    alike = Episode("together/help_together+oracle", seats={"agent": "script"})
    client = TestClient(
        openenv.application(beside([("agent", "script")], "together/help_together"), hosts=[NAME])
    )
    with client.websocket_connect("/ws") as session:
        session.send_json({"type": "reset", "data": {"test_episode": 3}})
        told = session.receive_json()["data"]["observation"]
        assert told["text"] == alike.reset(test_episode=3)
        assert "You are Jill, one of two players" in told["instructions"]
        for reply in ("Act: forward", 'Act: say "Move your body"'):
            session.send_json({"type": "step", "data": {"message": reply}})
            assert session.receive_json()["data"]["observation"]["text"] == alike.step(reply).text
    with pytest.raises(ValueError, match="got 'llm:other' for jill, expected script, random"):
        beside([("jill", "llm:other")], "together/help_together")


def test_a_session_that_lost_its_place_says_so(openenv: Any) -> None:
    env = openenv.ScenarioEnvironment(playable_of("talkitout"), "prose")
    env.reset(seed=7)
    env.close()
    for act in (env.reset, lambda: env.step(openenv.Reply(message="Act: left"))):
        with pytest.raises(ValueError, match=r"expected a (new connection|reset first)"):
            act()


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ({"message": "Act: left", "metadata": {}}, "Act: left"),
        ({"message": {"move": "left"}}, '{"move": "left"}'),
        ({"move": "left"}, '{"move": "left"}'),
        ({"message": "Act: left", "more": 1}, '{"message": "Act: left", "more": 1}'),
    ],
)
def test_json_of_any_form_is_a_reply(openenv: Any, action: Any, message: str) -> None:
    assert openenv.Reply.model_validate(action).message == message


without_inspect = pytest.mark.skipif(
    find_spec("inspect_ai") is not None, reason="test_inspect.py plays with the library itself"
)


@without_inspect
def test_a_sample_is_played_to_its_end() -> None:
    model = Model([("hm", "stop"), ("I see", "max_tokens"), ("", "unknown"), ("Act: left", "stop")])
    with imported("inspect_task", inspect_ai(model)) as module:
        told = module.scenario("novel/fetch", episodes=1, language="de")
        assert told.metadata["language"] == "de"
        assert told.metadata["told"].startswith("Jemand in diesem Raum")
        task = module.scenario(episodes=2, probes="off")
        assert task.metadata["tell"] == "nothing"
        states = [TaskState(sample.metadata) for sample in task.dataset]
        for state in states:
            asyncio.run(task.solver(state, None))
        values = [asyncio.run(task.scorer(state, None)) for state in states]
        scores = [SimpleNamespace(score=SimpleNamespace(value=1.0), sample_metadata=states[0].metadata)]
        assert module.by_skill()(scores) == dict.fromkeys(sorted(states[0].metadata["skills"]), 1.0)
    assert states[0].metadata["cast"] == ["agent", "wizard", "honest", "liar"]
    (found,) = values[0].metadata["episodes"]
    assert (found["replies"], found["invalid"], found["stopped"], found["steps"]) == (5, 1, 2, 5)
    assert (values[0].value["invalid_rate"], values[0].value["stopped_rate"]) == (0.2, 0.4)
    assert model.asked[0][1].text == Episode("talkitout").reset(test_episode=0)
    assert [len(messages) for messages in model.asked] == [2, 4, 6, 8, 10, 2], "the whole episode"
    assert [event["action"] for event in model.events] == [*[None] * 3, "Act: left", *["Act: done"] * 2]
    assert [event["stop"] for event in model.events] == ["", "length", "unreadable", "", "", ""]


@without_inspect
def test_a_sample_of_several_players_is_of_the_seat_that_is_left() -> None:
    model = Model([])
    with imported("inspect_task", inspect_ai(model)) as module:
        task = module.scenario("together/help_together", episodes=1, seats={"agent": "script"})
        assert task.metadata["seats"] == {"agent": "script"}
        assert task.dataset[0].metadata["seat"] == "jill"
        state = TaskState(task.dataset[0].metadata)
        asyncio.run(task.solver(state, None))
        alike = Episode("together/help_together+oracle", seats={"agent": "script"})
        text = alike.reset(test_episode=0)
        assert [message.text for message in model.asked[0]] == [alike.instructions, text]
        for told in model.asked[1:]:
            assert told[-1].text == alike.step("Act: done").text
        (found,) = asyncio.run(task.scorer(state, None)).metadata["episodes"]
        assert found["steps"] == len(model.asked)
        with pytest.raises(ValueError, match="got 'jil', expected one of agent, jill"):
            module.scenario("together/help_together", seats={"jil": "script"})


@without_inspect
def test_a_limit_is_told_and_a_full_context_ends_a_sample() -> None:
    model = Model([("Act: left", "stop")] * 3 + [("The prompt is too long.", "model_length")])
    with imported("inspect_task", inspect_ai(model)) as module:
        with pytest.raises(ValueError, match="history: got 0"):
            module.scenario(episodes=1, history=0)
        task = module.scenario(episodes=1, history=2, probes="off")
        state = TaskState(task.dataset[0].metadata)
        asyncio.run(task.solver(state, None))
        answer = asyncio.run(task.scorer(state, None)).answer
        assert answer == "a conversation longer than the model's context"
    assert [len(messages) for messages in model.asked] == [2, 4, 4, 4]
    assert model.asked[-1][1].text.startswith("(2 earlier turns are left out here, ")


@without_inspect
def test_the_suite_is_that_of_the_published_table() -> None:
    with imported("inspect_task", inspect_ai(Model([]))) as module:
        task = module.suite(episodes=1)
    published = load_experiment(Path(__file__).parents[3] / "experiments" / "minds.yaml")
    asked = [sample.metadata["scenario"] for sample in task.dataset]
    assert asked == list(dict.fromkeys(cell.scenario for cell in published.cells["model"]))
    assert len(asked) == 10


@without_inspect
def test_tools_objects_and_probes_of_a_suite() -> None:
    model = Model([([("move", {"direction": "left"})], "stop"), ([("fly", {})], "stop")])
    with imported("inspect_task", inspect_ai(model)) as module:
        task = module.suite(["help", "novel/sally_anne"], episodes=2, mode="tools", trials=2)
        states = [TaskState(sample.metadata) for sample in task.dataset]
        for state in states:
            asyncio.run(task.solver(state, None))
        first, second = (asyncio.run(task.scorer(state, None)) for state in states)
        spoken = module.scenario("novel/sally_anne", episodes=1, mode="json", probes="kept")
        asyncio.run(spoken.solver(TaskState(spoken.dataset[0].metadata), None))
    assert [len(messages) for messages in model.asked[:3]] == [2, 5, 8], "tools are answered"
    assert {event.get("action") for event in model.events[:2]} == {"Act: left", None}
    assert {"trial 1", "trial 2", "probe belief", "chance belief"} <= set(first.value)
    assert isnan(first.value["probe belief"])
    assert second.value["probe belief"] == 0
    assert second.value["chance belief"] == 0.5
    assert [message for message in states[0].messages if "Episode 2 of 2 begins" in message.text]
