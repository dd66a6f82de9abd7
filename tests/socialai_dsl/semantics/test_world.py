"""Rules of the world, and what a drawn room has to be like."""

from __future__ import annotations

import pytest

LAMP = {"lamp": {"type": "switch", "place": "anywhere"}}


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ({"when": "t == 3"}, "S105 a rule of the world needs `cause`, `set` or `reward`: what it does"),
        ({"cause": "self.vanish"}, "S201 `self` is the member of the cast who follows a frame; here nobody does"),
        ({"cause": "cells.open"}, "S204 `cells` is a cell, but an object or a member of the cast is expected here"),
        ({"cause": "colors.vanish"},
         "S204 `colors` is a colour, but an object or a member of the cast is expected here"),
        ({"cause": "doors.cloze"}, "S205 unknown effect `cloze`; did you mean `close`?"),
        ({"cause": "lamp.open"}, "S204 `open` cannot happen to `lamp`: it is idle or pressed"),
        ({"when": "exitt.open", "cause": "exit.close"}, "S201 unknown name `exitt`; did you mean `exit` (let, line "),
    ],
)  # fmt: skip
def test_mistakes_in_a_rule(mistakes, rule, said):
    (found,) = mistakes(objects=LAMP, rules=[rule])
    assert found.startswith(said)


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        (
            "agent.spoke",
            "S204 `spoke` speaks of a step, but this value is computed once, before the first step",
        ),
        (
            "agent.distance(guide)",
            "S204 `agent.distance(guide)` is a number, but a condition is expected here",
        ),
    ],
)
def test_mistakes_in_a_requirement(mistakes, condition, said):
    assert mistakes(require=[condition]) == [said]
