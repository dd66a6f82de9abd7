"""`make oracles`: what a script does not solve is proven unsolvable, or the script's fault."""

import json
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.scripts import play_script
from tools.oracles import main

Capture = pytest.CaptureFixture[str]

# A fence parts the room; the agent is put on either side, and the way out is on the right.
HALVES = """
scenario: halves
horizon: 20
grammar: {templates: [Say <noun>], nouns: [it]}
actions: [left, right, forward, toggle, done]
room: {size: 5}
objects:
  fences: {type: fence, at: [[2, 1], [2, 2], [2, 3]]}
  gate: {type: door, at: [4, 2]}
cast: {agent: {place: anywhere}}
outcome:
  - success: agent.at(gate)
  - failure: agent.did(done)
"""
ORACLE = """
variant: halves_oracle
of: halves.yaml
set:
  cast.agent.frame: oracle
  frames.oracle:
    steps:
      - {do: %s}
      - {state: there, do: stay, for: ever}
"""


@pytest.fixture
def halves(tmp_path: Path) -> str:
    (tmp_path / "halves.yaml").write_text(HALVES)
    (tmp_path / "halves_oracle.yaml").write_text(ORACLE % "enter(gate)")
    return str(tmp_path / "halves.yaml")


def lazy(halves: str) -> str:
    """The same with a script that only walks up to the gate."""
    Path(halves).with_name("halves_oracle.yaml").write_text(ORACLE % "go_next_to(gate)")
    return halves


def starts_on_the_right(scenario: str, index: int, seed: int) -> bool:
    env = socialai_dsl.make(scenario)
    env.reset(seed=seed, options={"index": index})
    return bool(env.describe()["agent"]["at"][0] > 2)


def test_what_is_not_solved_is_proven_unsolvable(halves: str) -> None:
    report = play_script(halves, 40, 5, 10_000)
    right = sum(starts_on_the_right(halves, index, 5) for index in range(40))
    assert 0 < right < 40
    assert report.solved == right
    assert [room.index for room in report.unsolved] == [
        index for index in range(40) if not starts_on_the_right(halves, index, 5)
    ]
    assert {(room.verdict, room.exact, room.steps) for room in report.unsolved} == {
        ("unsolvable", True, None)
    }
    assert {room.states for room in report.unsolved} == {3 * 4}, "three cells, four directions"
    assert {room.outcome for room in report.unsolved} == {"timeout"}
    assert report.ceiling == report.success_rate == right / 40
    assert 3 <= report.mean_length <= 12


def test_a_script_that_gives_up_is_at_fault(halves: str) -> None:
    report = play_script(lazy(halves), 40, 5, 10_000)
    assert report.solved == 0
    assert report.mean_length == 0
    for room in report.unsolved:
        assert room.verdict == ("solvable" if starts_on_the_right(halves, room.index, 5) else "unsolvable")
        assert (room.steps is not None) == (room.verdict == "solvable")
    assert report.ceiling == 1 - len(report.found("unsolvable")) / 40


def test_a_search_may_give_up(halves: str) -> None:
    report = play_script(halves, 40, 5, 3)
    assert len(report.found("undecided")) == 40 - report.solved
    assert report.ceiling == 1, "nothing is proven"


def test_without_a_script_there_is_nothing_to_play(halves: str) -> None:
    Path(halves).with_name("halves_oracle.yaml").unlink()
    with pytest.raises(
        UsageError, match="the agent of halves has no frame, and there is no variant `oracle`"
    ):
        play_script(halves, 4, 0, 10)


def test_the_command(halves: str, capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    assert main([halves, "--episodes", "40", "--seed", "5", "--out", str(page)]) == 0
    printed = capsys.readouterr().out
    report = play_script(halves, 40, 5, 10_000)
    assert f"{report.solved} of 40 rooms solved" in printed
    assert f"{40 - report.solved} cannot be solved (seed 5, index {report.unsolved[0].index}" in printed
    rows = [line for line in page.read_text().splitlines() if line.startswith("| ")]
    assert len([row for row in rows if "| timeout | unsolvable |" in row]) == 40 - report.solved


def test_a_fault_is_a_finding(halves: str, capsys: Capture) -> None:
    assert main([lazy(halves), "--episodes", "20", "--json"]) == 1
    (report,) = json.loads(capsys.readouterr().out)
    assert report["rooms"] == len(report["unsolved"]) == 20
    assert {room["verdict"] for room in report["unsolved"]} == {"solvable", "unsolvable"}
    assert report["success_rate"] == 0 < report["ceiling"] < 1


def test_the_script_of_talkitout(capsys: Capture) -> None:
    """About 3.4 per cent of its rooms cannot be solved."""
    report = play_script("talkitout", 400, 0, 10_000)
    assert 0.92 < report.success_rate < 0.99
    assert report.success_rate <= report.ceiling < 1
    assert not report.found("undecided")
    assert all(room.exact for room in report.unsolved)


@pytest.mark.parametrize("options", [["--episodes", "0"], ["--states", "0"], ["--seed", "-1"], ["nowhere"]])
def test_usage(options: list[str]) -> None:
    assert main(options) == 2
