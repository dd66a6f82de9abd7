"""A register may hold any number that is kept; what is asked of it takes no time or memory for each of them."""

from __future__ import annotations

import pytest

from socialai_dsl.compilation import compile_scenario
from tests.fuzzing.targets import in_time

ASKED = (
    'agent.said("It is <num>")',
    'ann.said("It is <num>")',
    "agent.noun == num",
    '("x" if t > 3 else num) == "x"',
    "num in 1..900000000",
    "num in 1 | 5 | 7 or num == 9",
    "not num in 1 | 5 | 7",
    "any(k in 1..9 where k == num)",
    "any(k in num..num where k == 4)",
    "count(k in 1..num where k == 2) == 1",
    "pick(1..num) == 2",
    "words(num) == red",
    "num * num == 4 or num * 3 + num * 3 == 9 or num % 7 in 1..6",
    "(3 if num == 1 else 4 if num == 2 else 5) == 4",
    "prev(num) == num",
)

REFUSED = {"S106", "S204", "S212", "S402"}
"""Too many texts, values of a range, keys of a table."""


@pytest.mark.parametrize("asked", ASKED)
def test_what_is_asked_of_a_wide_register_is_answered_or_refused(asked: str, examine) -> None:
    with in_time():
        found = examine(
            grammar={"templates": ["It is <noun>"], "nouns": [1, 2, "one"]},
            state={"num": {"start": 0, "range": "0..900000000"}},
            tables={"words": {"1": "red", "2": "green"}},
            cast={"agent": {}, "ann": {}},
            rules=[{"when": asked, "set": {"num": "num + 1"}}],
        )
        if found.checked is None:
            assert {one.code for one in found.diagnostics} & REFUSED
        else:
            compile_scenario(found.checked)
