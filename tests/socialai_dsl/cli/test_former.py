"""What earlier versions called otherwise still works, and says on one line of standard error what to write now."""

import json

import pytest

from socialai_dsl.cli.former import current
from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("typed", "now"),
    [
        ("codes S101", "explain S101"),
        ("coverage a.yaml --json", "check a.yaml --json --seconds 0 --part coverage --alone"),
        (
            "oracles a.yaml --episodes 40 --seed 5",
            "check a.yaml --rooms 40 --seed 5 --states 300000 --seconds 0 --part script",
        ),
        (
            "oracles a.yaml --states=9",
            "check a.yaml --states=9 --rooms 5000 --seconds 0 --part script",
        ),
        ("curves r0 r1", "report r0 r1 --curves curves.png"),
        ("curves r0 --out=c.png", "report r0 --curves=c.png"),
        ("check a.yaml --format json --strict", "check a.yaml --json --strict"),
        ("check --format=text a.yaml", "check a.yaml"),
        ("validate --format=json a.yaml", "validate --json a.yaml"),
        ("serve openenv --port 1 --scenario help", "serve help --port 1"),
        ("serve openenv --scenario=help", "serve help"),
    ],
)
def test_a_former_spelling(typed: str, now: str) -> None:
    words, advice = current(typed.split())
    assert words == now.split()
    assert advice is not None


@pytest.mark.parametrize(
    "typed", ["", "validate a.yaml --format sarif", "check a.yaml --json", "explain S101", "serve openenv"]
)
def test_what_is_written_now_stays(typed: str) -> None:
    assert current(typed.split()) == (typed.split(), None)


def test_scripts_of_all_that_ship_were_played_without_a_name() -> None:
    words, _ = current(["oracles"])
    assert words[:2] == ["check", "talkitout"]
    assert {"dance", "help", "cointhief"} < set(words)


def test_advice_is_one_line_beside_the_output(capsys: Capture) -> None:
    assert main(["codes", "S101"]) == 0
    old = capsys.readouterr()
    assert (
        old.err == "socialai: codes: write `explain` instead of `codes`; this still works in this version\n"
    )
    assert main(["explain", "S101"]) == 0
    assert capsys.readouterr().out == old.out


def test_standard_output_holds_the_same_document(capsys: Capture) -> None:
    options = ["dance", "--agent", "random", "--episodes", "4", "--json"]
    assert main(["coverage", *options]) == 0
    old = json.loads(capsys.readouterr().out)
    assert main(["check", *options, "--part", "coverage"]) == 0
    assert json.loads(capsys.readouterr().out) == [old]


@pytest.mark.parametrize("command", ["bench", "fidelity", "sheets", "reference"])
def test_what_maintainers_run_is_named(command: str, capsys: Capture) -> None:
    assert main([command]) == 2
    assert f"`make {command}` in a checkout" in capsys.readouterr().err
