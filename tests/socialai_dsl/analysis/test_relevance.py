"""What a search may leave out of a state: only what no code reads."""

from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.analysis.redrawn import sites_of
from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.analysis.search import Chances
from socialai_dsl.draws import below, draw
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, Field, Header, Op, Program, Register

SCENARIO = """
scenario: small
horizon: 20
grammar: {{templates: [Say <noun>], nouns: [it, that]}}
room: {{size: 5}}
objects: {{gate: {{type: door, state: closed, at: [4, 2]}}}}
let: {{wanted: pick(n in nouns)}}
frames:
  keep:
    start: keeping
    states:
      keeping: {{do: {activity}, then: [{{{rule}}}]}}
      free: {{}}
cast:
  keeper: {{at: [3, 3], facing: up, frame: keep}}
  agent: {{at: [1, 1], facing: right}}
outcome:
  - success: {success}
"""


def program(
    folder: Path,
    rule: str = "hears: Say it, goto: free",
    success: str = "agent.at(gate)",
    activity: str = "stay",
) -> Program:
    file = folder / "small.yaml"
    file.write_text(SCENARIO.format(rule=rule, success=success, activity=activity))
    return socialai_dsl.compile(socialai_dsl.load(str(file)))


def register(of: Program, path: str) -> int:
    return next(name.register for name in of.registers if name.path == path)


def test_places_and_states_count_and_records_do_not() -> None:
    talkitout = socialai_dsl.compile(socialai_dsl.load("talkitout"))
    kept = set(Relevance.of(talkitout).registers.tolist())
    for number in range(len(talkitout.entities)):
        base = FIRST_ENTITY + ENTITY_FIELDS * number
        assert {base + f for f in (Field.X, Field.Y, Field.DIR, Field.STATUS, Field.GONE)} <= kept
    assert register(talkitout, "wizard.frame") in kept
    assert register(talkitout, "let.exit") in kept
    assert not kept & {Register.T, Register.LOGGED, Register.TOKENS, Register.HEARD, Register.CLASS}
    assert talkitout.header(Header.LOG) not in kept
    assert register(talkitout, "wizard.clock") not in kept


def test_a_lie_drawn_anew_is_only_words() -> None:
    assert not Relevance.of(socialai_dsl.compile(socialai_dsl.load("talkitout"))).chance


@pytest.mark.parametrize(
    ("said", "asked", "chance"),
    [("See the", "Say", False), ("See the", "See", True)],
    ids=["words", "a colour that somebody heeds"],
)
def test_a_pick_of_all_but_one_is_words_unless_somebody_heeds_them(
    said: str, asked: str, chance: bool, tmp_path: Path
) -> None:
    """It is drawn, and moved up past the one: what is added after the comparison follows from the draw."""
    text = SCENARIO.format(
        rule='hears: Say it, say: "SAID <pick(b in balls where b != left_out).color>"',
        success="t > 7",
        activity="stay",
    )
    text = text.replace("SAID", said).replace("let: {", "let: {left_out: pick(balls), ")
    text = text.replace("objects: {", "objects: {balls: {type: ball, count: 3}, ")
    text = text.replace(
        "cast:\n", "  heed: {states: {heeding: {then: [{hears: ASKED, goto: done}]}, done: {}}}\ncast:\n"
    )
    text = text.replace("ASKED", '"See the red"' if asked == "See" else "Say that")
    text = text.replace("  agent: {at", "  other: {at: [2, 3], frame: heed}\n  agent: {at")
    file = tmp_path / "small.yaml"
    file.write_text(text)
    small = socialai_dsl.compile(socialai_dsl.load(str(file)))
    assert Relevance.of(small).drawn
    assert Relevance.of(small).chance is chance


def test_time_counts_up_to_the_last_comparison(tmp_path: Path) -> None:
    timed = program(tmp_path, success="t > 7 and agent.at(gate)")
    relevance = Relevance.of(timed)
    (place,) = (i for i, r in enumerate(relevance.registers) if r == Register.T)
    assert 7 < relevance.limits[place] <= 9
    assert Register.T not in Relevance.of(program(tmp_path)).registers


def test_a_clock_counts_where_a_rule_waits(tmp_path: Path) -> None:
    waiting = program(tmp_path, rule="after: 4, goto: free")
    relevance = Relevance.of(waiting)
    (place,) = (i for i, r in enumerate(relevance.registers) if r == register(waiting, "keeper.clock"))
    assert 3 <= relevance.limits[place] <= 5


@pytest.mark.parametrize(
    ("rule", "activity", "chance"),
    [
        ("hears: Say it, goto: free", "stay", False),
        ("chance: 0.5, goto: free", "stay", True),
        ("hears: Say it, goto: free", "face(agent)", True),
        ("hears: Say it, say: Take <pick(1..3)>", "stay", False),
        ("when: pick(1..3) == 2, goto: free", "stay", True),
    ],
)
def test_what_chance_decides(tmp_path: Path, rule: str, activity: str, chance: bool) -> None:
    """Turning round is left or right by chance; what is said is only words."""
    assert Relevance.of(program(tmp_path, rule, activity=activity)).chance is chance


def test_the_whole_utterance_counts_where_its_parts_are_compared(tmp_path: Path) -> None:
    assert not Relevance.of(program(tmp_path, success='agent.said("Say it")')).whole_utterance
    assert not Relevance.of(program(tmp_path, success='agent.said("Say <wanted>")')).whole_utterance
    comparing = program(tmp_path, rule="hears: Say <noun>, when: noun == wanted, goto: free")
    assert Relevance.of(comparing).whole_utterance


def test_what_an_npc_does_with_the_noun_it_heard_depends_on_the_whole_utterance(tmp_path: Path) -> None:
    echo = program(tmp_path, rule="hears: Say <noun>, say: Say <noun>, goto: free")
    assert any(op == Op.HEARD_NOUN for op in echo.code[:, 0])
    assert Relevance.of(echo).whole_utterance
    assert not Relevance.of(program(tmp_path)).whole_utterance


def test_what_is_written_anew_in_every_step_does_not_count(tmp_path: Path) -> None:
    pending = program(tmp_path, activity="stay, first: [{do: forward, goto: free}]")
    fleeting = {name.register for name in pending.registers if name.fleeting}
    assert fleeting
    assert not fleeting & set(Relevance.of(pending).registers.tolist())


def test_that_somebody_was_poked_counts_only_where_code_asks(tmp_path: Path) -> None:
    keeper = FIRST_ENTITY + ENTITY_FIELDS + Field.POKED
    assert keeper not in Relevance.of(program(tmp_path)).registers
    assert keeper in Relevance.of(program(tmp_path, success="keeper.was_poked")).registers


def test_of_a_turn_round_both_ways_are_tried_and_no_more(tmp_path: Path) -> None:
    turning = program(tmp_path, activity="face(agent)")
    relevance = Relevance.of(turning)
    ((site, count),) = relevance.choices or ()
    assert count == 2
    place, number = sites_of(turning)[site]
    chances = Chances(turning, relevance, True)
    for step in range(1, 20):
        marks = chances.marks(12345, step).tolist()
        assert marks[0] == 0
        assert sorted(below(draw(12345 ^ mark, place, step, number), 2) for mark in marks) == [0, 1]
