"""Expressions: names found, words read as what is expected, types checked."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import may_find_nothing
from socialai_dsl.semantics.words import NAMES


def test_uses_that_disagree_are_a_mistake(mistakes):
    frames = {"look": {"states": {"a": {"do": "turn(glance)"}}}}
    found = mistakes(
        let={"glance": "pick(left | right)"},
        frames=frames,
        cast={"guide": {"frame": "look"}},
        outcome=[{"success": "agent.did(glance)"}],
    )
    assert [line[:4] for line in found] == ["S209"]


def test_a_direction_plus_a_number_is_a_mistake(mistakes):
    assert "S204" in mistakes(outcome=[{"success": "guide.facing + 1 == up"}])[0]


def test_both_mistakes_of_a_condition_are_found(mistakes):
    found = mistakes(outcome=[{"success": "agent.at(exitt) and agent.color == crimson"}])
    assert [line[:4] for line in found] == ["S201", "S201"]


# -- conditional values


def test_both_sides_of_a_conditional_value_are_looked_at(mistakes):
    found = mistakes(outcome=[{"success": "agent.at(exitt if t > 2 else exi)"}])
    assert [text[:22] for text in found] == ["S201 unknown name `exi", "S201 unknown name `exi"]


@pytest.mark.parametrize(
    "asked",
    [
        '{}.kind == "door"',
        "{}.unlocked_by == key",
        "only({}.kind) == 1",
        "{}.index == 0",
        "{}.y == 0",
        "{}.open",
    ],
)
def test_of_what_is_not_found_nothing_follows_though_it_could_be_one_thing_alone(outcome_term, asked):
    objects = {"key": {"type": "switch", "place": "anywhere", "unlocks": "doors"}}
    sections = {"objects": objects, "tables": {"only": {"door": 1}}}
    assert may_find_nothing(outcome_term(asked.format("first(d in doors where d.open)"), **sections))
    assert not may_find_nothing(outcome_term(asked.format("exit"), **sections))


@pytest.mark.parametrize("name", sorted(NAMES))
def test_no_object_is_called_like_a_name_that_is_always_there(mistakes, name):
    assert "S213" in {line[:4] for line in mistakes(objects={name: {"type": "ball"}})}
