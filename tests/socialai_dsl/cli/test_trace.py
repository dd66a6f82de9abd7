"""`socialai trace`: an episode step by step, for people and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main
from socialai_dsl.traces.document import Trace
from tests.tiny import Folder

Capture = pytest.CaptureFixture[str]

COVERAGE = ["--part", "coverage", "--seconds", "0"]

SHY = """
frames:
  shy:
    states:
      on: {then: [{hears: Say hello, when: distance(agent) <= 2, say: Hello.}]}
cast:
  guide: {at: [5, 1], facing: left, frame: shy}
  peers: {count: 2, place: row(4), frame: shy}
  agent: {at: [1, 1], facing: right}
outcome: [{success: agent.said("Say bye")}]
"""


@pytest.fixture
def shy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    Folder(tmp_path).write("shy", SHY)
    monkeypatch.chdir(tmp_path)
    return "shy.yaml"


def test_why_does_my_guide_not_answer(shy: str, capsys: Capture) -> None:
    assert (
        main(["trace", shy, "--why", "guide", "--do", "Say hello", "--do", "forward", "--do", "f Say hello"])
        == 0
    )
    printed = capsys.readouterr().out
    assert "distance(agent) <= 2 is false: distance(agent) is 4" in printed
    assert "heard   Guide: Hello." in printed
    assert "fired  guide in on  shy.yaml:6" in printed
    assert "peers" not in printed.split("-- step 1")[1].split("\n\n", 2)[2].split("-- step 2")[0]
    assert printed.rstrip().endswith("not ended after 3 steps, reward 0.000")


def test_it_fits_a_terminal_and_has_no_colour_elsewhere(capsys: Capture) -> None:
    assert main(["trace", "talkitout", "--seed", "3", "--agent", "oracle"]) == 0
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 100
    assert "\x1b" not in printed
    assert "changed wizard.state: stranger -> acquainted" in printed
    assert 'agent   none, says "Open sesame"' in printed
    assert "talkitout.yaml:30  as before" in printed
    assert printed.splitlines()[-1].startswith("success (success@51) after 21 steps, reward 0.")


def reasons(trace: Trace, moment: int) -> dict[str, str]:
    """Member -> why its rules did not fire."""
    return {trace.rules[rule].who: trace.texts[why] for rule, why in trace.moments[moment].others}


def test_json_is_a_document_of_replays(shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, "--json", "--do", "Say hello", "--do", "Say bye"]) == 0
    trace = Trace.model_validate_json(capsys.readouterr().out)
    assert (trace.scenario, trace.agent, trace.succeeded) == (shy, "typed", True)
    start, first, second = trace.moments
    assert start.agent == (1, 1, 0)
    assert (first.t, first.said, first.heard, first.fired) == (1, "Say hello", [], [])
    assert "distance(agent) is 4" in reasons(trace, 1)["guide"]
    assert [trace.rules[rule].who for rule in second.fired] == ["outcome"]
    assert second.ended is not None
    assert (second.ended.name, second.ended.success) == ("success@11", True)
    assert 'success: agent.said("Say bye")' in second.ended.text


def test_one_of_a_group_is_named(shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, "--why", "peers[1]", "--do", "Say hello"]) == 0
    printed = capsys.readouterr().out
    assert "peers[1] in on" in printed
    assert "peers[0] in on" not in printed


def test_a_whole_group_and_who_has_no_rules(shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, "--why", "peers", "--why", "agent", "--do", "Say hello"]) == 0
    printed = capsys.readouterr().out
    assert "peers[0] in on" in printed
    assert "peers[1] in on" in printed
    assert "guide in" not in printed
    assert "none   agent: no rule was asked" in printed


def test_acts_have_casts_of_their_own(capsys: Capture) -> None:
    """A member of a later act can be asked about from the start."""
    suite = str(Path(__file__).parents[3] / "scenarios" / "school" / "collaboration_in_turn.yaml")
    assert main(["trace", suite, "--steps", "2", "--why", "partner", "--agent", "random"]) == 0
    assert "-- step 2" in capsys.readouterr().out


def test_a_window_of_the_episode(capsys: Capture) -> None:
    command = ["trace", "dance", "--agent", "random", "--seed", "1", "--steps", "2"]
    assert main([*command, "--from", "3"]) == 0
    printed = capsys.readouterr().out
    assert [f"-- step {t} " in printed for t in range(1, 6)] == [False, False, True, True, False]
    assert main([*command, "--json"]) == 0
    assert len(Trace.model_validate_json(capsys.readouterr().out).moments) == 3


def test_a_layout_and_a_test_episode(shy: str, capsys: Capture) -> None:
    Path("room.json").write_text('{"guide": {"at": [3, 1]}}', encoding="utf-8")
    assert main(["trace", shy, "--layout", "room.json", "--do", "Say hello"]) == 0
    assert "heard   Guide: Hello." in capsys.readouterr().out
    Path("room.yaml").write_text("guide:\n  at: [3, 1]  # beside the agent\n", encoding="utf-8")
    for written in ("room.yaml", "{guide: {at: [3, 1]}}", '{"guide": {"at": [3, 1]}}'):
        assert main(["trace", shy, "--layout", written, "--do", "Say hello"]) == 0
        assert "heard   Guide: Hello." in capsys.readouterr().out
    assert main(["trace", shy, "--test-episode", "4", "--do", ""]) == 0
    assert "test episode 4" in capsys.readouterr().out


def test_a_suite_says_what_it_plays(capsys: Capture) -> None:
    assert main(["trace", "social_env", "--json", "--steps", "1", "--agent", "random"]) == 0
    trace = Trace.model_validate_json(capsys.readouterr().out)
    assert trace.moments[0].member
    assert len(trace.moments) == 2


def test_without_a_script_chance_plays(shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, "--json", "--steps", "2"]) == 0
    assert json.loads(capsys.readouterr().out)["agent"] == "random"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--why", "guid"], "did you mean 'guide'?"),
        (["--why", "nobody"], "expected one of agent, guide, peers[0], peers[1], world, outcome"),
        (["--do", "Sing a song"], "do: "),
        (["--steps", "0"], "--steps: got 0, expected at least 1"),
        (["--from", "-1"], "--from: got -1, expected at least 1"),
        (["--seed", "-1"], "--seed: got -1, expected at least 0"),
        (["--test-episode", "-1"], "--test-episode: got -1"),
        (["--layout", "nowhere.json"], "No such file or directory: nowhere.json"),
        (["--layout", "shy.yaml"], "layout"),
        (["--layout", "shy.txt"], "is no JSON"),
        (["--layout", "{guide: {at: [3, 1}"], "which is neither JSON nor YAML: "),
        (["--layout", "wrong.json"], "guide.at"),
        (["--agent", "oracle"], "has no frame"),
        (["--json", "--from", "2"], "--json: got --why or --from with it"),
        (["--json", "--why", "guide"], "--json: got --why or --from with it"),
    ],
)
def test_wrong_usage_is_said_in_one_line(shy: str, options: list[str], said: str, capsys: Capture) -> None:
    Path("shy.txt").write_text("guide", encoding="utf-8")
    Path("wrong.json").write_text('{"guide": {"at": [0, 99]}}', encoding="utf-8")
    assert main(["trace", shy, *options]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""
    assert "Traceback" not in captured.err


def test_a_slip_in_a_layout_has_its_place(shy: str, capsys: Capture) -> None:
    Path("slip.yaml").write_text("guide: {at: [3, 1}\n", encoding="utf-8")
    assert main(["trace", shy, "--layout", "slip.yaml"]) == 1
    assert "slip.yaml:1:" in "".join(capsys.readouterr())


def test_a_trained_agent_can_be_watched(shy: str, capsys: Capture) -> None:
    quick = [
        "--frames",
        "1500",
        "--envs",
        "32",
        "--eval-episodes",
        "5",
        "--device",
        "cpu",
        "--out",
        "trained",
    ]
    assert main(["run", shy, *quick]) == 0
    capsys.readouterr()
    assert main(["trace", shy, "--agent", "trained", "--steps", "3", "--json"]) == 0
    trace = Trace.model_validate_json(capsys.readouterr().out)
    assert trace.agent == "trained"
    assert len(trace.moments) == 4 or trace.moments[-1].ended
    assert main(["check", shy, "--agent", "trained", "--episodes", "5", "--json", *COVERAGE]) == 0
    assert json.loads(capsys.readouterr().out)[0]["episodes"] == {"trained": 5}
    assert main(["trace", "dance", "--agent", str(Path("trained").resolve())]) == 2
    assert "checkpoint is for" in capsys.readouterr().err


def test_lines_are_typed_as_in_play(shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, "--json", "--do", ".", "--do", "none Say hello", "--do", "f"]) == 0
    moments = Trace.model_validate_json(capsys.readouterr().out).moments
    assert [(moment.did, moment.said) for moment in moments[1:]] == [
        ("none", None),
        ("none", "Say hello"),
        ("forward", None),
    ]
    assert main(["trace", shy, "--do", "frward"]) == 2
    assert "did you mean 'forward'?" in capsys.readouterr().err


def test_any_room_of_a_seed_can_be_opened(capsys: Capture) -> None:
    """The rooms that `check` and `coverage` name."""
    envs = sd.make_vec("talkitout", num_envs=18)
    envs.reset(seed=4)
    assert main(["trace", "talkitout", "--seed", "4", "--index", "17", "--json", "--do", "."]) == 0
    trace = Trace.model_validate_json(capsys.readouterr().out)
    assert trace.episode == "seed 4, room 17"
    there = envs.unwrapped.describe(17)
    assert trace.moments[0].agent[:2] == tuple(there["agent"]["at"])
    assert trace.moments[0].state["let.exit"] == there["let"]["exit"]
    envs.close()


@pytest.mark.parametrize(
    "options",
    [["--index", "-1"], ["--index", "1", "--test-episode", "1"], ["--test-episode", "1", "--index", "0"]],
)
def test_rooms_that_there_are_not(options: list[str], shy: str, capsys: Capture) -> None:
    assert main(["trace", shy, *options]) == 2
    assert "index: " in capsys.readouterr().err
