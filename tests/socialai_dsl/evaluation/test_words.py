"""What seats say: scripts whose words are known, chance, and those who speak for themselves."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.evaluation.words import Words
from socialai_dsl.runs.folder import WORDS
from socialai_dsl.runs.words import words

REFERENCE = "together/reference_game_together"

TWO_PARTS = """scenario: two_parts
about: Who sees shape and size says both, a word for each, and what the lamp shows.
horizon: 4
earshot: room
grammar:
  templates: [Take <what> <which>, It is <lamp>]
  slots: {what: [dax, wug, blik], which: [toma, gazzer], lamp: [dark, bright]}
room: {width: 7, height: 5}
let: {shape: pick("dax" | "wug" | "blik"), size: pick("toma" | "gazzer")}
tables:
  other: {dax: wug, wug: dax, blik: blik}
cast:
  agent: {at: [1, 1], frame: tell}
  bob: {at: [5, 1], seat: open, frame: answer}
frames:
  tell: {steps: [{say: Take <other(shape)> <size>}]}
  answer: {states: {listening: {then: [{hears: Take <what> <which>, say: Fine}]}}}
outcome:
  - success: t >= 3
"""


def test_a_script_that_names_the_referent_tells_all_of_it() -> None:
    found = words("oracle", REFERENCE, 200)
    agent, listener = found.seats["agent"], found.seats["listener"]
    (meant, *others) = agent.situations
    assert (meant.name, meant.same) == ("meant", ("meant.color", "sample.color"))
    assert meant.told is not None
    assert meant.told.bits == pytest.approx(math.log2(3), abs=0.02)
    assert {value: list(said) for value, said in meant.said.items()} == {
        "balls[0], red": ["blik"],
        "balls[1], green": ["dax"],
        "balls[2], blue": ["wug"],
    }
    assert sum(sum(said.values()) for said in meant.said.values()) == pytest.approx(200)
    assert [one.more_than_chance for one in (meant, *others)] == [True, *(False for _ in others)]
    assert (agent.player, agent.success, agent.spoke) == ("script", 1, 1)
    assert (listener.spoke, list(listener.messages)) == (0, ["(nothing)"])
    assert all(one.told is None for one in listener.situations)


def test_chance_tells_nothing() -> None:
    found = words("random", REFERENCE, 200)
    for seat in found.seats.values():
        assert set(seat.messages) == {"blik", "dax", "wug", "(nothing)"}
        assert sum(seat.messages.values()) == pytest.approx(1, abs=1e-5)
        for one in seat.situations:
            assert one.told is not None
            assert not one.more_than_chance
            assert abs(one.told.bits) < 0.1


def test_a_script_that_speaks_for_itself_is_overheard_and_may_tell_of_two_draws_at_once() -> None:
    """The guide says where the exit is to friends, and where it is not to others: each alone tells nothing."""
    guide = words("oracle", "together/trusted_or_not_together", 200).seats["guide"]
    told = {one.name: one.told.bits for one in guide.situations if one.told is not None}
    assert told["exit and friend"] == pytest.approx(1, abs=0.02)
    assert max(abs(told["exit"]), abs(told["friend"])) < 0.05
    assert guide.spoke == 1


def test_a_partner_can_be_somebody_else() -> None:
    found = words("oracle", REFERENCE, 20, seats={"listener": "random"})
    assert [one.player for one in found.seats.values()] == ["script", "random"]
    assert found.seats["agent"].success < 1


@pytest.fixture
def two_parts(tmp_path: Path) -> Words:
    path = tmp_path / "two_parts.yaml"
    path.write_text(TWO_PARTS)
    return words("oracle", str(path), 200)


def test_words_for_parts_are_alike_where_their_meanings_are(two_parts: Words) -> None:
    agent = two_parts.seats["agent"]
    assert agent.topographic == (pytest.approx(1), pytest.approx(0.001, abs=0.02))
    told = {one.name: one.told for one in agent.situations}
    for name, count in (("shape", 3), ("size", 2), ("shape and size", 6)):
        information = told[name]
        assert information is not None
        assert information.bits == pytest.approx(math.log2(count), abs=0.03)


def test_the_command_prints_a_table_and_leaves_the_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "there" / "words"
    command = ["words", "oracle", "--on", REFERENCE, "--episodes", "30"]
    assert main([*command, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "agent, played by script: success 1.00, speaks in 100% of the episodes" in printed
    assert "balls[0], red    " in printed
    assert "says the same everywhere: (nothing)" in printed
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((out / WORDS).read_text(encoding="utf-8"))


def test_the_page_shows_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "partners.md").read_text(encoding="utf-8")
    section = page[page.index("\n## Words\n") :]
    shown = section[section.index("```text\n") + 8 :].partition("```")[0]
    assert main(["words", "oracle", "--on", REFERENCE, "--episodes", "200"]) == 0
    assert shown.strip() in capsys.readouterr().out


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (["random", "--on", "social_env"], "is a suite, whose members have draws of their own"),
        (["human", "--on", REFERENCE], "got 'human', expected random, oracle"),
        (["llm:stub", "--on", REFERENCE], "got 'llm:stub', expected random, oracle"),
        (["nowhere", "--on", REFERENCE], "nowhere"),
        (["oracle", "--on", REFERENCE, "--seat", "bob=random"], "got 'bob', expected one of agent, listener"),
        (
            ["oracle", "--on", REFERENCE, "--seat", "agent=random", "--seat", "agent=script"],
            "got two players",
        ),
    ],
)
def test_what_cannot_be_asked(asked: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["words", *asked, "--episodes", "2"]) == 2
    assert message in capsys.readouterr().err
