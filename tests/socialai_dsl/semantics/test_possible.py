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


SOMETIMES = "first(d in doors where d.color == red)"
"""What finds nothing in rooms without a red door."""


@pytest.mark.parametrize(
    ("above", "dead"),
    [
        ({"say": "Yes"}, True),
        ({"when": True, "say": "Yes"}, True),
        ({"when": "true", "goto": "a"}, True),
        ({"when": "agent.next_to(self)", "say": "<exit.color>"}, True),
        ({"cause": ["those(d in doors where d.color == red).open"]}, True),
        ({"say": f"The <{SOMETIMES}.color> one"}, False),
        ({"say": "<last.color>"}, False),
        ({"say": "Hm", "to": "nearest(p in cast where p.x == last.x to self)"}, False),
        ({"say": "<n>", "set": {"n": f"{SOMETIMES}.x"}}, False),
        ({"set": {"last": SOMETIMES}}, False),
        ({"cause": [f"{SOMETIMES}.open"]}, False),
        ({"cause": [f"self.put({SOMETIMES})"]}, False),
        ({"when": "$on", "say": "Yes"}, False),
        ({"when": "$on or n == 3", "say": "Yes"}, False),
        ({"when": False, "say": "Yes"}, False),
        ({"when": True, "once": True, "say": "Yes"}, False),
        ({"when": True, "chance": 0.5, "say": "Yes"}, False),
        ({"when": True, "after": 3, "say": "Yes"}, False),
    ],
)
def test_a_rule_is_dead_only_if_the_one_above_fires_whenever_it_would(examine, above, dead):
    below = {"when": "agent.next_to(self)", "say": "Or not"}
    registers = {"n": {"start": 0, "range": "0..9"}, "last": {"start": "none"}}
    known = {"when": "t == 19", "set": {"last": "exit"}}
    frame = {"let": registers, "states": {"a": {"first": [known], "then": [above, below]}}}
    doors = {"doors": {"type": "door", "count": 4, "place": "each_wall(2)", "color": "random"}}
    cast = {"guide": {"frame": "talk"}}
    found = examine(params={"on": True}, objects=doors, frames={"talk": frame}, cast=cast)
    assert not found.has_errors, [str(d) for d in found.diagnostics]
    assert ("W311" in {d.code for d in found.diagnostics}) is dead


@pytest.mark.parametrize(
    ("hears", "say", "dead"),
    [
        ("Where is <noun>", "<noun>", True),
        ("Where is <noun>", "<agent.noun>", True),
        ("any", "<agent.noun>", False),
    ],
)
def test_what_a_rule_heard_is_found(examine, hears, say, dead):
    rules = [{"hears": hears, "say": say}, {"hears": "Where is sesame", "say": "Sesame"}]
    if hears == "any":
        rules = [{"when": "agent.spoke", "say": say}, {"when": "agent.spoke", "say": "Sesame"}]
    found = examine(frames={"talk": {"states": {"a": {"then": rules}}}}, cast={"guide": {"frame": "talk"}})
    assert [d.code for d in found.diagnostics if d.code == "W311"] == ["W311"] * dead


@pytest.mark.parametrize(
    ("rule", "why"),
    [
        ({"before": 3, "after": 3}, "`turns_in_state` would have to be at least 3 and at most 2"),
        ({"before": 4, "after": 3}, None),
        ({"before": 0}, "`turns_in_state` is from 0 to 20"),
        ({"when": "W > 8"}, "`W` is from 5 to 8"),
        ({"after": 21}, "`turns_in_state` is from 0 to 20"),
        ({"after": 20}, None),
        ({"before": "told", "after": "told"}, "it asks for something and for its opposite"),
        ({"before": "told + 1", "after": "told"}, None),
        ({"when": "t > 4 and (told == 2 and t < 5)"}, "`t` would have to be at least 5 and at most 4"),
        ({"when": "told == 2 and told == 3"}, "`told` would have to be at least 3 and at most 2"),
        ({"when": "told == 2 or told == 3"}, None),
        ({"when": "agent.next_to(self) and not agent.next_to(self)"}, "it asks for something and for its opposite"),
        ({"when": "last == exit and last != exit"}, "it asks for something and for its opposite"),
        ({"when": "pick(doors).x == 0 and pick(doors).x > 3"}, None),
        ({"when": "after(3) and told < $least", "after": 3}, None),
    ],
)  # fmt: skip
def test_conditions_that_cannot_hold_together(examine, rule, why):
    registers = {"told": {"start": 0, "range": "0..9"}, "last": {"start": "none"}}
    known = {"when": "t == 19", "set": {"last": "exit", "told": 4}}
    frame = {"let": registers, "states": {"a": {"first": [known, {**rule, "say": "Yes"}]}}}
    doors = {"doors": {"type": "door", "count": 4, "place": "each_wall(2)", "color": "random"}}
    cast = {"guide": {"frame": "talk"}}
    found = examine(
        params={"least": 3}, define={"after(k)": "guide.turns_in_state >= k"}, horizon=20,
        objects=doors, frames={"talk": frame}, cast=cast,
    )  # fmt: skip
    assert not found.has_errors, [str(d) for d in found.diagnostics]
    assert [d.hint for d in found.diagnostics if d.code == "W311"] == [why] * (why is not None)
