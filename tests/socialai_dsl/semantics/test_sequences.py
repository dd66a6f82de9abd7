"""Sequences that are drawn, memories that are compared with them, and performances."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.groups import performs
from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.terms import Chance, Compare, Const, Logic, Not, Quantification, Read, Select

DANCE = {"dance": {"sequence": 2, "moves": ["left", "forward"], "utterance": {"chance": 0.25}}}
LESSON = {
    "let": DANCE,
    "frames": {
        "show": {"slots": {"lesson": "sequence"}, "steps": [{"do": "perform(lesson)", "state": "dancing"}]}
    },
    "cast": {"guide": {"frame": "show", "with": {"lesson": "dance"}}},
}


def drawn(checked):
    return {item.path: item.value for item in checked.setup if isinstance(item, Drawn)}


def test_each_element_is_drawn_at_a_site_of_its_own(meaning):
    found = drawn(meaning(let=DANCE))
    paths = [path for path in found if path.startswith("let.dance")]
    assert paths == [
        *("let.dance[0].move", "let.dance[0].utterance"),
        *("let.dance[1].move", "let.dance[1].utterance"),
    ]
    assert all(found[path].site == path for path in paths)


def test_a_move_is_picked_from_the_moves(meaning):
    term = drawn(meaning(let=DANCE))["let.dance[1].move"].term
    assert isinstance(term, Quantification)
    assert term.op == "pick"
    assert [term.type.words[item.value] for item in term.items] == ["left", "forward"]


def test_a_single_move_is_known(meaning):
    term = drawn(meaning(let={"dance": {"sequence": 1, "moves": ["done"]}}))["let.dance[0].move"].term
    assert isinstance(term, Const)
    assert term.type.words[term.value] == "done"


def test_an_utterance_is_silence_or_any_pair(meaning):
    checked = meaning(let=DANCE)
    term = drawn(checked)["let.dance[0].utterance"].term
    assert isinstance(term, Select)
    assert term.conditions == (Chance(0.25, 0),)
    assert term.default == Const(term.type, 0)
    (said,) = term.values
    assert [item.value for item in said.items] == list(
        range(1, 1 + len(checked.sentences.templates) * len(checked.sentences.nouns))
    )
    assert said.type.words[0] == ""


def test_without_a_chance_it_is_silent(meaning):
    term = drawn(meaning(let={"dance": {"sequence": 1, "moves": ["left"]}}))["let.dance[0].utterance"].term
    assert isinstance(term, Const)
    assert term.value == 0


def test_a_memory_equals_a_sequence_once_it_is_full(outcome_term):
    term = outcome_term("attempt == dance", let=DANCE, memory={"attempt": {"last": 2}})
    assert isinstance(term, Logic)
    assert term.op == "and"
    full, *pairs = term.args
    assert isinstance(full, Compare)
    assert (full.left.path, full.right.value) == ("memory.attempt.filled", 2)
    assert [(pair.left.path, pair.right.path) for pair in pairs] == [
        (f"memory.attempt[{k}].{part}", f"let.dance[{k}].{part}")
        for k in (0, 1)
        for part in ("move", "utterance")
    ]


def test_unlike_is_the_opposite(outcome_term):
    sections = {"let": DANCE, "memory": {"attempt": {"last": 2}}}
    assert outcome_term("attempt != dance", **sections) == Not(outcome_term("attempt == dance", **sections))


def test_two_sequences_can_be_compared(outcome_term):
    term = outcome_term("dance == waltz", let={**DANCE, "waltz": {"sequence": 2, "moves": ["left"]}})
    assert not [part for part in term.args if part.left.path.endswith("filled")]


def test_a_memory_holds_acts_while_its_condition_does(meaning):
    (memory,) = meaning(**LESSON, memory={"attempt": {"last": 2, "while": "guide.is(dancing)"}}).memories
    assert (memory.path, memory.open.site) == ("memory.attempt", "memory.attempt.while")
    (always,) = meaning(memory={"attempt": {"last": 3}}).memories
    assert always.open is None


def test_a_performance_has_the_elements_that_its_slot_is_filled_with(meaning):
    (frame,) = meaning(**LESSON).frames
    activity = frame.steps[0].activity
    assert activity.name == "perform"
    assert [term.path for term in activity.args] == [
        f"let.dance[{k}].{part}" for k in (0, 1) for part in ("move", "utterance")
    ]
    assert all(isinstance(term, Read) for term in activity.args)


def test_whoever_performs_can_be_heard_saying_anything(examine):
    heard = {"listen": {"states": {"waiting": {"then": [{"hears": "Here is 3", "say": "Yes", "goto": "done_it"}]},
                                   "done_it": {}}}}  # fmt: skip
    sections = {**LESSON, "frames": {**LESSON["frames"], **heard}}
    sections["cast"] = {**LESSON["cast"], "other": {"frame": "listen"}}
    checked = examine(**sections).checked
    assert checked is not None
    assert [performs(frame) for frame in examine(**sections).scenario.frames.values()] == [True, False]
    pattern = checked.frames[1].states[0].then[0].hears[0]
    assert "Here is 3" in pattern.said_by_npcs


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("attempt == 3", "S204 `attempt` is several acts in a row, `3` is not"),
        ("doors == attempt", "S204 `attempt` is several acts in a row, `doors` is not"),
        ("attempt == dence", "S201 unknown name `dence`; did you mean `dance` (let, line 40)?"),
        ("attempt < dance", "S204 `attempt` is a memory; it can only be compared with a sequence"),
        ("attempt == dance", "S106 `attempt` has 3 acts, `dance` has 2"),
    ],
)
def test_what_cannot_be_compared(mistakes, expression, said):
    found = mistakes(let={"exit": "pick(doors)", **DANCE}, memory={"attempt": {"last": 3}},
                     outcome=[{"success": expression}])  # fmt: skip
    assert [text.split(" (let")[0] for text in found] == [said.split(" (let")[0]]
