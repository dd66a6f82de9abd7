"""`socialai check --part coverage`: what came about, by file and line, and what never did."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from tests.tiny import Folder

Capture = pytest.CaptureFixture[str]

COVERAGE = ["--part", "coverage", "--seconds", "0"]

DEAF = """
frames:
  deaf:
    states:
      on:
        then:
          - {when: t == 1, say: Hm., goto: silent}
          - {id: never_hears, hears: Say hello, when: t < 0, say: Hello.}
      silent: {}
cast: {guide: {at: [5, 1], frame: deaf}, agent: {at: [1, 1]}}
"""


@pytest.fixture
def deaf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    Folder(tmp_path).write("deaf", DEAF)
    monkeypatch.chdir(tmp_path)
    return "deaf.yaml"


def test_what_never_happened_comes_last(deaf: str, capsys: Capture) -> None:
    assert main(["check", deaf, "--agent", "random", "--episodes", "20", *COVERAGE]) == 0
    lines = capsys.readouterr().out.splitlines()
    never = lines.index("never:")
    assert any(line.startswith("deaf.yaml:8") and line.split()[-1] == "20" for line in lines[:never])
    assert lines[never + 1].split() == ["deaf.yaml:9", "rule", "never_hears"]
    assert lines[-1] == "1 of 2 rules, 2 of 2 states, 1 of 1 outcome: 80.0 %"


@pytest.mark.parametrize(("least", "code"), [("80", 0), ("81", 1), ("0", 0)])
def test_it_can_fail(deaf: str, least: str, code: int, capsys: Capture) -> None:
    assert (
        main(["check", deaf, "--agent", "random", "--episodes", "20", "--fail-under", least, *COVERAGE])
        == code
    )


def test_json_counts_for_each_agent(capsys: Capture) -> None:
    assert main(["check", "diverse_exit", "help", "--episodes", "24", "--json", *COVERAGE]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report["scenarios"] == ["diverse_exit", "help"]
    assert report["episodes"] == {"random": 48, "oracle": 48}
    files = {Path(part["file"]).name for part in report["parts"]}
    assert files == {"diverse_exit.yaml", "teacher.yaml", "help.yaml"}, (
        "the script's own rules are not the scenario's"
    )
    start = next(part for part in report["parts"] if part["name"] == "introduction.stranger")
    assert start["times"] == {"random": 24, "oracle": 24}
    assert sum(report["endings"].values()) == 96
    parts = report["parts"]
    happened = sum(sum(part["times"].values()) > 0 for part in parts)
    assert report["percent"] == round(100 * happened / len(parts), 2)
    assert sum(kind["of"] for kind in report["summary"].values()) == len(parts)


def test_chance_is_reproducible(deaf: str, capsys: Capture) -> None:
    outputs = []
    for _ in range(2):
        assert (
            main(["check", "cointhief", "--agent", "random", "--episodes", "30", "--seed", "5", *COVERAGE])
            == 0
        )
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]


def test_members_of_a_suite_count(capsys: Capture) -> None:
    assert main(["check", "social_env", "--agent", "oracle", "--episodes", "40", "--json", *COVERAGE]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert {Path(part["file"]).stem for part in report["parts"]} >= {"talkitout", "dance", "help", "showme"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--episodes", "0"], "--episodes: got 0, expected at least 1"),
        (["--seed", "-2"], "--seed: got -2, expected at least 0"),
        (["--fail-under", "101"], "--fail-under: got 101, expected a per cent from 0 to 100"),
        (["--agent", "oracle"], "has no frame"),
    ],
)
def test_wrong_usage_is_said_in_one_line(deaf: str, options: list[str], said: str, capsys: Capture) -> None:
    assert main(["check", deaf, *options, *COVERAGE]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""


def test_mistakes_are_findings(tmp_path: Path, capsys: Capture) -> None:
    path = Folder(tmp_path).write("wrong", "cast: {agent: {at: [1, 1]}}\noutcome: [{success: agent.flies}]\n")
    assert main(["check", str(path), *COVERAGE]) == 1
    assert "wrong.yaml:4" in capsys.readouterr().err
