"""The card beside the weights: what it says is so, and its code runs."""

import contextlib
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from socialai_dsl.cli.main import main, run_main
from socialai_dsl.trainer.config import WITHOUT_EFFECT

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "30", "--device", "cpu"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the scenario of `socialai new` was learned, with something to repeat in its command."""
    folder = tmp_path_factory.mktemp("place")
    with contextlib.chdir(folder):
        assert main(["new", "corridor"]) == 0
        command = ["corridor.yaml", *QUICK, "--seed", "3", "--bonus", "lang", "--out", "runs/here"]
        command += ["--hyper", "lr=3e-4", "--hyper", "loss=per_head"]
        assert run_main(command) == 0
    return folder


@pytest.fixture
def card(place: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    monkeypatch.chdir(place / "runs" / "here")
    return Path("model_card.md").read_text(encoding="utf-8")


def result() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(Path("result.json").read_text(encoding="utf-8"))
    return content


def test_the_front_matter_is_that_of_the_hub(card: str) -> None:
    _, front, _ = card.split("---\n", 2)
    told = yaml.safe_load(front)
    assert told["library_name"] == "socialai-dsl"
    assert told["pipeline_tag"] == "reinforcement-learning"
    (model,) = told["model-index"]
    (measured,) = model["results"]
    assert measured["dataset"]["name"] == "corridor"
    rate, returned = measured["metrics"]
    evaluation = result()["eval"]
    assert rate["value"] == pytest.approx(evaluation["success_rate"], abs=1e-4)
    assert returned["value"] == pytest.approx(evaluation["mean_return"], abs=1e-4)


def test_it_tells_what_was_trained_and_how_well_it_does(card: str) -> None:
    figures, settings = result(), json.loads(Path("config.json").read_text())
    low, high = figures["eval"]["success_interval"]
    assert f"95% interval {low:.1%} to {high:.1%} (Wilson)" in card
    assert figures["program_sha256"] in card
    assert f"{figures['frames']:,}" in card
    (weights,) = re.findall(r"`(checkpoints/\d+\.safetensors)`", card)
    assert Path(weights).is_file()
    assert {"lr", "bonus", "guide", "recipe", "minibatches"} <= settings.keys()
    told_elsewhere = {
        "scenario",
        "agent",
        "seed",
        "device",
        "threads",
        "eval_episodes",
        "seats",
        *WITHOUT_EFFECT,
    }
    for name, value in settings.items():
        assert (f"| `{name}` | `{value}` |" in card) == (name not in told_elsewhere), name
    happened = [ending for ending in figures["eval"]["endings"] if ending["episodes"]]
    assert happened
    for ending in happened:
        assert f"| {ending['share']:.1%} | `{ending['text']}` |" in card


def test_its_code_plays_an_episode(card: str) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", card, re.DOTALL)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "model_card.md", "exec"), {})
    assert printed.getvalue().strip() in result()["eval"]["outcomes"]


@pytest.mark.thorough("trains twice")
def test_its_command_trains_the_same_agent(card: str, tmp_path: Path) -> None:
    (command,) = re.findall(r"Trained again by `socialai-run ([^`]+)`", card)
    given = r"scenario/corridor\.yaml --recipe guided --frames 1500 --seed 3 --envs 32 --bonus lang"
    given += r" --threads \d --hyper lr=0\.0003 --hyper loss=per_head"
    assert re.fullmatch(given, command), "its bits depend on the threads, too"
    again = tmp_path / "again"
    options = ["--eval-episodes", "30", "--device", "cpu", "--out", str(again)]
    assert run_main([*command.split(), *options]) == 0
    assert json.loads((again / "result.json").read_text())["eval"] == result()["eval"]


def test_agents_that_were_not_trained_have_none(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    assert run_main(["corridor.yaml", "--agent", "random", "--eval-episodes", "5", "--out", "chance"]) == 0
    assert not Path("chance/model_card.md").exists()
