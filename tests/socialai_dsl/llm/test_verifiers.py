"""A model plays in verifiers: what `socialai serve` serves, and through the environment package."""

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
from tests.socialai_dsl.llm.endpoint import Respond, endpoint, stream

pytest.importorskip("openenv", reason="serving OpenEnv needs the extra openenv")
VERIFIERS = os.environ.get("VERIFIERS", "")
if not VERIFIERS:
    pytest.skip("verifiers comes with `make test-models`, in a place of its own", allow_module_level=True)

pytestmark = pytest.mark.timeout(900)
ROOT = Path(__file__).parents[3]


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


def played(tasks: str, folder: Path, model: Respond = respond) -> list[dict[str, Any]]:
    """What is left of tasks that a model plays, one that knows the script, where the file names its own."""
    with endpoint(model) as stub:
        tasks = tasks.replace("http://localhost:8080/v1", stub.url)
        (folder / "tasks.toml").write_text(tasks, encoding="utf-8")
        command = "vf-eval @ tasks.toml --model stub --push False --run.name played"
        subprocess.run(
            f"{VERIFIERS}/{command}".split(),
            cwd=folder,
            check=True,
            env={**os.environ, "OPENAI_API_KEY": "none"},
            timeout=600,
        )
    lines = (folder / "outputs" / "played" / "traces.jsonl").read_text(encoding="utf-8").splitlines()
    traces = [trace for line in lines for trace in json.loads(line)["traces"]]
    assert [trace["errors"] for trace in traces] == [[], []]
    return traces


def test_the_tasks_of_the_page_give_the_script_its_reward(url: str, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "training_language_models.md").read_text(encoding="utf-8")
    tasks = page.split("```toml\n# tasks.toml\n")[1].split("```")[0]
    for written, meant in (
        ("http://127.0.0.1:8000", url),
        ("[{seed = 1}, {seed = 2}]", "[{test_episode = 0}, {test_episode = 2}]"),
    ):
        assert written in tasks
        tasks = tasks.replace(written, meant)
    rewards = {
        trace["task"]["data"]["reset"]["test_episode"]: trace["rewards"]["openenv_reward"]["score"]
        for trace in played(tasks, tmp_path)
    }
    assert rewards == pytest.approx(rewards_of_the_script(0, 2))
    assert min(rewards.values()) > 0


def test_the_environment_package_plays_without_a_server(tmp_path: Path) -> None:
    """Its own smoke test: what it installs, with a stub in place of the model."""
    traces = played((ROOT / "environments" / "socialai" / "smoke.toml").read_text(encoding="utf-8"), tmp_path)
    found = {
        trace["task"]["data"]["room"]["test_episode"]: trace["rewards"]["scenario_reward"]["score"]
        for trace in traces
    }
    assert found == pytest.approx(rewards_of_the_script(0, 1))
    assert [trace["metrics"]["success"] for trace in traces] == [1.0, 1.0]


def test_a_conversation_that_outgrows_the_context_ends_without_success(tmp_path: Path) -> None:
    """And without an error, so that what was played before counts."""
    full = (400, {}, b'{"error": {"message": "maximum context length", "code": "context_length_exceeded"}}')
    smoke = (ROOT / "environments" / "socialai" / "smoke.toml").read_text(encoding="utf-8")
    traces = played(smoke, tmp_path, lambda request: full if len(request["messages"]) > 4 else "Act: left")
    assert [(trace["metrics"]["success"], trace["metrics"]["steps"]) for trace in traces] == [(0.0, 2.0)] * 2


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
