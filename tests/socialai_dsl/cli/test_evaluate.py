"""`socialai evaluate` from end to end: figures, endings by line, recordings, and agents far from home."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import socialai_dsl
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.episodes import EvalResult, wilson_interval
from socialai_dsl.episodes.players import Player
from socialai_dsl.evaluation.test_set import Evaluation
from socialai_dsl.traces.endings import Ending, endings_of

Capture = pytest.CaptureFixture[str]

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "30", "--device", "cpu"]


@pytest.fixture(scope="module")
def help_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An agent that was trained as exiter, though not for long."""
    folder = tmp_path_factory.mktemp("runs") / "help"
    assert run_main(["help", *QUICK, "--out", str(folder)]) == 0
    return folder


def evaluated(capsys: Capture, *arguments: str) -> Any:
    capsys.readouterr()
    device = [] if arguments[0] == "random" else ["--device", "cpu"]
    assert main(["evaluate", *arguments, *device, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.thorough("trains and evaluates")
def test_the_other_role(help_run: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "there"
    arguments = [str(help_run), "--on", "help_as_helper", "--episodes", "40", "--device", "cpu"]
    assert main(["evaluate", *arguments, "--out", str(out), "--record", "2"]) == 0
    printed = capsys.readouterr()
    assert "warning: the agent was trained on help (program " in printed.err
    assert "and plays help_as_helper (" in printed.err
    assert "scenarios/help.yaml:54" in printed.out
    assert "failure: agent.did(done)" in printed.out
    (result,) = json.loads((out / "evaluation.json").read_text(encoding="utf-8"))
    figures = result["eval"]
    assert (result["greedy"], result["seed"], len(result["warnings"])) == (False, 0, 1)
    assert figures["episodes"] == 40
    wins = sum(ending["episodes"] for ending in figures["endings"] if ending["success"])
    assert figures["success_interval"] == pytest.approx(wilson_interval(wins, 40))
    assert sum(ending["episodes"] for ending in figures["endings"]) == 40
    assert set(figures["rules"]) == {f"jill.ask_for_exit.steps[{i}]" for i in range(3)}

    rows = list(csv.DictReader((out / "help_as_helper" / "episodes.csv").read_text().splitlines()))
    assert [int(row["episode"]) for row in rows] == list(range(40))
    assert sum(int(row["success"]) for row in rows) == wins
    assert np.mean([float(row["length"]) for row in rows]) == pytest.approx(figures["mean_length"])
    failures = sorted((out / "help_as_helper").glob("failure-*.txt"))
    assert len(failures) == min(2, 40 - wins)
    assert len(list((out / "help_as_helper").glob("success-*.txt"))) == min(2, wins)
    for path in failures:
        number = int(path.stem.removeprefix("failure-"))
        assert rows[number]["success"] == "0"
        text = path.read_text(encoding="utf-8")
        assert text.startswith(f"help_as_helper, test episode {number}, agent ")
        assert f"no success ({rows[number]['outcome']}) after {rows[number]['length']} steps" in text
        with Image.open(path.with_suffix(".gif")) as film:
            assert 1 < film.n_frames <= int(rows[number]["length"]) + 1  # type: ignore[attr-defined]


@pytest.mark.thorough("plays several evaluations")
def test_seed_and_greedy(help_run: Path, capsys: Capture) -> None:
    def play(*more: str) -> Any:
        (result,) = evaluated(capsys, str(help_run), "--episodes", "20", *more)
        return result["eval"]

    assert play() == play("--seed", "0")
    assert play()["mean_length"] != play("--seed", "1")["mean_length"]
    greedy = play("--greedy")
    assert greedy["actions"] == "most probable actions"
    assert greedy == play("--greedy", "--seed", "1")


def test_the_first_episodes_are_the_same_however_many_are_played(help_run: Path, tmp_path: Path) -> None:
    """More episodes than are played together, then fewer."""
    for count in (140, 20):
        command = ["evaluate", str(help_run), "--episodes", str(count), "--record", "0"]
        assert main([*command, "--out", str(tmp_path / str(count)), "--device", "cpu"]) == 0
    many, few = (
        (tmp_path / count / "help" / "episodes.csv").read_text().splitlines() for count in ("140", "20")
    )
    assert (len(many), len(few)) == (141, 21)
    assert many[:21] == few


def test_a_suite(capsys: Capture) -> None:
    (result,) = evaluated(capsys, "random", "--on", "social_env", "--episodes", "60")
    endings = result["eval"]["endings"]
    won = next(e for e in endings if e["outcome"] == "dance: success@47")
    assert (won["file"], won["line"], won["success"]) == ("scenarios/dance.yaml", 47, True)
    assert won["text"].startswith("dance: success: ")
    assert any(name.startswith("talkitout: wizard.") for name in result["eval"]["rules"])


def test_what_does_not_fit_is_refused_and_the_rest_is_kept(
    help_run: Path, tmp_path: Path, capsys: Capture
) -> None:
    command = ["evaluate", str(help_run), "--on", "help", "--on", "talkitout", "--episodes", "10"]
    assert main([*command, "--out", str(tmp_path), "--record", "0", "--device", "cpu"]) == 2
    assert "talkitout: checkpoint is for actions (8, 2, 2, 2)" in capsys.readouterr().err
    (result,) = json.loads((tmp_path / "evaluation.json").read_text())
    assert result["scenario"] == "help"
    assert result["warnings"] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["random"], "random plays any scenario; name one by --on"),
        (["nowhere", "--on", "help"], "nowhere"),
        (["random", "--on", "help", "--record", "3"], "--record: expected --out DIR as well"),
        (["random", "--on", "help", "--seed", str(1 << 63)], "seed: got 9223372036854775808"),
        (["human", "--on", "help", "--json"], "--json: the agent 'human'"),
        (["random", "--on", "help", "--tell", "nothing"], "--tell: the agent 'random' has no use for it"),
        (["oracle", "--on", "help", "--goal", "Go."], "--goal: the agent 'oracle' has no use for it"),
        (
            ["shipped:help", "--on", "help", "--language", "de"],
            "--language: the agent 'shipped:help' has no use",
        ),
        (["llm:m", "--on", "help", "--view", "room"], "--view: the agent 'llm:m' has no use for it"),
        (
            ["human", "--on", "help", "--tell", "instructions"],
            "--tell: got 'instructions', but help has none",
        ),
    ],
)
def test_wrong_usage(arguments: list[str], message: str, capsys: Capture) -> None:
    assert main(["evaluate", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_endings_are_the_lines_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "corridor"]) == 0
    loaded = socialai_dsl.load("corridor.yaml")
    endings = endings_of(loaded, socialai_dsl.compile(loaded))
    lines = Path("corridor.yaml").read_text().splitlines()
    told = [ending for ending in endings if ending.line is not None]
    assert told
    for ending in told:
        assert ending.line is not None
        assert lines[ending.line - 1].strip().removeprefix("- ") == ending.text
        assert ending.place == f"corridor.yaml:{ending.line}"
    assert [(e.name, e.text, e.place) for e in endings[-2:]] == [
        ("deadly", "stepped on what is deadly", ""),
        ("timeout", "out of time", ""),
    ]


def test_long_endings_are_cut() -> None:
    ending = Ending("won", True, "success: " + "x" * 100)
    assert ending.short(20) == "success: xxxxxxxxxx…"
    assert ending.short(200) == ending.text


def test_recordings_show_every_way_of_failing() -> None:
    """Seven failures of one kind, one of another."""
    outcome = np.array([1, 1, 1, 0, 1, 1, 2, 1, 1, 0])
    result = EvalResult(outcome == 0, outcome, np.ones(10, np.int64), np.zeros(10), ("won", "late", "dead"))
    nothing: Any = None
    evaluation = Evaluation("any", nothing, nothing, Player("random"), result, [], {})
    assert evaluation.pick(False, 3) == [0, 1, 6]
    assert evaluation.pick(False, 100) == [0, 1, 2, 4, 5, 6, 7, 8]
    assert evaluation.pick(True, 3) == [3, 9]
    assert evaluation.pick(True, 0) == []
