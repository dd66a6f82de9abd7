"""Registers of the world and of frames: ranges, and who sets them."""

from __future__ import annotations

import pytest

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
