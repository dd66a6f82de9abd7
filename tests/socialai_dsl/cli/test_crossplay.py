"""`socialai crossplay`: a matrix of who plays how well with whom."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.episodes.players import Player
from socialai_dsl.evaluation.crossplay import names_of
from socialai_dsl.runs.folder import CROSSPLAY

SCENARIO = "together/levers_together"


def test_scripts_play_with_each_other_and_chance_with_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "there" / "both"
    assert (
        main(["crossplay", "oracle", "random", "--on", SCENARIO, "--episodes", "20", "--out", str(out)]) == 0
    )
    printed = capsys.readouterr().out
    assert "success of agent; rows: who plays agent" in printed
    assert "success of partner" in printed
    figures = json.loads((out / CROSSPLAY).read_text(encoding="utf-8"))
    assert (figures["players"], figures["episodes"]) == (["script", "random"], 20)
    seat = figures["seats"]["partner"]
    cells = {(c["agent"], c["others"]): c["success"] for c in seat["cells"]}
    assert cells["script", "script"] == 1
    assert max(cells["random", "random"], cells["random", "script"]) < 0.5
    alone = seat["with_themselves"]
    assert alone["success"] == pytest.approx((1 + cells["random", "random"]) / 2)
    (low, high), others = alone["interval"], seat["with_others"]
    assert others["interval"][0] <= others["success"] <= others["interval"][1] < low < high < 1
    assert f"with themselves {alone['success']:.2f} [{low:.2f}, {high:.2f}]" in printed
    assert (out / "crossplay.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "crossplay.svg").is_file()


def test_the_figures_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crossplay", "random", "--on", SCENARIO, "--episodes", "5", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["seats"]["agent"]["with_others"] is None


@pytest.mark.parametrize(
    ("agents", "names"),
    [
        (["oracle", "random", "runs/a"], ["script", "random", "a"]),
        (["one/a-s0", "two/a-s0", "two/a-s1"], ["one/a-s0", "two/a-s0", "a-s1"]),
        (["x/one/a", "y/one/a", "a"], ["x/one/a", "y/one/a", "a"]),
        (["random", "random"], ["random (1)", "random (2)"]),
        (["shipped:help", "other/help", "help"], ["shipped:help", "other/help", "help"]),
    ],
)
def test_players_of_one_name_are_told_apart(agents: list[str], names: list[str]) -> None:
    assert names_of([Player(agent) for agent in agents]) == names


def test_nothing_is_left_of_what_cannot_be_played(tmp_path: Path) -> None:
    assert main(["crossplay", "random", "--on", "talkitout", "--out", str(tmp_path / "there")]) == 2
    assert not (tmp_path / "there").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["random", "--on", "talkitout"], "only the agent has a seat"),
        (["human", "--on", SCENARIO], "expected random, oracle, a run or a checkpoint"),
        (["nowhere", "--on", SCENARIO], "nowhere"),
    ],
)
def test_who_cannot_play(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crossplay", *words, "--episodes", "2"]) == 2
    assert message in capsys.readouterr().err
