"""`socialai test` plays dialogues; `trace --save-test` writes them; play never reads them."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]

SCENARIO = """
scenario: lodge
horizon: 20
earshot: 3
params: {password: {default: '"rose"', values: {rose: '"rose"', fern: '"fern"'}}}
grammar: {templates: [Hello <noun>, It is <noun>], nouns: [there, rose, fern]}
room: {width: 7, height: 5}
define: {secret: $password}
objects:
  gate: {type: door, at: [3, 0], color: red, state: locked}
frames:
  keep:
    let: {asked: 0}
    states:
      waiting:
        then:
          - {hears: Hello there, when: distance(agent) <= 2, say: Who?, goto: asking, set: {asked: asked + 1}}
      asking:
        then:
          - {hears: It is <secret>, say: Pass the <gate.color> gate, cause: [gate.unlock, gate.open], goto: done_with}
      done_with: {}
cast:
  porter: {name: Ann, at: [1, 1], facing: right, frame: keep}
  agent: {at: [3, 1], facing: up}
outcome:
  - {id: out, success: agent.at(gate)}
  - {id: gave_up, failure: agent.did(done)}
"""
TESTS = """
tests_of: lodge.yaml
tests:
  passes_the_gate:
    play:
      - {state: {porter: waiting}, true: porter.asked == 0}
      - {do: It is rose}
      - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}, true: prev(porter.is(waiting))}
      - {do: It is rose, hears: "Ann: Pass the <gate.color> gate", not: [gate.locked, agent.at(gate)]}
      - {do: [none, forward]}
    ends: out
    reward: 0.775
  with_another_password:
    of: ?password=fern
    room: {seed: 1}
    play:
      - {do: Hello there, hears: any}
      - {do: It is fern, hears: "Ann: Pass the red gate"}
    ends: open
"""


@pytest.fixture(autouse=True)
def lodge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lodge.yaml").write_text(SCENARIO.lstrip())
    Path("lodge.tests.yaml").write_text(TESTS.lstrip())


def test_with(steps: str) -> str:
    return f"tests_of: lodge.yaml\ntests:\n  mine:\n{steps}"


test_with.__test__ = False  # type: ignore[attr-defined]


@pytest.mark.parametrize("path", ["lodge.yaml", "lodge.tests.yaml", "."])
def test_tests_that_pass(path: str, capsys: Capture) -> None:
    assert main(["test", path]) == 0
    *lines, summary = capsys.readouterr().out.splitlines()
    assert lines == [
        "passes  lodge.yaml  passes_the_gate",
        "passes  lodge.yaml?password=fern  with_another_password",
    ]
    assert summary.startswith("2 tests: 2 passed, 0 failed, ")


def test_a_test_that_fails_says_why_and_how_to_see_it(capsys: Capture) -> None:
    Path("lodge.tests.yaml").write_text(
        test_with(
            """    room: {seed: 2, layout: {agent: {at: [5, 1]}}}
    play:
      - {do: left}
      - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}, true: porter.asked == 1}
"""
        )
    )
    assert main(["test", "lodge.yaml"]) == 1
    out = capsys.readouterr().out
    assert out.splitlines()[:-1] == [
        "fails   lodge.yaml  mine",
        'lodge.tests.yaml:7:35: S803 `mine`, step 2: expected "Ann: Who?", heard nothing',
        '   7 |       - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}, true: porter.asked == 1}',
        "                                         ^~~~~~~~~",
        "  not    porter in waiting  lodge.yaml:16  hears: Hello there, when: distance(agent) <= 2, "
        "set: {asked: asked + 1}, say: Who?, goto: asking",
        '         -> hears: Hello there: nothing was heard: the agent said "Hello there" at distance 4, its voice '
        "carries 3",
        "  help: to see it: socialai trace lodge.yaml --seed 2 --layout '"
        '{"agent": {"at": [5, 1]}}\' --do left --do \'Hello there\'',
        "lodge.tests.yaml:7:63: S803 `mine`, step 2: `porter` is in `waiting`, expected `asking`",
        '   7 |       - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}, true: porter.asked == 1}',
        "                                                                     ^",
        *out.splitlines()[4:7],
        "lodge.tests.yaml:7:78: S803 `mine`, step 2: `porter.asked == 1` is false, expected true",
        '   7 |       - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}, true: porter.asked == 1}',
        "                                                                                    ^~~~~~~~~~~~~~~~~",
        "  -> porter.asked == 1 is false: porter.asked is 0",
        *out.splitlines()[4:7],
    ]


def test_what_is_shown_to_be_pasted_shows_the_same(capsys: Capture) -> None:
    layout = '{"agent": {"at": [5, 1]}}'
    words = ["trace", "lodge.yaml", "--seed", "2", "--layout", layout, "--do", "left", "--do", "Hello there"]
    assert main(words) == 0
    assert "at distance 4, its voice carries 3" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ("    play: [{do: left}]\n    ends: out\n", "step 1: the episode goes on, expected `out`"),
        ("    play: [{do: done}]\n    ends: open\n", "the episode ended with `gave_up`, expected `open`"),
        ("    play: [{do: done}]\n    ends: failure\n", None),
        ("    play: [{do: done}]\n    ends: timeout\n", "ended with `gave_up`, expected `timeout`"),
        ("    play: [{do: done}]\n    reward: 0.5\n", "earned 0.000, expected 0.5"),
        ("    play: [{do: [done, left]}]\n", "the episode ended with `gave_up` before, after 1 acts"),
        (
            "    play: [{do: left}, {do: Hello there}]\n",
            'step 2: expected nothing, heard "Ann: Who?"',
        ),
        ("    play: [{do: left, not: t == 1}]\n", "`t == 1` is true, expected false"),
        ("    room: {layout: {agent: {at: [9, 9]}}}\n    play: [{do: left}]\n", "agent.at[0]: got 9"),
        ("    room: {layout: nowhere.json}\n    play: [{do: left}]\n", "there is no such file"),
        ("    room: {layout: {nobody: {}}}\n    play: [{do: left}]\n", "there is no 'nobody'"),
        ("    room: {test_episode: 9999999999}\n    play: [{do: left}]\n", "got 9999999999; expected"),
        ("    room: {test_episode: 3}\n    play: [{do: left}]\n", None),
        ("    room: {seed: 1, index: 70}\n    play: [{do: left}]\n", None),
    ],
)
def test_what_goes_otherwise_is_said(steps: str, said: str | None, capsys: Capture) -> None:
    Path("lodge.tests.yaml").write_text(test_with(steps))
    assert main(["test", "lodge.yaml", "--json"]) == int(said is not None)
    (one,) = json.loads(capsys.readouterr().out)
    assert one["passes"] is (said is None)
    found = [finding["message"] for finding in one["findings"]]
    assert (said is None and not found) or said in found[0]


def test_a_test_without_a_seed_holds_in_several_rooms(capsys: Capture) -> None:
    text = SCENARIO.replace("agent: {at: [3, 1]", "agent: {at: [pick(3 | 5), 1]")
    Path("lodge.yaml").write_text(text.lstrip())
    steps = '    play: [{do: Hello there, hears: "Ann: Who?"}]\n'
    Path("lodge.tests.yaml").write_text(test_with(steps))
    assert main(["test", "lodge.yaml"]) == 1
    assert "heard nothing" in capsys.readouterr().out


def test_tests_are_chosen_by_name(capsys: Capture) -> None:
    assert main(["test", ".", "-k", "gate and not (fern or another)"]) == 0
    assert "1 test: 1 passed" in capsys.readouterr().out
    assert main(["test", "lodge.yaml?password=fern"]) == 0
    assert "1 test: 1 passed" in capsys.readouterr().out
    for wrong in ("nonesuch", "gate and", "t == 1"):
        assert main(["test", ".", "-k", wrong]) == 2
        assert capsys.readouterr().err.startswith("socialai: ")


def test_mistakes_are_findings_in_every_format_and_nothing_is_played(capsys: Capture) -> None:
    Path("lodge.tests.yaml").write_text(test_with("    play: [{do: Helo there}]\n    ends: outt\n"))
    for chosen, in_report in ((["text"], False), (["sarif"], True), (["github"], True), (["junit"], True)):
        assert main(["test", "lodge.yaml", "--format", *chosen]) == 1
        said = capsys.readouterr()
        report, empty = (said.out, said.err) if in_report else (said.err, said.out)
        assert "S401" in report, report
        assert "S201" in report, report
        assert empty == ""


def test_a_file_of_tests_that_builds_on_another_has_its_tests_too(capsys: Capture) -> None:
    Path("first.tests.yaml").write_text(test_with("    play: [{do: left}]\n"))
    Path("more.tests.yaml").write_text(
        "extends: first.tests.yaml\ntests_of: lodge.yaml\ntests: {more: {play: [{do: right}]}}\n"
    )
    assert main(["test", "more.tests.yaml"]) == 0
    assert "2 tests: 2 passed" in capsys.readouterr().out


def test_wrong_usage_ends_with_2() -> None:
    assert main(["test", "nonesuch"]) == 2
    assert main(["test", "talkitout_oracle"]) == 2  # it has none


def test_formats(capsys: Capture) -> None:
    Path("other.tests.yaml").write_text(test_with("    play: [{do: left}]\n    ends: out\n"))
    assert main(["test", ".", "--format", "junit"]) == 1
    suite = ElementTree.fromstring(capsys.readouterr().out)
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("socialai test", "3", "1")
    (failed,) = [case for case in suite if len(case)]
    assert (failed.get("classname"), failed.get("name")) == ("socialai.test", "other.tests.yaml::mine")
    assert main(["test", ".", "--format", "sarif"]) == 1
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert [result["ruleId"] for result in run["results"]] == ["S803"]
    assert main(["test", ".", "--format", "github"]) == 1
    assert capsys.readouterr().out.startswith("::error file=other.tests.yaml,line=5,")


def test_play_never_reads_tests() -> None:
    plain = sd.compile(sd.load("lodge.yaml")).sha256
    Path("lodge.yaml").write_text(SCENARIO.lstrip() + TESTS.partition("lodge.yaml\n")[2])
    assert sd.compile(sd.load("lodge.yaml")).sha256 == plain
    tested = sd.frontend.check("lodge.yaml").tested
    assert [sd.compile(one.loaded).sha256 == plain for one in tested] == [
        True,
        False,
    ]  # the other has its `of`
    Path("lodge.yaml").write_text(SCENARIO.lstrip() + "tests: {wrong: {play: [{do: fly}]}}\n")
    assert sd.compile(sd.load("lodge.yaml")).sha256 == plain, "a mistake in a test keeps nobody from playing"


def test_validate_plays_the_acts_and_with_deep_the_dialogue(capsys: Capture) -> None:
    Path("lodge.tests.yaml").write_text(
        test_with("    play: [{do: left}]\n    ends: out\n  late:\n    play: [{do: [done, left]}]\n")
    )
    assert main(["validate", "lodge.tests.yaml", "--json"]) == 1
    assert [finding["code"] for finding in json.loads(capsys.readouterr().out)] == ["S804"]
    assert main(["validate", "lodge.tests.yaml", "--json", "--deep"]) == 1
    assert {finding["code"] for finding in json.loads(capsys.readouterr().out)} == {"S803", "S804"}


def test_tests_are_not_inherited(capsys: Capture) -> None:
    Path("lodge.yaml").write_text(SCENARIO.lstrip() + TESTS.partition("lodge.yaml\n")[2])
    Path("lodge.tests.yaml").unlink()
    Path("inn.yaml").write_text("scenario: inn\nextends: lodge.yaml\ncast: {porter: {name: Bob}}\n")
    Path("lodge_silent.yaml").write_text("variant: silent\nof: lodge.yaml\nset: {earshot: 1}\n")
    assert main(["validate", "--strict", "."]) == 0, capsys.readouterr().out
    capsys.readouterr()
    assert main(["test", "."]) == 0
    assert "2 tests: 2 passed" in capsys.readouterr().out


PLAYED = ["--seed", "4", "--do", "left", "--do", "right", "--do", "Hello there", "--do", "It is rose"]


def test_what_was_played_becomes_a_test(capsys: Capture) -> None:
    Path("lodge.tests.yaml").unlink()
    assert main(["trace", "lodge.yaml", *PLAYED, "--do", "forward", "--save-test", "goes_out"]) == 0
    assert "wrote the test `goes_out` into lodge.tests.yaml" in capsys.readouterr().err
    written = """tests_of: lodge.yaml
tests:
  goes_out:
    room: {seed: 4}
    play:
      - {do: [left, right]}
      - {do: Hello there, hears: "Ann: Who?", state: {porter: asking}}
      - {do: It is rose, hears: "Ann: Pass the red gate", state: {porter: done_with}}
      - {do: forward}
    ends: out
    reward: 0.775
"""
    assert Path("lodge.tests.yaml").read_text() == written
    assert main(["trace", "lodge.yaml?password=fern", "--do", "left", "--save-test", "another"]) == 0
    more = "  another:\n    of: ?password=fern\n    room: {seed: 0}\n    play:\n      - {do: left}\n    ends: open\n"
    assert Path("lodge.tests.yaml").read_text() == written + more
    assert main(["test", "lodge.yaml"]) == 0
    assert main(["fmt", "--check", "lodge.tests.yaml"]) == 0


def test_a_test_is_replaced_only_by_force(capsys: Capture) -> None:
    before = Path("lodge.tests.yaml").read_text()
    saving = ["trace", "lodge.yaml", "--do", "left", "--save-test", "passes_the_gate"]
    assert main(saving) == 2
    assert "has a test `passes_the_gate` already; --force replaces it" in capsys.readouterr().err
    assert Path("lodge.tests.yaml").read_text() == before
    assert main([*saving, "--force"]) == 0
    after = Path("lodge.tests.yaml").read_text()
    assert after.startswith("tests_of: lodge.yaml\ntests:\n  passes_the_gate:\n    room: {seed: 0}\n")
    assert after.endswith(before[before.index("  with_another_password") :])
    assert main(["test", "lodge.yaml"]) == 0


def test_what_cannot_be_saved_is_refused(capsys: Capture) -> None:
    do = ["--do", "left", "--save-test"]
    assert main(["trace", "lodge.yaml", *do, "no name"]) == 2
    assert main(["trace", "social_env", *do, "mine"]) == 2
    assert main(["trace", "lodge.yaml", "--do", "left", "--force"]) == 2
    Path("lodge.tests.yaml").write_text("scenario: other\n")
    assert main(["trace", "lodge.yaml", *do, "mine"]) == 2
    assert Path("lodge.tests.yaml").read_text() == "scenario: other\n"
    capsys.readouterr()
    assert main(["trace", "talkitout", *do, "mine"]) == 0
    assert capsys.readouterr().out.endswith(
        "\n  mine:\n    room: {seed: 0}\n    play:\n      - {do: left}\n    ends: open\n"
    )


def test_a_layout_may_lie_in_a_file_beside_the_test(capsys: Capture) -> None:
    Path("far.json").write_text('{"agent": {"at": [5, 1]}}')
    steps = "    room: {layout: far.json}\n    play: [{do: Hello there, hears: x}]\n"
    Path("lodge.tests.yaml").write_text(test_with(steps))
    assert main(["test", "lodge.yaml"]) == 1
    assert "trace lodge.yaml --seed 0 --layout far.json --do 'Hello there'" in capsys.readouterr().out
    words = ["trace", "lodge.yaml", "--layout", "far.json", "--do", "Hello there", "--save-test", "far"]
    assert main(words) == 0
    assert "layout: {agent: {at: [5, 1]}}" in Path("lodge.tests.yaml").read_text()
    assert main(["test", "lodge.yaml", "-k", "far"]) == 0
    Path("lodge.txt").write_text("agent")
    Path("slip.yaml").write_text("agent: {at: [5, 1}\n")
    Path("far.yaml").write_text("agent: {at: [5, 1]}\n")
    Path("lodge.tests.yaml").write_text(test_with(steps.replace("far.json", "far.yaml")))
    assert main(["test", "lodge.yaml"]) == 1
    assert "--layout far.yaml" in capsys.readouterr().out, "in that room, too, nothing is heard"
    for name, said in (
        ("../x.json", "lies outside"),
        ("lodge.txt", "is no JSON"),
        ("slip.yaml", "slip.yaml:1:"),
        ("x.json", "no such file"),
    ):
        Path("lodge.tests.yaml").write_text(test_with(steps.replace("far.json", name)))
        capsys.readouterr()
        assert main(["test", "lodge.yaml"]) == 1
        assert said in capsys.readouterr().out
