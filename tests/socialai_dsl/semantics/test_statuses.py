"""The status an object begins with, and statuses that follow from a condition."""

from __future__ import annotations

import pytest


def of(checked, key):
    return [entity for entity in checked.entities if entity.key == key]


def objects(**described):
    return {"objects": {"doors": {"type": "door", "count": 2, "place": "wall(top)"}, **described}}


@pytest.mark.parametrize(
    ("described", "said"),
    [
        ({"type": "door", "pressed": True}, "S204 a door is never `pressed`; it is open or closed or locked"),
        ({"type": "switch", "locked": "true"}, "S204 a switch is never `locked`; it is idle or pressed"),
        ({"type": "switch", "pressed": True, "state": "idle"}, "S107 only one of `state` and `pressed` can be given"),
        ({"type": "ball", "tagged": "it.tagged"}, "S208 computed statuses in a circle: `thing` needs `thing`"),
        ({"type": "door", "state": "loked"},
         "S204 a door is never `loked`; it is open or closed or locked; did you mean `locked`?"),
        ({"type": "door", "place": "wall(left)", "locked": "3"},
         "S204 `3` is a number, but a condition is expected here"),
    ],
)  # fmt: skip
def test_mistakes(mistakes, described, said):
    assert mistakes(**objects(thing=described)) == [said]
