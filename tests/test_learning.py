"""Agents learn two scenarios from the reward alone, to a success on the test set that chance never has."""

import json
from pathlib import Path

import pytest

from socialai_dsl.cli import main

# scenario, frames, least success on the 500 test episodes
GOALS = [("help", 600_000, 0.95), ("cointhief_tags", 1_500_000, 0.70)]


@pytest.mark.learning
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("scenario", "frames", "least"), GOALS, ids=[goal[0] for goal in GOALS])
def test_an_agent_learns(
    scenario: str, frames: int, least: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = [
        "--recipe",
        "plain",
        "--frames",
        str(frames),
        "--seed",
        "0",
        "--threads",
        "2",
        "--device",
        "cpu",
    ]
    assert main.main(["run", scenario, *options, "--out", str(tmp_path), "--json"]) == 0
    capsys.readouterr()
    figures = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["eval"]
    assert figures["episodes"] == 500
    assert figures["success_rate"] >= least


@pytest.mark.learning
@pytest.mark.timeout(3600)
def test_an_agent_learns_within_a_session(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It guesses in the first episode, and goes by what it saw from then on."""
    boxes = str(Path(__file__).parents[1] / "experiments" / "sessions" / "same_box.yaml")
    options = ["--recipe", "plain", "--frames", "1000000", "--seed", "1", "--threads", "1", "--device", "cpu"]
    assert main.main(["run", boxes, *options, "--out", str(tmp_path), "--json"]) == 0
    capsys.readouterr()
    figures = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["eval"]
    first, *later = [trial["success_rate"] for trial in figures["trials"]]
    assert first < 0.7
    assert len(later) == 4
    assert min(later) >= 0.95


@pytest.mark.learning
@pytest.mark.timeout(3600)
def test_an_agent_pays_for_finding_out_what_later_episodes_need(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It asks in the first episode, which pays less there, and then does what is best; the box alone gives 0.6."""
    stranger = str(Path(__file__).parents[1] / "experiments" / "sessions" / "stranger.yaml")
    options = ["--recipe", "plain", "--frames", "1000000", "--seed", "0", "--threads", "1", "--device", "cpu"]
    assert main.main(["run", stranger, *options, "--out", str(tmp_path), "--json"]) == 0
    capsys.readouterr()
    figures = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["eval"]
    _, *later = [trial["success_rate"] for trial in figures["trials"]]
    assert min(later) >= 0.95
    assert figures["mean_return"] >= 0.75
