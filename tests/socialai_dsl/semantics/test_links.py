"""What a switch unlocks, and what unlocks a door."""

from __future__ import annotations

import pytest


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
