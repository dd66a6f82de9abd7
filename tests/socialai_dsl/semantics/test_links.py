"""What a switch unlocks, and what unlocks a door."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import Const, Operation, Read, Select


def room(switches=2, doors=2, **more):
    """Doors, which are the entities from 2 on, and switches behind them."""
    return {
        "objects": {
            "switches": {"type": "switch", "count": switches, "unlocks": "doors", **more},
            "doors": {"type": "door", "count": doors, "state": "locked", "place": "wall(top)"},
        },
        "let": {"exit": "pick(doors)"},
    }


def unlocks(checked):
    return {entity.number: entity.unlocks for entity in checked.entities if entity.unlocks}


def test_groups_of_one_size_are_linked_in_order(meaning):
    assert unlocks(meaning(**room())) == {4: (2,), 5: (3,)}


def test_one_unlocks_all(meaning):
    assert unlocks(meaning(**room(switches=1, doors=3))) == {5: (2, 3, 4)}


def test_all_unlock_one(meaning):
    assert unlocks(meaning(**room(switches=3, doors=1))) == {3: (2,), 4: (2,), 5: (2,)}


def test_alternatives_are_linked_in_the_order_written(meaning):
    sections = room(unlocks="vault | exit_door")
    sections["objects"] |= {name: {"type": "door", "place": "wall(left)"} for name in ("exit_door", "vault")}
    assert unlocks(meaning(**sections)) == {4: (7,), 5: (6,)}


def test_what_unlocks_a_drawn_door_is_found_by_its_number(outcome_term):
    term = outcome_term("agent.next_to(exit.unlocked_by)", **room()).object
    assert isinstance(term, Operation)
    assert (term.type.low, term.type.high) == (4, 5)
    exit_, shift = term.args
    assert isinstance(exit_, Read)
    assert shift.value == 2


def test_what_unlocks_all_is_known(outcome_term):
    term = outcome_term("agent.next_to(exit.unlocked_by)", **room(switches=1)).object
    assert isinstance(term, Const)
    assert term.value == 4


def test_what_stands_elsewhere_is_looked_up(outcome_term):
    sections = room()
    sections["objects"] = {
        "one": {"type": "switch", "unlocks": "second"},
        "other": {"type": "lever", "unlocks": "first_one"},
        "first_one": {"type": "door", "place": "wall(top)"},
        "second": {"type": "door", "place": "wall(left)"},
    }
    sections["let"] = {"exit": "pick(first_one | second)"}
    term = outcome_term("agent.next_to(exit.unlocked_by)", **sections).object
    assert isinstance(term, Select)
    assert [value.value for value in (*term.values, term.default)] == [7, 6]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"unlocks": "guide"}, "S204 `guide` is not an object of the room"),
        ({"unlocks": "colors"}, "S204 `colors` is not an object of the room"),
        ({"unlocks": "4..5"}, "S204 `4..5` is not an object of the room"),
        ({"unlocks": "cells"}, "S204 `cells` is not an object of the room"),
        ({"unlocks": "exit"}, "S204 `exit` is not an object of the room"),
        ({"type": "ball"}, "S204 a ball cannot unlock anything"),
        ({"switches": 3}, "S106 3 of `switches` cannot be linked to 2 of `doors`"),
    ],
)
def test_what_cannot_be_linked(mistakes, changes, said):
    assert mistakes(**room(**changes), outcome=[{"success": "agent.next_to(exit.unlocked_by)"}]) == [said]
