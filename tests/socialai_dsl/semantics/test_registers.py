"""Registers of the world and of frames: ranges, and who sets them."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics import check
from socialai_dsl.semantics.plans import Drawn


def register(checked, path):
    (found,) = [item for item in checked.setup if isinstance(item, Drawn) and item.path == path]
    return found.type.low, found.type.high


def test_a_range_that_is_given_is_kept(meaning):
    rules = [{"when": "t > 3", "set": {"price": "price + 100"}}]
    assert register(meaning(state={"price": {"start": 3, "range": "1..5"}}, rules=rules), "state.price") == (
        1,
        5,
    )


def test_without_a_range_there_is_room_for_what_is_set(meaning):
    rules = [
        {"when": "t > 3", "set": {"price": "min(price + 1, 7)"}},
        {"when": "t > 4", "set": {"price": -2}},
    ]
    assert register(meaning(state={"price": 3}, rules=rules), "state.price") == (-2, 7)


def test_any_frame_may_set_what_the_world_has(meaning):
    frames = {"count": {"states": {"s": {"then": [{"set": {"price": "min(price + 1, 7)"}}]}}}}
    checked = meaning(state={"price": 3}, frames=frames, cast={"guide": {"frame": "count"}})
    assert register(checked, "state.price") == (3, 7)


def test_there_is_room_for_what_each_member_of_a_group_adds(meaning):
    frames = {"tick": {"states": {"on": {"then": [{"set": {"total": "total + 1"}}]}}}}
    cast = {"guide": {"count": 4, "frame": "tick"}}
    high = register(meaning(state={"total": 0}, frames=frames, cast=cast), "state.total")[1]
    assert high >= 4 * 20


def test_a_register_of_a_frame_with_a_range(meaning):
    frames = {
        "sulk": {
            "let": {"mood": {"start": "pick(0..2)", "range": "0..3"}},
            "states": {"s": {"then": [{"set": {"mood": "mood + 1"}}]}},
        }
    }
    assert register(meaning(frames=frames, cast={"guide": {"frame": "sulk"}}), "guide.mood") == (0, 3)


@pytest.mark.parametrize(
    ("state", "code"),
    [
        ({"price": {"start": 6, "range": "1..5"}}, "S106"),
        ({"price": {"start": "pick(0..5)", "range": "1..5"}}, "S106"),
        ({"price": {"start": "red", "range": "1..5"}}, "S204"),
        ({"price": {"start": 3, "range": "5..1"}}, "S204"),
        ({"price": {"start": 3, "range": 5}}, "S204"),
        ({"price": {"start": 3, "range": [1, 5]}}, "S104"),
        ({"exit": 3}, "S213"),
        ({"price": "agent.spoke"}, "S204"),
    ],
)
def test_declarations_that_mean_nothing(examine, state, code):
    assert [d.code for d in examine(state=state).diagnostics] == [code]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("prize", "`prize` is not declared in `state`"),
        ("exit", "`exit` is drawn once per episode and cannot be set"),
        ("mood", "`mood` is a register of the frame `sulk`, which only the frame itself sets"),
    ],
)
def test_rules_of_the_world_set_only_what_the_world_has(examine, name, message):
    frames = {"sulk": {"let": {"mood": 0}, "states": {"s": {}}}}
    sections = {"frames": frames, "cast": {"guide": {"frame": "sulk"}}, "state": {"price": 3}}
    (found,) = examine(**sections, rules=[{"when": "t > 3", "set": {name: 1}}]).diagnostics
    assert found.message == message
    assert (found.suggestion == "price") == (name == "prize")


RING = 20
FOLLOWING = {
    "a counter": ({"n": 0}, ["n: n + 1"], {"n": (0, 20)}),
    "one of two rules": ({"n": 0}, ["n: n + 1", "n: n - 2"], {"n": (-80, 40)}),
    "a bound": ({"n": 0}, ["n: min(n + 1, 300)", "n: 0"], {"n": (0, 40)}),
    "two that take turns": ({"a": 0, "b": 0}, ["a: b + 1", "b: max(a, 3)"], {"a": (0, 23), "b": (0, 22)}),
    "what follows from a counter": (
        {"n": 0, "m": 0, "far": 0},
        ["n: n + 1", "m: max(m, n - 15)", "far: n * 3"],
        {"n": (0, 20), "m": (0, 5), "far": (0, 60)},
    ),
    "a sum of a counter": ({"n": 0, "m": 0}, ["n: n + m", "m: m + 1"], {"n": (0, 400), "m": (0, 20)}),
    "a double": ({"n": 1}, ["n: n * 2"], {"n": (1, 2**20)}),
    "what was before": ({"n": 0, "m": 0}, ["n: n + 1", "m: prev(n) + 1"], {"n": (0, 20), "m": (0, 21)}),
    "a ring": (
        {f"r{k}": 0 for k in range(RING)},
        ["r0: min(r19 + 1, 5)", *(f"r{k}: r{k - 1} + 0" for k in range(1, RING))],
        {f"r{k}": (0, 5) for k in range(RING)},
    ),
}


@pytest.mark.parametrize("case", FOLLOWING)
def test_a_range_has_room_for_an_episode_and_no_more(meaning, case):
    state, sets, expected = FOLLOWING[case]
    rules = [{"when": "t > 0", "set": dict([text.split(": ")])} for text in sets]
    checked = meaning(state=state, rules=rules)
    assert checked.horizon == 20
    assert {name: register(checked, f"state.{name}") for name in expected} == expected


def test_what_grows_throughout_a_long_episode(meaning):
    rules = [{"when": "t > 0", "set": {"n": "n + 1", "m": "min(m + 2, 700)"}}]
    checked = meaning(horizon=1000, state={"n": 0, "m": 0}, rules=rules)
    assert 1000 <= register(checked, "state.n")[1] <= 1064
    assert register(checked, "state.m") == (0, 700)


def test_there_is_room_for_what_a_belief_comes_to(meaning):
    beliefs = {"now": {"of": "t", "start": 0}, "later": {"of": "guide.believes.now + 1", "start": 0}}
    checked = meaning(cast={"guide": {"beliefs": beliefs}})
    assert register(checked, "guide.believes.now") == (0, 20)
    assert register(checked, "guide.believes.later") == (0, 21)


@pytest.mark.parametrize(("member", "range_"), [("seen", (-4, -4)), ("heard", (-4, 7)), ("own", (-4, -4))])
def test_what_starts_with_what_may_be_nothing_has_no_more_room_for_it(meaning, member, range_):
    """Each resolution once took the number that stands for nothing for one more value."""
    beliefs = {
        "seen": {"of": "price", "when": "t > 7"},
        "heard": {"from": [{"of": "price"}, {"of": 7, "when": "t > 9"}]},
    }
    frames = {"count": {"let": {"own": "price"}, "states": {"s": {"then": [{"set": {"own": "price"}}]}}}}
    checked = meaning(
        state={"price": {"start": "none"}},
        rules=[{"when": "t > 5", "set": {"price": -4}}],
        frames=frames,
        cast={"guide": {"frame": "count", "beliefs": beliefs}},
    )
    path = "guide.own" if member == "own" else f"guide.believes.{member}"
    assert register(checked, path) == range_


@pytest.mark.parametrize(("start", "rounds"), [(0, 2), ({"start": 0, "range": "0..9"}, 1), ("pick(0..9)", 1)])
def test_a_scenario_is_resolved_again_only_where_a_range_is_wider(meaning, monkeypatch, start, rounds):
    count = 0

    class Counted(check._Run):
        def checked(self, name):
            nonlocal count
            count += 1
            return super().checked(name)

    monkeypatch.setattr(check, "_Run", Counted)
    said = {"set": {"price": "min(price + 1, 9)"}, "say": "It is <price>"}
    frames = {"count": {"states": {"s": {"then": [said]}}}}
    checked = meaning(state={"price": start}, frames=frames, cast={"guide": {"frame": "count"}})
    assert count == rounds
    assert register(checked, "state.price") == (0, 9)
    assert "9" in checked.words_in_order


# -- rewards --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sections", "code"),
    [
        ({"reward": {"success": "linear(1.5)"}}, "S204"),
        ({"reward": {"success": "exponential(0.5)"}}, "S204"),
        ({"reward": {"each_step": 3}}, "S106"),
        ({"outcome": [{"success": "t > 3", "reward": 101}]}, "S106"),
        ({"outcome": [{"success": "t > 3", "reward": -1}]}, "S106"),
        ({"outcome": [{"success": "t > 3", "reward": "exit"}]}, "S204"),
        ({"outcome": [{"success": "t > 3"}, {"failure": "t > 2", "reward": 10}]}, "S107"),
        ({"rules": [{"when": "t > 3", "reward": 101}]}, "S106"),
        ({"observe": {"channels": ["type", "color"]}}, "S106"),
    ],
)
def test_what_cannot_be_earned_or_seen(examine, sections, code):
    assert [d.code for d in examine(**sections).diagnostics] == [code]


def test_there_is_room_for_whoever_it_is_set_to(meaning):
    rules = [{"when": "t > 3", "set": {"whose": "agent"}}, {"when": "t > 4", "set": {"whose": "pick(cast)"}}]
    cast = {"guide": {"count": 3}}
    checked = meaning(state={"whose": "pick(guide)"}, rules=rules, cast=cast)
    assert register(checked, "state.whose") == (0, 3)
