"""`socialai crossplay`: a matrix of who plays how well with whom."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.episodes.players import Player
from socialai_dsl.evaluation.crossplay import names_of
from socialai_dsl.runs.folder import CROSSPLAY
from tests.socialai_dsl.llm.endpoint import endpoint

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


def test_language_models_play_with_everybody_and_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each pair has transcripts of its own, which are played again without asking; the first attempt ends early."""
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: "Act: left" if request["model"] == "a" else "Act: done") as stub:
        command = ["crossplay", "oracle", "llm:a", "llm:org/b", "--on", SCENARIO, "--episodes", "2"]
        command += ["--base-url", stub.url, "--out", str(tmp_path / "there")]
        assert main([*command, "--budget", "100"]) == 4
        asked = len(stub.requests)
        assert asked > 0
        assert main([*command, "--budget", "100_000"]) == 0
        whole = len(stub.requests)
        assert main(command) == 0
        assert len(stub.requests) == whole
    figures = json.loads((tmp_path / "there" / CROSSPLAY).read_text(encoding="utf-8"))
    assert figures["players"] == ["script", "llm:a", "llm:org/b"]
    rates = {(c["agent"], c["others"]): c["success"] for c in figures["seats"]["agent"]["cells"]}
    assert rates.pop(("script", "script")) == 1
    assert set(rates.values()) == {0}
    episodes = list((tmp_path / "there").glob("*/levers_together/transcripts/**/episode-*.jsonl"))
    assert len(episodes) == 2 * (4 * 1 + 4 * 2), (
        "two models play with the script on either seat, and four pairs"
    )
    capsys.readouterr()


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
        (
            ["human", "--on", SCENARIO],
            "a checkpoint, a language model, or what a person has played by `socialai evaluate human`",
        ),
        (["llm:stub", "--on", SCENARIO], "--out: got none, expected a folder for the transcripts"),
        (
            ["random", "--on", SCENARIO, "--budget", "5"],
            "--budget: it is for language models, and none plays",
        ),
        (["nowhere", "--on", SCENARIO], "nowhere"),
    ],
)
def test_who_cannot_play(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crossplay", *words, "--episodes", "2"]) == 2
    assert message in capsys.readouterr().err
