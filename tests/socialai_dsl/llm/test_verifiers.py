"""verifiers' `openenv` taskset lets a model play what `socialai serve` serves."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.llm import Episode
from socialai_dsl.llm.episode import scripted_reply
from tests.socialai_dsl.llm.endpoint import endpoint, stream

pytest.importorskip("openenv", reason="serving OpenEnv needs the extra openenv")
VERIFIERS = os.environ.get("VERIFIERS", "")
if not VERIFIERS:
    pytest.skip("verifiers comes with `make test-models`, in a place of its own", allow_module_level=True)

pytestmark = pytest.mark.timeout(900)
ENVIRONMENT = Path(__file__).parents[3] / "environments" / "socialai"

TASKS = """\
[env.taskset]
id = "openenv"
base_url = "{url}"
resets = [{{test_episode = 0}}, {{test_episode = 2}}]

[env.player.harness]
id = "null"

[env.player.runtime]
type = "subprocess"

[client]
base_url = "{model}"
api_key_var = "MODEL_KEY"
"""


@pytest.fixture
def url() -> Iterator[str]:
    """A server of `help`."""
    command = [sys.executable, "-m", "socialai_dsl", "serve", "help", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        found = re.search(r"http://\S+?(?=,)", server.stderr.readline())
        assert found is not None
        yield found[0]
        server.terminate()


def respond(request: dict[str, Any]) -> Any:
    """Plays the script of the episode that begins as the first message says; knows nothing else."""
    told = [message["content"] for message in request["messages"] if message["role"] == "user"]
    if told[0].startswith("{"):  # of the server's observations
        seen = [json.loads(text)["observation"]["text"] for text in told]
    else:  # the environment package tells the instructions first
        first = Episode("help").reset(test_episode=0).partition("\n")[0]
        seen = [told[0][told[0].rindex(f"\n\n{first}") + 2 :], *told[1:]]
    for number in range(3):
        episode = Episode("help+oracle")
        if episode.reset(test_episode=number) == seen[0]:
            break
    for text in seen[1:]:
        assert episode.step(scripted_reply(episode)).text == text
    reply = scripted_reply(episode)
    return stream(reply) if request.get("stream") else reply


def test_a_script_behind_a_model_gets_its_reward(url: str, tmp_path: Path) -> None:
    with endpoint(respond) as stub:
        (tmp_path / "tasks.toml").write_text(TASKS.format(url=url, model=stub.url), encoding="utf-8")
        command = "vf-eval @ tasks.toml --model stub --push False --run.name played"
        subprocess.run(
            command.split(),
            cwd=tmp_path,
            check=True,
            env={**os.environ, "MODEL_KEY": "none", "PATH": f"{VERIFIERS}:{os.environ['PATH']}"},
            timeout=600,
        )
    expected = rewards_of_the_script(0, 2)
    lines = (tmp_path / "outputs" / "played" / "traces.jsonl").read_text(encoding="utf-8").splitlines()
    traces = [trace for line in lines for trace in json.loads(line)["traces"]]
    assert [trace["errors"] for trace in traces] == [[], []]
    rewards = {
        trace["task"]["data"]["reset"]["test_episode"]: trace["rewards"]["openenv_reward"]["score"]
        for trace in traces
    }
    assert rewards == pytest.approx(expected)
    assert min(rewards.values()) > 0


def test_the_environment_package_plays_without_a_server(tmp_path: Path) -> None:
    """Its own smoke test: what it installs, with a stub in place of the model."""
    with endpoint(respond) as stub:
        smoke = (ENVIRONMENT / "smoke.toml").read_text(encoding="utf-8")
        smoke = smoke.replace("http://localhost:8080/v1", stub.url).replace("OPENAI_API_KEY", "MODEL_KEY")
        (tmp_path / "smoke.toml").write_text(smoke, encoding="utf-8")
        command = "vf-eval @ smoke.toml --model stub --push False --run.name played"
        subprocess.run(
            command.split(),
            cwd=tmp_path,
            check=True,
            env={**os.environ, "MODEL_KEY": "none", "PATH": f"{VERIFIERS}:{os.environ['PATH']}"},
            timeout=600,
        )
    lines = (tmp_path / "outputs" / "played" / "traces.jsonl").read_text(encoding="utf-8").splitlines()
    traces = [trace for line in lines for trace in json.loads(line)["traces"]]
    assert [trace["errors"] for trace in traces] == [[], []]
    found = {
        trace["task"]["data"]["room"]["test_episode"]: trace["rewards"]["scenario_reward"]["score"]
        for trace in traces
    }
    assert found == pytest.approx(rewards_of_the_script(0, 1))
    assert [trace["metrics"]["success"] for trace in traces] == [1.0, 1.0]


def rewards_of_the_script(*numbers: int) -> dict[int, float]:
    """What the script gets in these test episodes of `help`."""
    expected = {}
    for number in numbers:
        episode = Episode("help+oracle")
        episode.reset(test_episode=number)
        while not episode.step(scripted_reply(episode)).done:
            pass
        expected[number] = episode.result().total
    return expected
