"""Conditions that can never hold, where the numbers in them can be many."""

from __future__ import annotations

import pytest

from tests.fuzzing.targets import in_time

FIFTH = " * ".join(["(t + 20)"] * 5)
LEAVES = {"failure": "agent.at(exit)"}
COUNTING = {
    "let": {"n": {"start": 0, "range": "0..1000"}},
    "states": {"a": {"then": [{"set": {"n": "n + 1"}}]}},
}


@pytest.mark.parametrize("op", ["==", "!=", "<", "<=", ">", ">="])
def test_large_ranges_are_compared_at_once(mistakes, op):
    with in_time():
        assert mistakes(outcome=[{"success": f"{FIFTH} {op} 4000000"}, LEAVES]) == []


def test_large_ranges_that_have_nothing_in_common(mistakes):
    with in_time():
        (found,) = mistakes(outcome=[{"success": f"{FIFTH} == 0 - {FIFTH}"}, LEAVES])
    assert found.startswith("S316")


@pytest.mark.parametrize(("number", "codes"), [(5, []), (1000, []), (1001, ["S316"])])
def test_one_of_several_may_have_any_of_its_values(mistakes, number, codes):
    found = mistakes(
        frames={"count": COUNTING},
        cast={"pair": {"count": 2, "frame": "count"}},
        let={"one": "pick(pair)"},
        outcome=[{"success": f"one.n == {number}"}, LEAVES],
    )
    assert [line[:4] for line in found] == codes
