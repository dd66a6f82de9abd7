"""`socialai experiment`: what it plans, says and refuses; what becomes of runs is tested beside the runs."""

import argparse
import io
import json
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from socialai_dsl.cli import evaluate as evaluate_command
from socialai_dsl.cli.experiment_progress import RunsProgress
from socialai_dsl.cli.experiment_tables import clock
from socialai_dsl.cli.main import main
from socialai_dsl.experiments import estimate
from socialai_dsl.experiments.document import document_of
from socialai_dsl.experiments.folder import PlannedRun, runs_of
from socialai_dsl.experiments.work import _Work
from socialai_dsl.frontend import load, load_experiment
from socialai_dsl.runs.lock import Holder
from socialai_dsl.runs.options import new_config
from socialai_dsl.runs.status import Status

Capture = pytest.CaptureFixture[str]

TINY = """\
experiment: tiny
set: {frames: 100, envs: 4, seeds: 2}
conditions:
  - grid: {scenario: [dance], net: [fast, paper]}
  - {name: chance, scenario: dance, agent: random, seeds: 1}
profile: usual
profiles:
  usual: {}
  long: {set: {frames: 36000000}}
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(estimate, "_cache_file", lambda: tmp_path / "speeds.json")
    (tmp_path / "tiny.yaml").write_text(TINY)
    return tmp_path / "tiny.yaml"


def planned(file: Path, capsys: Capture, *words: str) -> Any:
    assert main(["experiment", "plan", str(file), "--json", *words]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_plan(file: Path, capsys: Capture) -> None:
    assert main(["experiment", "plan", str(file), "--workers", "2"]) == 0
    assert capsys.readouterr().out == (
        "tiny, profile usual, in runs/experiments/tiny\n"
        "\n"
        "condition      seeds  frames  frames/s  time left  state\n"
        "dance / fast   0, 1   100     5,000     30 s       2 waiting\n"
        "dance / paper  0, 1   100     unknown   unknown    2 waiting\n"
        "chance         0      0       -         15 s       waiting\n"
        "\n"
        "5 runs, 2 at once: 22 s and an unknown time (of 2 runs, see --measure) left\n"
        "speeds are from a typical figure of this network; starting and testing add 15 s a run\n"
    )


def test_what_is_not_known_is_no_time_at_all(file: Path, capsys: Capture) -> None:
    file.write_text(
        TINY.replace("[fast, paper]", "[paper]").replace("  - {name: chance", "  # {name: chance")
    )
    assert main(["experiment", "plan", str(file), "--workers", "1"]) == 0
    assert "2 runs, 1 at once: an unknown time (of 2 runs, see --measure) left\n" in capsys.readouterr().out
    assert planned(file, capsys)["seconds"] is None


def test_a_plan_for_programs(file: Path, capsys: Capture) -> None:
    plan = planned(file, capsys, "--profile", "long", "--workers", "3")
    assert (plan["name"], plan["profile"], plan["folder"]) == ("tiny", "long", "runs/experiments/tiny-long")
    assert plan["seconds"] == (2 * 36_000_000 / 5000 + 3 * 15) / 3
    assert plan["unknown"] == 2
    assert plan["states"] == {"waiting": 5}
    assert plan["runs"][0] | {"id": ""} == {
        "id": "",
        "conditions": ["dance / fast"],
        "seed": 0,
        "frames": 36_000_000,
        "frames_done": 0,
        "state": "waiting",
        "attempts": 0,
        "success_rate": None,
        "message": None,
        "frames_per_second": 5000.0,
        "speed_from": "a typical figure of this network",
        "seconds": 7215.0,
    }
    assert not (file.parent / "runs").exists(), "a plan changes nothing"


def test_a_plan_of_each_run(file: Path, capsys: Capture) -> None:
    assert main(["experiment", "plan", str(file), "--each"]) == 0
    assert capsys.readouterr().out.count("waiting") == 5


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plan", "tiny.yaml", "--profile", "lang"], "--profile: there is no 'lang'; did you mean long?"),
        (["run", "tiny.yaml", "--address", "here:1"], "--address: only the engine `ray` has one"),
        (["run", "tiny.yaml", "--slurm", "a=1"], "--slurm: only the engine `slurm` has jobs"),
        (["status", "nowhere"], "nowhere is no experiment's folder, it has no experiment.json"),
        (["plan", "."], ". is no experiment's folder, it has no experiment.json"),
        (["plan", ".", "--profile", "usual"], ". is a folder, which says itself what is run"),
    ],
)
def test_wrong_usage(file: Path, capsys: Capture, words: list[str], said: str) -> None:
    assert main(["experiment", *words]) == 2
    assert said in capsys.readouterr().err
    assert not (file.parent / "runs" / "experiments" / "tiny" / "runs").exists() or words[0] == "run"


def test_shipped_experiments_have_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(estimate, "_cache_file", lambda: tmp_path / "speeds.json")
    assert main(["experiment", "plan", "case_studies", "--profile", "smoke"]) == 0
    assert "CoinThief" in capsys.readouterr().out
    assert main(["experiment", "plan", "case_study"]) == 2
    assert "there is no experiment 'case_study'; did you mean case_studies?" in capsys.readouterr().err
    assert main(["study", "status", "askin", "--out", "there"]) == 2
    assert "there is no study 'askin'; did you mean asking?" in capsys.readouterr().err
    assert main(["study", "status", "asking", "--out", "there"]) == 2
    assert "there is no study in there" in capsys.readouterr().err


def test_a_file_with_mistakes(file: Path, capsys: Capture) -> None:
    file.write_text(TINY.replace("envs: 4", "env: 4"))
    assert main(["experiment", "run", str(file)]) == 1
    assert (
        "tiny.yaml:2:20: S101 unknown key `env` in settings; did you mean `envs`?" in capsys.readouterr().err
    )


def test_a_file_of_another_kind(file: Path, capsys: Capture) -> None:
    file.write_text("scenario: mine\nextends: dance.yaml\n")
    assert main(["experiment", "plan", str(file)]) == 1
    told = capsys.readouterr().err
    assert "S108 this is a file of the kind `scenario`; expected an experiment" in told
    assert "help: it is a file of its own: `experiment: NAME`" in told
    assert main(["study", "run", str(file)]) == 1
    assert "help: it is a file of its own: `study: NAME`" in capsys.readouterr().err


def test_validate_knows_experiments(file: Path, capsys: Capture) -> None:
    assert main(["validate", str(file)]) == 0
    file.write_text(TINY.replace("dance", "danse"))
    assert main(["validate", str(file)]) == 1
    assert "S504 there is no scenario `danse`; did you mean `dance`?" in capsys.readouterr().out


def test_a_run_of_an_unknown_name(file: Path, capsys: Capture) -> None:
    folder = file.parent / "out"
    folder.mkdir()
    document = {"format": 1, "name": "tiny", "profile": None}
    conditions = [{"name": "one", "scenario": "help", "tests": [], "frames": None, "options": {}}]
    document |= {"conditions": conditions, "runs": [{"id": "abc", "condition": "one", "seed": 0}]}
    (folder / "experiment.json").write_text(json.dumps(document))
    assert main(["experiment", "cancel", str(folder), "onne"]) == 2
    assert "has no run and no condition 'onne'; did you mean one?" in capsys.readouterr().err
    assert main(["experiment", "cancel", str(folder), "abc", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"cancelled": ["abc"], "busy": []}
    assert main(["experiment", "status", str(folder)]) == 0
    assert "one        0      0%           -        cancelled" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("seconds", "said"), [(5, "5 s"), (200, "3 min"), (7200, "2.0 h"), (864_000, "10.0 days")]
)
def test_times_people_plan_with(seconds: float, said: str) -> None:
    assert clock(seconds) == said


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_progress(tmp_path: Path, stream: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socialai_dsl.cli.experiment_progress._SECONDS_BETWEEN_LINES", -1)
    condition = {"name": "one", "scenario": "dance", "frames": 100, "options": {"net": "fast"}}
    runs = [PlannedRun(tmp_path / str(seed), condition, seed, ()) for seed in range(3)]
    for run in runs:
        run.folder.mkdir()
    status = Status()
    status.begin(1, 0)
    runs[1].write_status(status)
    (runs[1].folder / "metrics.jsonl").write_text('{"frames": 50, "frames_per_second": 10.0}\n')
    worker = Holder(1, "here", "now")
    monkeypatch.setattr(PlannedRun, "worker", property(lambda run: worker if run.id == "1" else None))
    with RunsProgress(runs, stream) as shown:
        shown.ended(runs[0], "failed", "no memory")
        shown.look()
    said = stream.getvalue()
    assert "one, seed 1" in said
    assert "50%" in said
    assert "[1/3] one, seed 0: failed: no memory" in said
    assert "1 failed, 1 at work, 1 waiting; " in said
    assert " left" in said


def test_failures_stay_in_sight(tmp_path: Path) -> None:
    """However many runs end after them, and however small the terminal is."""
    condition = {"name": "one", "frames": 100, "options": {"net": "mine"}}
    runs = [PlannedRun(tmp_path / str(seed), condition, seed, ()) for seed in range(40)]
    with RunsProgress(runs, Terminal()) as shown:
        shown.ended(runs[0], "failed", "no memory")
        for run in runs[1:]:
            shown.ended(run, "done", "")
        console = Console(file=io.StringIO(), width=60, height=10)
        console.print(shown._picture(console.height))
    lines = console.file.getvalue().splitlines()
    assert len(lines) < 10
    assert "one, seed 0: no memory" in lines
    assert "1 failed, 39 done, 0 at work, 0 waiting" in lines[-1]


def test_what_a_run_is_asked_for_is_what_the_commands_take(file: Path) -> None:
    """Whatever a condition can say, `socialai run` and `socialai evaluate` understand."""
    options = (
        "net: fast, bonus: cell, envs: 64, curriculum: expert, precision: bfloat16, device: cpu, threads: 2, "
        "checkpoint_every: 7, eval_episodes: 30"
    )
    file.write_text(
        f"experiment: words\nset: {{scenario: social_env, seeds: [5], frames: 1000, {options}, tests: [help, dance]}}\n"
        "conditions: [{name: learns}, {name: chance, agent: random}]\n"
    )
    document = document_of(load_experiment(file), None)
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers()
    evaluate_command.add_arguments(commands.add_parser("evaluate"))
    runs = runs_of(file.parent, document)
    given, by_chance = (dict(run.options) for run in runs)
    named = {"scenario": "social_env", "agent": "ppo", "seed": 5, "frames": 1000, "bonus_c": 2.0}
    options = {k: v for k, v in document["conditions"][0]["options"].items() if k != "hyper"}
    assert given == options | named
    assert new_config(given.pop("scenario"), given, load("social_env")).envs == 64
    assert by_chance == {"scenario": "social_env", "agent": "random", "seed": 5, "eval_episodes": 30}
    learns, chance = (_Work(run, lambda: False) for run in runs)
    own = str(file.parent / "runs" / document["runs"][0]["id"])
    for work, agent, seed in ((learns, own, None), (chance, "random", 5)):
        asked = parser.parse_args(work._test_command(["help", "dance"]))
        assert (asked.run, asked.on, asked.episodes, asked.seed) == (agent, ["help", "dance"], 30, seed)


@pytest.mark.parametrize("agent", ["ppo", "mine.safetensors", "shipped:help", "random"])
def test_an_agent_of_ones_own_code_plays_by_that_code(agent: str, file: Path) -> None:
    """The one that is trained here, and a checkpoint; of others the settings for all conditions say nothing."""
    (file.parent / "mine.safetensors").write_bytes(b"weights")
    own = {"net": "mine:Net", "algorithm": "mine:Algorithm"}
    file.write_text(
        f"experiment: own\nset: {{scenario: help, seeds: 1, frames: 1000, agent: '{agent}', net: 'mine:Net'}}\n"
        "conditions:\n"
        "  - {name: one, tests: [dance], algorithm: 'mine:Algorithm', aux: 'mine:Loss', bonus: 'mine:Bonus'}\n"
        + ("" if agent == "ppo" else "  - {name: more, trials: 5, algorithm: 'mine:Algorithm'}\n")
    )
    named: dict[str, Any] = dict.fromkeys(own) if agent in ("random", "shipped:help") else dict(own)
    parser = argparse.ArgumentParser()
    evaluate_command.add_arguments(parser.add_subparsers().add_parser("evaluate"))
    one, *more = runs_of(file.parent, document_of(load_experiment(file), None))
    assert {name: one.options.get(name) for name in own} == named
    commands = [_Work(one, lambda: False)._test_command(["dance"])]
    commands += [_Work(run, lambda: False)._play_command() for run in more]
    for command in commands:
        asked = parser.parse_args(command)
        assert {"net": asked.net, "algorithm": asked.algorithm} == named


@pytest.mark.slow
def test_a_real_run(file: Path, capsys: Capture) -> None:
    """The words of the command line are those that `socialai run` and `socialai evaluate` know."""
    file.write_text(
        "experiment: real\nset: {scenario: help, eval_episodes: 3}\nconditions:\n"
        "  - {name: learns, frames: 256, envs: 4, bonus: auto, checkpoint_every: 1, tests: [help_as_helper]}\n"
        "  - {name: chance, agent: random, seeds: [1]}\n"
    )
    assert main(["experiment", "run", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["states"] == {"done": 2}
    folder = Path(told["folder"]) / "runs" / told["runs"][0]["id"]
    result, tests = (json.loads((folder / name).read_text()) for name in ("result.json", "tests.json"))
    assert (result["frames"], result["eval"]["episodes"]) == (256, 3)
    assert tests["help_as_helper"]["episodes"] == 3
    assert tests["help_as_helper"].keys() == result["eval"].keys() | {"program_sha256"}
    config = json.loads((folder / "config.json").read_text())
    chance = json.loads((folder.parent / told["runs"][1]["id"] / "result.json").read_text())
    assert chance["eval"]["actions"] == "sampled actions, seed 1", (
        "the seed of who is not trained is of what it draws"
    )
    assert (config["bonus"], config["threads"], config["device"]) == ("cell", 1, "cpu")
