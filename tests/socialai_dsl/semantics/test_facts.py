"""What the values of terms follow from, when they can change, and what they can be."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.facts import TermFacts, When, needs
from socialai_dsl.semantics.terms import RelationName
from socialai_dsl.semantics.words import VALUES
from socialai_dsl.semantics.words.relations import Relation

DOORS = range(2, 6)


def condition_of(meaning, text, **more):
    """A checked scenario and a condition in it, as an outcome asks for it."""
    checked = meaning(outcome=[{"success": text}], **more)
    return checked, checked.outcomes[0].condition.term


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("agent.x > W // 2", {("cell", (0,)), ("size", ())}),
        ("agent.color == red", {("color", (0,))}),
        ("agent.faces(guide)", {("cell", (0,)), ("cell", (1,)), ("facing", (0,))}),
        ("agent.in_front_of(guide)", {("cell", (0,)), ("cell", (1,)), ("facing", (1,))}),
        ("agent.next_to(guide)", {("cell", (0,)), ("cell", (1,))}),
        ("agent.can_reach(guide)", {("cell", (0,)), ("cell", (1,)), ("way", ())}),
        ("agent.unobstructed(guide)", {("cell", (0,)), ("cell", (1,)), ("between", ())}),
        ("any(d in doors where d.color == red)", {("color", tuple(DOORS))}),
        ("agent.at(nearest(d in doors to guide))", {("cell", tuple(DOORS)), ("cell", (1,)), ("cell", (0,))}),
        ("t > 3", {("step", ())}),
    ],
)
def test_a_term_needs_what_its_words_speak_of(meaning, text, what):
    _, term = condition_of(meaning, text)
    assert {(need.what, tuple(need.entities)) for need in needs(term)} == what


@pytest.mark.parametrize(
    ("text", "when"),
    [
        ("exit.color == red", When.NEVER),
        ("exit.y == 0", When.NEVER),
        ("exit.open", When.MARKED),
        ("agent.x == 1", When.ANY_TIME),
        ("any(d in doors where d.open)", When.MARKED),
        ("t == 3", When.ANY_TIME),
    ],
)
def test_a_value_changes_when_what_it_needs_does(meaning, text, when):
    checked, term = condition_of(meaning, text)
    assert TermFacts(checked).when(term) is when


def test_every_relation_of_the_engine_has_a_row_that_says_what_it_follows_from():
    assert {name for name, row in VALUES.items() if isinstance(row, Relation)} == {*RelationName.__args__}


@pytest.mark.parametrize(
    "row", [row for row in VALUES.values() if isinstance(row, Relation)], ids=lambda r: r.name
)
def test_what_is_known_of_two_cells_fits_how_many_cells_there_can_be(row):
    cells = [(x, y) for x in range(7) for y in range(7)]
    if row.most is not None:
        assert sum(row.known((3, 3), cell) is True for cell in cells) <= row.most
