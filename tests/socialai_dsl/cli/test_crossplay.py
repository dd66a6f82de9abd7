"""`socialai crossplay`: a matrix of who plays how well with whom."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main

SCENARIO = "together/levers_together"


def test_scripts_play_with_each_other_and_chance_with_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "figures.json"
    assert (
        main(["crossplay", "oracle", "random", "--on", SCENARIO, "--episodes", "20", "--out", str(out)]) == 0
    )
    printed = capsys.readouterr().out
    assert "success of agent; rows: who plays agent" in printed
    assert "success of partner" in printed
    figures = json.loads(out.read_text(encoding="utf-8"))
    assert figures["players"] == ["script", "random"]
    cells = {(c["agent"], c["others"]): c["success"] for c in figures["seats"]["partner"]["cells"]}
    assert cells["script", "script"] == 1
    assert max(cells["random", "random"], cells["random", "script"]) < 0.5
    assert figures["seats"]["agent"]["with_themselves"] == pytest.approx(
        (1 + cells["random", "random"]) / 2, abs=1e-9
    )


def test_the_figures_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crossplay", "random", "--on", SCENARIO, "--episodes", "5", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["seats"]["agent"]["with_others"] is None


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
