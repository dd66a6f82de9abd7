"""`socialai check`: what is printed about properties, and what counts as a failure."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.analysis.search import Search
from socialai_dsl.analysis.tally import Watch
from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]
ROOT = Path(__file__).parents[3]

# The gate stands open in front of the agent; the guard watches, and never gets tired of it.
GATE = """
scenario: gate
horizon: 10
actions: [left, right, forward, done]
grammar: {templates: [Say <noun>], nouns: [please]}
room: {size: 5}
objects: {gate: {type: door, state: open, at: [4, 2]}}
frames:
  watch:
    states:
      awake: {then: [{hears: Say please, say: Go on}, {when: agent.spoke and t < 0, goto: asleep}]}
      asleep: {}
cast:
  guard: {at: [3, 3], facing: up, frame: watch}
  agent: {at: [1, 2], facing: right}
outcome:
  - {success: agent.at(gate), id: out}
  - {failure: agent.did(done), id: gave_up}
"""


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    file = tmp_path / "gate.yaml"
    file.write_text(GATE)
    return file


def claiming(file: Path, *entries: str) -> str:
    file.write_text(GATE + "check:\n" + "".join(f"  - {entry}\n" for entry in entries))
    return str(file)


def test_what_holds_is_no_failure(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{reachable: out, share: 1}", "{within: 3}")
    assert main(["check", name, "--rooms", "3", "--seed", "4"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"{name}: 3 rooms of seed 4",
        "  holds: `reachable: out`: it can happen in 3 of 3 rooms",
        "  holds: `within: 3`: a shortest success takes at most 3 steps in 3 of 3 rooms, 3 in the longest that can be "
        "solved",
        "  holds: `knowable: true`: in 3 rooms success depends on nothing hidden",
        "  4 of 6 states, steps, rules and outcomes happen in some room",
        f"  {name}:11:55: warning: the rule `guard.watch.awake.then[1]` happens in none of these rooms",
        f"  {name}:12:7: warning: the state `guard.watch.asleep` happens in none of these rooms",
    ]


def test_what_fails_is_named_with_its_place_and_rooms(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{reachable: out}", "{never: gave_up}")
    assert main(["check", name, "--rooms", "2"]) == 1
    _, _, said, place, *_ = capsys.readouterr().out.splitlines()
    assert said == "  fails: `never: gave_up`: it can happen in 2 of 2 rooms; in room 0 after 1 step"
    assert (
        place
        == f"    at {name}:{1 + gate.read_text()[: gate.read_text().index('{never')].count(chr(10))}:6; rooms 0, 1"
    )


def test_what_is_undecided_fails_only_when_strict(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{never: guard.is(asleep)}")
    assert main(["check", name, "--rooms", "2", "--states", "3"]) == 0
    assert "  undecided: " in capsys.readouterr().out
    assert main(["check", name, "--rooms", "2", "--states", "3", "--strict"]) == 1
    capsys.readouterr()
    assert main(["check", name, "--rooms", "2"]) == 0
    assert "  undecided: " not in capsys.readouterr().out, "with enough states it is decided"


def test_without_a_script_an_oracle_fails(gate: Path, capsys: Capture) -> None:
    assert main(["check", claiming(gate, "{oracle: 0.1}"), "--rooms", "2"]) == 1
    assert "there is no variant `oracle`" in capsys.readouterr().out


@pytest.mark.parametrize("claims", [(), ("{reachable: out}",)])
def test_it_is_always_said_what_never_happens(gate: Path, claims: tuple[str, ...], capsys: Capture) -> None:
    if claims:
        claiming(gate, *claims)
    assert main(["check", str(gate), "--rooms", "2"]) == 0
    *_, happened, one, other = capsys.readouterr().out.splitlines()
    assert happened == "  4 of 6 states, steps, rules and outcomes happen in some room"
    assert [re.sub(r".*gate.yaml:", "", warning) for warning in (one, other)] == [
        "11:55: warning: the rule `guard.watch.awake.then[1]` happens in none of these rooms",
        "12:7: warning: the state `guard.watch.asleep` happens in none of these rooms",
    ]
    assert main(["check", str(gate), "--rooms", "2", "--strict"]) == 1


def test_json_has_the_same(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{never: gave_up}")
    assert main(["check", name, "--rooms", "2", "--json"]) == 1
    (report,) = json.loads(capsys.readouterr().out)
    assert (report["scenario"], report["rooms"], report["seed"]) == (name, 2, 0)
    assert [part["name"] for part in report["never_happens"]] == [
        "guard.watch.awake.then[1]",
        "guard.watch.asleep",
    ]
    found, known = report["properties"]
    assert (known["property"], known["verdict"]) == ("knowable: true", "holds")
    assert found["property"] == "never: gave_up"
    assert (found["verdict"], found["held"], found["against"], found["file"]) == ("fails", 0, [0, 1], name)


@pytest.mark.thorough("checks six scenarios")
def test_every_member_of_a_suite_is_checked(capsys: Capture) -> None:
    assert main(["check", "social_env", "--rooms", "3"]) == 0
    named = [line.split(":")[0] for line in capsys.readouterr().out.splitlines() if not line.startswith(" ")]
    assert named[:3] == ["talkitout", "dance", "cointhief"]
    assert len(named) == 6


def test_progress_is_told_beside_the_results(
    gate: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("socialai_dsl.analysis.effort._QUIET", 0.0)
    assert main(["check", claiming(gate, "{reachable: out}"), "--rooms", "2"]) == 0
    captured = capsys.readouterr()
    assert captured.err.splitlines()[:2] == [
        "reachable: out: room 0 of 2",
        "reachable: out: room 1 of 2",
    ]
    assert "room 1 of 2" not in captured.out


def test_quick_checks_tell_no_progress(gate: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socialai_dsl.analysis.effort._QUIET", 3600.0)
    assert main(["check", str(gate), "--rooms", "2"]) == 0
    assert capsys.readouterr().err == ""


def test_what_there_was_time_for_is_said(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{reachable: out}")
    assert main(["check", name, "--rooms", "2", "--seconds", "1e-9"]) == 0
    out = capsys.readouterr().out
    assert "  undecided: `reachable: out`: there was no time to look at a room" in out
    assert (
        "  of 2 rooms there was time for 0 for `reachable: out`, 0 for `knowable: true`; "
        "`--seconds` gives more time" in out
    )
    assert main(["check", name, "--rooms", "2", "--seconds", "1e-9", "--strict"]) == 1
    assert main(["check", name, "--rooms", "2", "--seconds", "0"]) == 0
    assert "there was time for" not in capsys.readouterr().out.partition("holds")[2]


def test_an_interrupted_check_tells_what_is_known(
    gate: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C in the third room of the second property."""
    rooms = 4
    searched = Search.solve
    calls = []

    def interrupting(self: Search, *arguments: Any) -> Any:
        calls.append(self)
        if len(calls) == rooms + 3:
            raise KeyboardInterrupt
        return searched(self, *arguments)

    monkeypatch.setattr(Search, "solve", interrupting)
    name = claiming(gate, "{reachable: out, share: 1}", "{never: guard.is(asleep)}", "{within: 3}")
    assert main(["check", name, "--rooms", str(rooms)]) == 130
    assert capsys.readouterr().out.splitlines() == [
        f"{name}: 4 rooms of seed 0",
        "  holds: `reachable: out`: it can happen in 4 of 4 rooms",
        "  holds: `never: guard.is(asleep)`: it can happen in 0 of 2 rooms",
        "  of 4 rooms there was time for 2 for `never: guard.is(asleep)`; it was interrupted",
    ]


@pytest.mark.parametrize(
    ("seconds", "expected"), [("-1", "at least 0"), ("inf", "at most 31622400"), ("nan", "at least 0")]
)
def test_seconds_are_a_number(gate: Path, seconds: str, expected: str, capsys: Capture) -> None:
    assert main(["check", str(gate), f"--seconds={seconds}"]) == 2
    assert f"--seconds: got {seconds}, expected {expected}" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--rooms", "--states"])
def test_numbers_are_at_least_one(gate: Path, option: str, capsys: Capture) -> None:
    assert main(["check", str(gate), option, "0"]) == 2
    assert f"{option}: got 0, expected at least 1" in capsys.readouterr().err


def test_the_example_of_the_page_holds(tmp_path: Path, capsys: Capture) -> None:
    page = (ROOT / "docs" / "checks.md").read_text(encoding="utf-8")
    example, *_ = re.findall(r"^```yaml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    grammar = "grammar: {templates: [Where is <noun>, Open <noun>], nouns: [the exit, sesame]}"
    head = f"scenario: page\nroom: {{size: 6}}\n{grammar}\n"
    file = tmp_path / "page.yaml"
    file.write_text(head + example.replace("cast:\n", "cast:\n  agent: {}\n"))
    assert main(["check", str(file), "--rooms", "3", "--strict"]) == 0, capsys.readouterr().out
    assert capsys.readouterr().out.count("  holds: ") == 7


def test_deep_tries_everything(gate: Path, capsys: Capture) -> None:
    name = claiming(gate, "{reachable: out, share: 1}")
    assert main(["check", name, "--rooms", "3", "--deep"]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "  holds: `reachable: out`: it can happen in 3 of 3 rooms",
        "  holds: `knowable: true`: in 3 rooms success depends on nothing hidden",
        "  4 of 6 states, steps, rules and outcomes happen in some room",
        f"  {name}:11:55: warning: the rule `guard.watch.awake.then[1]` happens in none of these rooms",
        f"  {name}:12:7: warning: the state `guard.watch.asleep` happens in none of these rooms",
        "  a success can be reached in 3 of 3 rooms, in 3 steps in the median and 3 at most",
        "  without seeing or hearing an NPC an agent can get at least 100.0% ± 0.0% (two standard errors)",
    ]


def test_deep_as_json(gate: Path, capsys: Capture) -> None:
    assert main(["check", str(gate), "--rooms", "3", "--deep", "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report["success"]["steps"] == [3, 3, 3]
    assert report["success"]["unsolved"] is None
    assert report["success"]["alone"] == {"success": 1.0, "error": 0.0, "rooms": 3, "undecided": 0}


def test_deep_fails_where_nothing_can_succeed(gate: Path, capsys: Capture) -> None:
    gate.write_text(GATE.replace("success: agent.at(gate)", "success: agent.at(gate) and guard.is(asleep)"))
    assert main(["check", str(gate), "--rooms", "2", "--deep"]) == 1
    assert "no way was found in rooms 0, 1" in capsys.readouterr().out


def two_parts(*options: str) -> list[str]:
    return ["check", "cointhief", "--part", "script", "--part", "coverage", "--agent", "random", *options]


def test_all_parts_share_the_time(capsys: Capture) -> None:
    assert main(two_parts("--seconds", "1e-9", "--rooms", "40", "--episodes", "30", "--json")) == 0
    played, solved = json.loads(capsys.readouterr().out)
    assert (played["planned"], played["episodes"], played["interrupted"]) == (30, {"random": 0}, False)
    assert (solved["planned"], solved["rooms"], solved["unsolved"], solved["interrupted"]) == (
        40,
        0,
        [],
        False,
    )
    assert main(two_parts("--seconds", "1e-9", "--rooms", "40", "--episodes", "30")) == 0
    out = capsys.readouterr().out
    assert "of 30 episodes there was time for 0; `--seconds` gives more time" in out
    assert "cointhief: no room was played\n  of 40 rooms there was time to play 0" in out


def test_an_interrupted_part_tells_what_is_known(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the second of the rooms that the script does not solve."""
    searched = Search.solve
    calls = []

    def interrupting(self: Search, *arguments: Any) -> Any:
        calls.append(self)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return searched(self, *arguments)

    command = ["check", "talkitout", "--part", "script", "--rooms", "100", "--seconds", "0"]
    assert main([*command, "--json"]) == 1, "only luck solves one of the rooms"
    (whole,) = json.loads(capsys.readouterr().out)
    monkeypatch.setattr(Search, "solve", interrupting)
    assert main([*command, "--json"]) == 130
    (part,) = json.loads(capsys.readouterr().out)
    assert len(whole["unsolved"]) > 2
    assert (part["rooms"], part["solved"]) == (100, whole["solved"])
    assert (part["interrupted"], part["searched"]) == (True, 1)
    assert part["unsolved"][0] == whole["unsolved"][0]
    assert {room["verdict"] for room in part["unsolved"][1:]} == {"undecided"}


def test_an_interrupted_game_counts_what_was_played(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    watched, calls = Watch.stepped, []

    def interrupting(self: Watch, *arguments: Any) -> None:
        calls.append(self)
        if len(calls) == 3:
            raise KeyboardInterrupt
        watched(self, *arguments)

    monkeypatch.setattr(Watch, "stepped", interrupting)
    assert main(two_parts("--episodes", "20", "--json")) == 130
    (found,) = json.loads(capsys.readouterr().out)
    assert found["interrupted"]
    assert found["episodes"]["random"] < 20 == found["planned"]


def test_a_variant_oracle_in_which_the_agent_follows_no_frame_is_no_script(
    gate: Path, capsys: Capture
) -> None:
    gate.with_name("gate_oracle.yaml").write_text("variant: oracle\nof: gate.yaml\nset: {horizon: 6}\n")
    assert main(["check", claiming(gate, "{script: perceives}"), "--rooms", "2"]) == 1
    out = capsys.readouterr().out
    assert "`script: perceives`" in out
    assert "there was time for" not in out
