"""The trained agents that ship: each plays as its card says, and every command finds them by name."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from safetensors import safe_open

import socialai_dsl
from socialai_dsl import frontend
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.episodes import players
from socialai_dsl.evaluation import evaluate_policy
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.loader.shipped import IDS
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.shipped import PREFIX, WEIGHTS, agent_name, agents_folder, located, shipped_agents
from tools.ship_agent import EPISODES, INDEX, LARGEST, ROUNDING, index

Capture = pytest.CaptureFixture[str]

AGENTS = shipped_agents()
QUICK = "talkitout"
"""The agent that plays all its episodes in the plain suite as well."""


def card(name: str) -> str:
    return (agents_folder() / name / "README.md").read_text(encoding="utf-8")


def figures_of(name: str) -> tuple[float, dict[str, Any]]:
    """The success rate in the front matter of an agent's card, and what its `result.json` says."""
    front = yaml.safe_load(card(name).split("---\n", 2)[1])
    metrics = front["model-index"][0]["results"][0]["metrics"]
    (rate,) = [metric["value"] for metric in metrics if metric["type"] == "success_rate"]
    return rate, json.loads((agents_folder() / name / "result.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == QUICK else pytest.mark.slow) for name in AGENTS]
)
def test_an_agent_plays_as_its_card_says(name: str) -> None:
    """The same rooms and the same random numbers: only the rounding of another machine can differ."""
    promised, recorded = figures_of(name)
    envs = socialai_dsl.make_vec(recorded["scenario"], num_envs=125, copy=False, autoreset_mode="Disabled")
    result = evaluate_policy(CheckpointPolicy.load(PREFIX + name, envs), envs, EPISODES)
    assert recorded["eval"]["episodes"] == EPISODES
    assert promised == pytest.approx(recorded["eval"]["success_rate"], abs=1e-4)
    assert result.success_rate == pytest.approx(promised, abs=ROUNDING)
    assert result.mean_length == pytest.approx(recorded["eval"]["mean_length"], rel=0.02)


def test_every_scenario_of_the_paper_has_an_agent() -> None:
    assert set(IDS.values()) <= set(AGENTS)


@pytest.mark.parametrize("name", AGENTS)
def test_an_agent_is_small_and_was_made_for_its_scenario(name: str) -> None:
    folder = agents_folder() / name
    assert sum(file.stat().st_size for file in folder.iterdir()) <= LARGEST
    with safe_open(folder / WEIGHTS, "pt") as weights:
        kinds = {weights.get_slice(tensor).get_dtype() for tensor in weights.keys()}  # noqa: SIM118
    assert "F32" not in kinds, "half precision is enough"
    meta = checkpoints.read_agent(PREFIX + name).meta
    scenario = figures_of(name)[1]["scenario"]
    assert meta.config.scenario == scenario
    assert agent_name(*scenario.split("+")) == name
    same = socialai_dsl.compile(socialai_dsl.load(scenario)).sha256 == meta.program_sha256
    assert same, f"the program of {name} has changed: python tools/ship_agent.py {folder}"


@pytest.mark.parametrize("name", AGENTS)
def test_a_card_says_how_its_agent_was_made_and_nothing_of_a_machine(name: str) -> None:
    settings = json.loads((agents_folder() / name / "config.json").read_text(encoding="utf-8"))
    result = figures_of(name)[1]
    trained_on = result.get("trained_on", result["scenario"])
    (command,) = re.findall(rf"Trained again by `socialai-run {re.escape(trained_on)} ([^`]+)`", card(name))
    assert f"--recipe {settings['recipe']} --frames {settings['frames']}" in command
    assert re.search(r"\| trained \| \d{4}-\d\d-\d\d, with commit `[0-9a-f]{40}` \|", card(name))
    assert f'CheckpointPolicy.load("{PREFIX}{name}", env)' in card(name)
    for file in (agents_folder() / name).iterdir():
        content = file.read_bytes()
        assert not re.search(rb"/(tmp|home|root|work|Users)/", content), file.name


def test_the_list_of_agents_is_that_of_the_folder() -> None:
    folder = agents_folder()
    text = (folder / INDEX).read_text(encoding="utf-8")
    assert text == index(folder)
    for target in re.findall(r"\]\(([^)]+)\)", text):
        assert (folder / target).exists(), target


# -- by name ----------------------------------------------------------------------------------------------------------


def test_an_agent_is_loaded_without_saying_what_it_plays() -> None:
    agent = CheckpointPolicy.load(PREFIX + QUICK)
    env = socialai_dsl.make(QUICK)
    assert agent.net.spec.action_sizes == tuple(env.action_space.nvec)
    successes = 0
    for number in range(10):
        observation, info = env.reset(options={"test_episode": number})
        agent.reset()
        ended = False
        while not ended:
            observation, _, terminated, truncated, info = env.step(agent.act(observation))
            ended = terminated or truncated
        successes += info["success"]
    assert successes >= 6, "chance has none"


def test_a_name_that_does_not_ship_is_refused_with_those_that_do() -> None:
    with pytest.raises(ValueError, match=f"shipped:nobody: no agent of this name ships; .*{QUICK}"):
        located("shipped:nobody")
    with pytest.raises(ValueError, match="no agent of this name"):
        CheckpointPolicy.load("shipped:../scenarios")
    assert located("runs/mine") == Path("runs/mine")


@pytest.mark.parametrize(
    ("scenario", "agent"),
    [
        ("help", "help"),
        ("SHIPPED/help.yaml", "help"),
        ("help+unsocial", "help"),
        ("SHIPPED/help.yaml+oracle+unsocial", "help"),
        ("help_as_helper", "help_as_helper"),
        ("help+as_helper", "help_as_helper"),
        ("help+as_helper+unsocial", "help_as_helper"),
        ("social_env?split=test", "social_env"),
        ("novel/shop+unsocial", "novel/shop"),
        ("talkitout+marked+unsocial", "talkitout_marked"),
    ],
)
def test_a_scenario_has_the_agent_of_its_name_however_it_is_called(
    scenario: str, agent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = ["help", "help_as_helper", "novel/shop", "social_env", "talkitout", "talkitout_marked"]
    monkeypatch.setattr(players, "shipped_agents", lambda: known)
    spec = scenario.replace("SHIPPED", str(shipped_folder()))
    assert players.named_agent("shipped", spec) == PREFIX + agent
    assert players.named_agent("oracle", spec) == "oracle"


def test_a_run_with_a_shipped_agent_trains_nothing_and_leaves_what_a_run_leaves(
    tmp_path: Path, capsys: Capture
) -> None:
    command = [str(shipped_folder() / f"{QUICK}.yaml"), "--agent", "shipped", "--eval-episodes", "25"]
    assert run_main([*command, "--device", "cpu", "--out", str(tmp_path / "run")]) == 0
    shown = capsys.readouterr()
    assert "how the episodes ended" in shown.out
    assert shown.err == "", "it plays the program that it was trained on"
    files = {file.name for file in (tmp_path / "run").iterdir()}
    assert {"result.json", "config.json", "episode.gif", "transcript.txt", "episode.html"} <= files
    assert not {"metrics.jsonl", "checkpoints"} & files
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert (result["agent"], result["frames"]) == (PREFIX + QUICK, 0)
    assert result["network_sha256"] == checkpoints.network_digest(PREFIX + QUICK)


def test_a_scenario_without_an_agent_is_told_which_have_one(tmp_path: Path, capsys: Capture) -> None:
    own = tmp_path / f"{QUICK}.yaml"
    own.write_text((shipped_folder() / f"{QUICK}.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    for scenario in ("novel/shop", str(own)):
        assert run_main([scenario, "--agent", "shipped", "--out", str(tmp_path / "none")]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "no agent ships for it; these agents ship:" in line
        assert QUICK in line
    assert not (tmp_path / "none").exists()


def test_training_options_make_no_sense_for_it(capsys: Capture) -> None:
    assert run_main([QUICK, "--agent", "shipped", "--frames", "1000"]) == 2
    assert f"--frames: the agent '{PREFIX}{QUICK}' is not trained" in capsys.readouterr().err


@pytest.mark.thorough("runs every command")
def test_every_command_that_takes_a_trained_agent_takes_it(tmp_path: Path, capsys: Capture) -> None:
    agent, few = PREFIX + QUICK, ["--episodes", "10"]

    def printed(*words: str) -> str:
        assert main(list(words)) == 0, capsys.readouterr().err
        return capsys.readouterr().out

    own = json.loads(printed("evaluate", agent, *few, "--device", "cpu", "--json"))
    there = json.loads(printed("evaluate", "shipped", "--on", QUICK, *few, "--device", "cpu", "--json"))
    assert own == there
    assert [result["scenario"] for result in own] == [QUICK]
    elsewhere = ["--on", f"{QUICK}+unsocial", "--on", QUICK]
    hidden, plain = json.loads(printed("evaluate", agent, *elsewhere, *few, "--json"))
    assert plain["warnings"] == []
    assert "was trained on talkitout" in hidden["warnings"][0], "a variant is another program"

    for words in ([agent], [QUICK, "--agent", "shipped"]):
        traces = tmp_path / "traces.json"
        printed("replay", *words, *few, "-o", str(traces))
        (trace, *_) = json.loads(traces.read_text(encoding="utf-8"))
        assert trace["agent"] == agent
        traces.unlink()
    shown = json.loads(
        printed("trace", QUICK, "--agent", "shipped", "--test-episode", "0", "--steps", "2", "--json")
    )
    assert shown["agent"] == agent
    coverage = ["check", QUICK, "--part", "coverage", "--agent", "shipped"]
    assert "episodes of shipped 10" in printed(*coverage, *few)

    printed("export", agent, "--out", str(tmp_path / "mine"))
    again = json.loads(printed("evaluate", str(tmp_path / "mine"), *few, "--device", "cpu", "--json"))
    assert again[0]["eval"] == own[0]["eval"]


def test_an_experiment_can_name_it(tmp_path: Path) -> None:
    text = f"experiment: ours\nconditions:\n  - {{name: ours, scenario: {QUICK}, agent: 'shipped:NAME'}}\n"
    file = tmp_path / "ours.yaml"
    file.write_text(text.replace("NAME", QUICK), encoding="utf-8")
    assert [str(found) for found in frontend.check(str(file)).diagnostics] == []
    file.write_text(text.replace("NAME", QUICK[:-1]), encoding="utf-8")
    (found,) = frontend.check(str(file)).diagnostics
    assert (found.code, found.suggestion) == ("S703", PREFIX + QUICK)
