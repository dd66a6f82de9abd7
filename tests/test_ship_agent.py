"""`tools/ship_agent.py` ships what plays as its run said, and refuses everything else."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open

from socialai_dsl.cli.main import main, run_main
from socialai_dsl.errors import UsageError
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.shipped import WEIGHTS
from tools import ship_agent
from tools.ship_agent import INDEX, Refused, chance_of_difference, compare, halved, ship

COMMIT = "0123456789" * 4


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An agent that has learned a little of Help."""
    folder = tmp_path_factory.mktemp("trained") / "run"
    command = ["help", "--frames", "1500", "--envs", "32", "--eval-episodes", "40", "--device", "cpu"]
    assert run_main([*command, "--threads", "1", "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def agents(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("agents")
    assert "help: " in ship(run, folder, COMMIT)
    return folder


def content(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


@pytest.mark.thorough("trains and evaluates")
def test_a_run_becomes_a_small_agent_with_a_card(agents: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert {path.name for path in agents.iterdir()} == {"help", INDEX}, "nothing temporary stays"
    result = content(agents / "help" / "result.json")
    assert result["eval"]["episodes"] == result["half_precision"]["episodes"] == 500
    assert result["trained"]["commit"] == COMMIT
    assert not {"train_seconds", "frames_per_second"} & result.keys(), "they tell of the machine"
    text = (agents / "help" / "README.md").read_text(encoding="utf-8")
    assert "Trained again by `socialai-run help --recipe guided --frames 1500 --envs 32 --threads 1`" in text
    assert f"with commit `{COMMIT}`" in text
    assert (
        f"of the 500 test episodes {result['half_precision']['identical']} are played with the same" in text
    )
    assert result["half_precision"]["identical"] >= 400
    assert f"{result['eval']['success_rate']:.1%}" in (agents / INDEX).read_text(encoding="utf-8")
    with safe_open(agents / "help" / WEIGHTS, "pt") as weights:
        assert {weights.get_slice(name).get_dtype() for name in weights.keys()} == {"F16"}  # noqa: SIM118
    capsys.readouterr()
    assert main(["evaluate", str(agents / "help"), "--device", "cpu", "--json"]) == 0
    (again,) = json.loads(capsys.readouterr().out)
    assert again["eval"] == result["eval"], "what is written down is what half precision reached"


@pytest.mark.thorough("plays the test four times")
def test_an_agent_is_shipped_again_under_another_program(agents: Path, tmp_path: Path) -> None:
    """As where the compiler gives the same scenario another program."""
    shutil.copytree(agents, tmp_path / "agents")
    old = tmp_path / "agents" / "help"
    ship(old, tmp_path / "agents")
    for name in ("result.json", "README.md", "config.json", "vocabulary.json"):
        assert (old / name).read_bytes() == (agents / "help" / name).read_bytes(), name
    before, after = read(agents / "help" / WEIGHTS), read(old / WEIGHTS)
    assert after.meta == before.meta
    assert all(torch.equal(value, before.tensors[name]) for name, value in after.tensors.items())


@pytest.mark.thorough("plays the test four times")
def test_an_agent_of_many_forms_ships_for_the_scenario(run: Path, tmp_path: Path) -> None:
    """Help stands for a suite, and the other role for a scenario that it draws forms of."""
    assert "help_as_helper: " in ship(run, tmp_path, COMMIT, "help_as_helper", forms=["help"])
    agent = tmp_path / "help_as_helper"
    text = (agent / "README.md").read_text(encoding="utf-8")
    assert "Trained again by `socialai-run help --recipe guided --frames 1500" in text
    assert "| trained on | `help` |" in text
    rate = content(agent / "result.json")["forms"]["help"]["success_rate"]
    assert f"| `help` | {rate:.1%}, 95% interval" in text
    assert main(["evaluate", str(agent), "--device", "cpu", "--json", "--episodes", "20"]) == 0
    ship(agent, tmp_path)
    assert (agent / "README.md").read_text(encoding="utf-8") == text


def test_an_agent_that_no_longer_does_what_its_run_says_is_refused(run: Path, tmp_path: Path) -> None:
    changed = shutil.copytree(run, tmp_path / "run")
    result = content(changed / "result.json")
    result["eval"]["success_rate"] += 0.1
    (changed / "result.json").write_text(json.dumps(result))
    with pytest.raises(Refused, match=r"of 40 episodes, its run says .*: the scenario has changed"):
        ship(changed, tmp_path, COMMIT)
    assert {path.name for path in tmp_path.iterdir()} == {"run"}


def test_half_precision_that_plays_differently_is_refused() -> None:
    single, half = np.ones(500, bool), np.ones(500, bool)
    half[:5], single[7:10] = False, False
    assert compare(single, half) == {"episodes": 500, "only_single": 5, "only_half": 3, "p": 0.7266}
    half[:16] = single[7:10] = False
    with pytest.raises(Refused, match=r"loses 13 and wins 0 of 500 episodes .*p = 0.000244"):
        compare(single, half)


@pytest.mark.parametrize(
    ("lost", "won", "chance"),
    [(0, 0, 1.0), (5, 0, 2 / 32), (0, 6, 2 / 64), (1, 3, 2 * 5 / 16), (2, 2, 1.0)],
)
def test_the_test_of_mcnemar(lost: int, won: int, chance: float) -> None:
    """By hand: the tail of the binomial distribution with probability 1/2, on both sides."""
    assert chance_of_difference(lost, won) == pytest.approx(chance)


def test_only_scenarios_that_ship_without_parameters_and_finished_runs(run: Path, tmp_path: Path) -> None:
    renamed = shutil.copytree(run, tmp_path / "run")
    settings = content(renamed / "config.json")
    (renamed / "config.json").write_text(json.dumps(settings | {"scenario": "dance?length=3"}))
    with pytest.raises(Refused, match=r"dance\?length=3: expected a scenario that ships, without parameters"):
        ship(renamed, tmp_path, COMMIT)
    (renamed / "result.json").unlink()
    with pytest.raises(UsageError, match="expected a finished run"):
        ship(renamed, tmp_path, COMMIT)


def test_rounding_leaves_whole_numbers_alone(run: Path) -> None:
    checkpoint = read(run / "checkpoints")
    small = halved(checkpoint)
    for name, value in checkpoint.tensors.items():
        wanted = torch.float16 if value.dtype == torch.float32 else value.dtype
        assert small.tensors[name].dtype == wanted, name


def test_its_exit_codes(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ship_agent, "agents_folder", lambda: tmp_path / "agents")

    def ended(folder: Path) -> int:
        monkeypatch.setattr("sys.argv", ["ship_agent.py", str(folder)])
        return ship_agent.main()

    assert ended(tmp_path) == 2
    assert "is not a run's folder" in capsys.readouterr().err
    own = shutil.copytree(run, tmp_path / "own")
    (own / "config.json").write_text(
        json.dumps(content(own / "config.json") | {"scenario": "dance?length=3"})
    )
    assert ended(own) == 1
    assert capsys.readouterr().err.startswith("refused: dance?length=3: ")
