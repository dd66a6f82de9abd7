"""Frames as their members play them."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import Operation
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.vocabulary import PRIMITIVES


def frame(**states):
    return {"talk": {"states": {name: body or {} for name, body in states.items()}}}


def test_an_unplayed_frame_is_checked_too(mistakes):
    assert mistakes(frames=frame(a={"do": "go_to(nowhere_to_be_found)"}))[0].startswith("S201")


def test_a_slot_is_looked_at_though_the_frame_never_uses_it(mistakes):
    frames = {"talk": {"slots": {"line": "text"}, "states": {"a": {}}}}
    found = mistakes(frames=frames, cast={"guide": {"frame": "talk", "with": {"line": "<exitt.color>"}}})
    assert [line[:4] for line in found] == ["S201"]


def register(meaning, start, change, horizon=20):
    frames = {"talk": {"let": {"n": start}, "states": {"a": {"then": [{"set": {"n": change}}]}}}}
    checked = meaning(frames=frames, cast={"guide": {"frame": "talk"}}, horizon=horizon)
    (drawn,) = [s for s in checked.setup if getattr(s, "path", "") == "guide.n"]
    (item,) = checked.frames[0].states[0].then[0].sets
    assert item.path == "guide.n"
    return drawn.type, item.value


def test_a_counter_has_room_for_a_whole_episode(meaning):
    type_, value = register(meaning, 0, "n + 2")
    assert type_.low == 0
    assert type_.high >= 2 * 20
    assert isinstance(value.term, Operation)


def test_a_counter_with_a_bound_stays_within_it(meaning):
    up, _ = register(meaning, 5, "min(n + 1, 40)", horizon=200)
    down, _ = register(meaning, 5, "max(n - 1, 0)")
    assert [(up.low, up.high), (down.low, down.high)] == [(5, 40), (0, 5)]


def test_growth_without_end_is_a_mistake(mistakes):
    frames = {"talk": {"let": {"n": 1}, "states": {"a": {"then": [{"set": {"n": "n * 3"}}]}}}}
    found = mistakes(frames=frames, cast={"guide": {"frame": "talk"}})
    assert [line[:4] for line in found] == ["S106"]


def test_registers_of_an_unplayed_frame_are_looked_at_but_never_drawn(meaning, mistakes):
    def frames(change):
        rule = {"when": "goal.locked", "set": {"n": change}}
        return {"idle": {"slots": {"goal": "object"}, "let": {"n": 0}, "states": {"a": {"then": [rule]}}}}

    assert not any(
        str(getattr(s, "path", "")).split(".")[-1] == "n" for s in meaning(frames=frames("n + 1")).setup
    )
    assert [line[:4] for line in mistakes(frames=frames("m + 1"))] == ["S201"]


NEEDS = {
    **{word: (word,) for word in ("left", "right", "forward", "toggle", "pickup", "drop")},
    "turn(left)": ("left",),
    **dict.fromkeys(("face(toy)", "turn_to(up)", "turn(side)"), ("left", "right")),
    "choose(left | toggle)": ("left", "toggle"),
    "perform(dance)": ("right", "pickup"),
    **dict.fromkeys(
        (
            *("go_to(toy)", "go_next_to(toy)", "search(toy)", "follow(guide)", "flee(guide)", "wander"),
            *("stay_near(guide, 2)", "go_away_from(guide, 2)", "push(stone, up)", "enter(mat)"),
        ),
        ("left", "right", "forward"),
    ),
    "use(gate)": ("left", "right", "forward", "toggle"),
    "enter(gate)": ("left", "right", "forward", "toggle"),
    "fetch(toy)": ("left", "right", "forward", "pickup"),
    "give(toy, guide)": ("left", "right", "forward", "drop"),
    "bring(toy, guide)": ("left", "right", "forward", "pickup", "drop"),
    "stay": (),
}
"""Activity -> the body actions that the agent needs for it."""

THINGS = {
    "toy": {"type": "ball", "carryable": True},
    "stone": {"type": "marble"},
    "mat": {"type": "floor", "place": "anywhere"},
    "gate": {"type": "door", "place": "wall(top)"},
}


def scripted(do, member, actions):
    lets = {"dance": {"sequence": 2, "moves": ["right", "pickup"]}}
    if "side" in do:
        lets["side"] = "pick(left | right)"
    cast = {"guide": {}, "agent": {}}
    cast[member] = {"frame": "solve"}
    steps = {"solve": {"steps": [{"do": do, "for": 3}]}}
    return {"objects": THINGS, "let": lets, "frames": steps, "cast": cast, "actions": list(actions)}


def test_every_activity_is_known_by_the_actions_that_it_needs():
    npcs = {"point", "point_at", "stop_pointing"}
    assert {do.partition("(")[0] for do in NEEDS} == ACTIVITIES.keys() - npcs


@pytest.mark.parametrize("do", NEEDS)
def test_a_script_needs_actions_that_the_agent_has(examine, do):
    """With exactly these it is right, and without any of them it is not; an NPC has all actions."""
    needed = NEEDS[do]
    assert not examine(**scripted(do, "agent", needed or ["done"])).has_errors
    for lacking in needed:
        others = [action for action in PRIMITIVES if action != lacking]
        (found,) = [d for d in examine(**scripted(do, "agent", others)).diagnostics if d.code[0] == "S"]
        assert found.code == "S320"
        assert f"`{lacking}`" in found.message
        assert not examine(**scripted(do, "guide", others)).has_errors


def test_a_frame_that_nobody_plays_is_nobody_s(examine):
    """Without any NPC it is not taken for the agent's, and without who plays it its beliefs are not missed."""
    rules = [
        {"hears": "How are you", "say": "Here I am, <self.believes.seen_at>", "to": "speaker", "goto": "b"},
        {"when": "was_poked and eye_contact(agent)", "say": "Ouch", "cause": ["self.vanish"]},
    ]
    states = {"a": {"do": "point(exit)", "then": rules}, "b": {"do": "point_at(exit)"}}
    frames = {"talk": {"states": states}}
    believing = {"frame": "talk", "beliefs": {"seen_at": {"of": "exit.x"}}}
    assert not examine(frames=frames, cast={"guide": believing}).has_errors
    assert not examine(frames=frames, cast={"guide": {}}).has_errors
    assert not examine(frames=frames, cast={"guide": believing}, remove=["guide"]).has_errors
