"""Who said something: in rules that hear it, and in conditions that ask for it."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import walk


def talking(*rules):
    return {
        "frames": {"talk": {"states": {"s": {"then": list(rules)}}}},
        "cast": {"guide": {"name": "Gus", "frame": "talk"}},
    }


def terms(plan, kind):
    return [part for part in walk(plan) if isinstance(part, kind)]


GUIDE = talking({"hears": "How are you", "say": "I am fine."})


@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("exit.spoke", "S211"),
        ('pair.said("I am fine.")', "S204"),
        ('guide.said("I am ill.")', "S401"),
        ('guide.said("How are you")', "S401"),
        ("speaker == guide", "S211"),
    ],
)
def test_what_nobody_can_be_asked(examine, condition, code):
    sections = {**GUIDE, "cast": {**GUIDE["cast"], "pair": {"count": 2}}}
    assert [d.code for d in examine(**sections, outcome=[{"success": condition}]).diagnostics] == [code]
