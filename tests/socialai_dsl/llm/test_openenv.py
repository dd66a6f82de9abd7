"""Scenarios served to trainers: its client plays, seeds are honoured, and sessions do not mix."""

import asyncio
import json
import socket
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.episodes.partners import beside
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.episode import scripted_reply

pytest.importorskip("openenv", reason="serving OpenEnv needs the extra openenv")

import httpx
import uvicorn
import yaml
from openenv import GenericEnvClient
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from socialai_dsl.llm.openenv import Reply, ScenarioClient, application

pytestmark = pytest.mark.filterwarnings("ignore")  # of the libraries

REPLIES = ("Act: forward", "Act: left", "Act: right", 'Act: say "How are you"', "hm")
SERVED = Path(__file__).parents[3] / "docker" / "openenv"


@contextmanager
def serving(app: Any) -> Iterator[str]:
    """The address of an application on a free port."""
    server = uvicorn.Server(uvicorn.Config(app, log_level="error"))
    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        server.should_exit = True
        thread.join()


def socket_of(url: str) -> str:
    """The address of sessions."""
    return f"{url.replace('http', 'ws')}/ws"


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with served() as found:
        yield found


def test_a_client_plays_an_episode_to_its_end(url: str) -> None:
    alike = Episode("talkitout+oracle")
    text = alike.reset(test_episode=3)
    with ScenarioClient(base_url=url).sync() as client:
        told = client.reset(test_episode=3).observation
        assert (told.text, told.instructions) == (text, alike.instructions)
        done = False
        while not done:
            reply = scripted_reply(alike)
            turn = alike.step(reply)
            result = client.step(Reply(message=reply))
            assert (result.observation.text, result.reward, result.done) == (
                turn.text,
                turn.reward,
                turn.done,
            )
            done = result.done
        assert (result.observation.success, result.observation.ending) == (True, alike.result().ending)
        state = client.state()
        assert (state.step_count, state.test_episode, state.invalid_replies) == (alike.result().steps, 3, 0)
        with pytest.raises(Exception, match="after the end of the episode"):
            client.step(Reply(message="Act: left"))
        with pytest.raises(Exception, match="seed: got -1, expected a number greater than or equal to 0"):
            client.reset(seed=-1)
        assert client.reset(test_episode=3).observation.text == text


def test_the_metadata_have_the_version_of_the_text(url: str) -> None:
    assert httpx.get(f"{url}/metadata").json()["version"] == str(TextView.version)


def served(idle: float = 60.0, sessions: int = 100, **options: Any) -> AbstractContextManager[str]:
    """A server of `talkitout` and its address."""
    return serving(application(beside([], "talkitout"), idle=idle, sessions=sessions, **options))


def test_strangers_are_refused(url: str) -> None:
    for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
        assert httpx.get(f"{url}/health", headers=headers).status_code == 403
    with pytest.raises(Exception, match="403"), connect(socket_of(url), origin="http://evil.example"):
        pass
    with served(hosts=["lab.example"]) as named:
        assert httpx.get(f"{named}/health", headers={"Host": "lab.example"}).status_code == 200


def test_silence_ends_a_session_and_gives_its_place_away() -> None:
    with served(idle=0.3, sessions=1) as short, connect(socket_of(short)) as silent:
        silent.send('{"type": "reset"}')
        assert json.loads(silent.recv())["type"] == "observation"
        with connect(socket_of(short)) as refused:
            assert "at capacity" in str(refused.recv())
        with pytest.raises(ConnectionClosed, match=r"the session was silent for 0\.3 s"):
            silent.recv(timeout=20)
        with connect(socket_of(short)) as other:
            other.send('{"type": "reset"}')
            assert json.loads(other.recv())["type"] == "observation"


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/reset", '{"seed": 1000000000000000000000000000000}'),
        ("/reset", '{"test_episode": 1000000000}'),
        ("/reset", '{"seed": "x"}'),
        ("/reset", '{"seed": NaN}'),
        ("/step", '{"action": {"message": "Act: left"}}'),
        ("/step", '{"action": 7}'),
        ("/step", "[" * 100_000),
    ],
)
def test_a_wrong_request_is_told_in_a_sentence(path: str, body: str, url: str) -> None:
    answer = httpx.post(f"{url}{path}", content=body)
    assert answer.status_code == 422
    assert isinstance(answer.json()["detail"], str)


ODD = [
    "[1]",
    b"\x00\xff",
    "[" * 100_000,
    '{"type": "fly"}',
    '{"type": "step"}',
    '{"type": "reset", "data": {"seed": 1.5}}',
]
ODD += [
    '{"type": "step", "data": {"message": "Act: left"}}',
    '{"type": "mcp", "data": {}}',
    '{"type": "state", "data": 7}',
]


def test_odd_messages_leave_a_session_as_it_is(url: str) -> None:
    with connect(socket_of(url)) as session:
        for odd in [*ODD, '{"type": "reset", "data": {"seed": 3}}', *ODD]:
            session.send(odd)
            assert json.loads(session.recv())["type"] in ("error", "mcp", "observation")
        session.send(json.dumps({"type": "step", "data": {"deep": json.loads("[" * 400 + "]" * 400)}}))
        assert json.loads(session.recv())["data"]["observation"]["text"]
        session.send('{"type": "state"}')
        assert json.loads(session.recv())["data"]["step_count"] == 2


def test_an_episode_without_a_seed_can_be_played_again(url: str) -> None:
    with ScenarioClient(base_url=url).sync() as client:
        texts = [client.reset().observation.text for _ in range(5)]
        assert len(set(texts)) > 1
        again = client.state().seed
        assert client.reset(seed=again).observation.text == texts[-1]


def test_a_hundred_sessions_do_not_mix(url: str) -> None:
    """All play at once, each its own room and replies; each is what one that plays alone would be told."""
    together = asyncio.Barrier(100)

    async def session(number: int) -> list[Any]:
        replies = np.random.default_rng(number).choice(REPLIES, 20)
        async with ScenarioClient(base_url=url) as client:
            result = await client.reset(seed=number)
            texts: list[Any] = [result.observation.text]
            await together.wait()
            for reply in replies:
                result = await client.step(Reply(message=str(reply)))
                texts.append((result.observation.text, result.reward, result.done))
        return texts

    async def all_sessions() -> list[list[Any]]:
        return await asyncio.gather(*map(session, range(100)))

    played = asyncio.run(all_sessions())
    alone = Episode("talkitout")
    for number, texts in enumerate(played):
        assert texts[0] == alone.reset(seed=number)
        for reply, told in zip(np.random.default_rng(number).choice(REPLIES, 20), texts[1:], strict=True):
            turn = alone.step(str(reply))
            assert told == (turn.text, turn.reward, turn.done)


@pytest.mark.parametrize(
    ("action", "understood"),
    [
        ({"move": "left", "say": None}, True),
        ({"message": '{"move": "left", "say": null}'}, True),
        ({"message": {"move": "left"}}, True),
        ({"message": 7}, False),
        ({}, False),
        ({"move": "up"}, False),
    ],
)
def test_json_of_any_form_is_a_reply(url: str, action: dict[str, Any], understood: bool) -> None:
    """verifiers sends a model's JSON as the action itself."""
    with GenericEnvClient(base_url=url).sync() as client:
        client.reset(seed=3)
        result = client.step(action)
        assert ("Your reply was not understood" in result.observation["text"]) is not understood
        assert client.state()["step_count"] == 1


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["talkitour"], 2, "did you mean `talkitout`?"),
        (["help", "--host", "no.such.host.invalid"], 2, "cannot serve on no.such.host.invalid:8000"),
        (["help", "--port", "99999"], 2, "--port: got 99999, expected at most 65535"),
        (
            ["help", "--idle", "0"],
            2,
            "--idle: expected a number of seconds above 0, at most 31622400, got '0'",
        ),
    ],
)
def test_mistakes_are_told(
    arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["serve", *arguments]) == code
    assert said in capsys.readouterr().err


def test_the_manifest_and_the_image_name_what_there_is() -> None:
    manifest = yaml.safe_load((SERVED / "openenv.yaml").read_text(encoding="utf-8"))
    module, name = manifest["app"].split(":")
    assert (module, manifest["port"]) == ("socialai_dsl.llm.openenv_app", 8000)
    from socialai_dsl.llm import openenv_app

    assert getattr(openenv_app, name).title
