"""Frames as their members play them."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import Const, Heard, Logic, Operation, Quantification, Read
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.vocabulary import PRIMITIVES


def frame(**states):
    return {"talk": {"states": {name: body or {} for name, body in states.items()}}}


def played(meaning, frames, cast=None, **sections):
    checked = meaning(frames=frames, cast=cast or {"guide": {"frame": "talk"}}, **sections)
    return checked.frames[0]


def test_every_member_plays_its_own_copy(meaning):
    frames = {"talk": {"slots": {"line": "text"}, "states": {"a": {"then": [{"say": "<line>"}]}}}}
    cast = {
        "guide": {"frame": "talk", "with": {"line": "Hi"}},
        "other": {"frame": "talk", "with": {"line": "Ho"}},
        "agent": {},
    }
    checked = meaning(frames=frames, cast=cast)
    assert [(f.member, f.states[0].then[0].say.parts) for f in checked.frames] == [
        ("guide", ("Hi",)),
        ("other", ("Ho",)),
    ]


def test_a_rule_is_named_by_its_address_or_id(meaning):
    frames = frame(a={"first": [{"goto": "b"}], "then": [{"say": "x", "id": "greet"}]}, b=None)
    plan = played(meaning, frames)
    assert plan.states[0].first[0].name == "guide.talk.a.first[0]"
    assert plan.states[0].then[0].name == "greet"
    assert plan.states[0].then[0].site == "guide/frames.talk.states.a.then[greet]"


def test_the_first_state_is_the_start(meaning):
    assert played(meaning, frame(a={"then": [{"goto": "b"}]}, b=None)).start == "a"


def test_picks_in_a_rule_have_the_site_of_who_plays(meaning):
    plan = played(meaning, frame(a={"then": [{"say": "Try <pick(colors)> or <pick(colors)>"}]}))
    line = plan.states[0].then[0].say
    assert line.site == "guide/frames.talk.states.a.then[0].say"
    assert [p.ordinal for p in line.parts if isinstance(p, Quantification)] == [0, 1]


def test_a_text_slot_that_is_the_whole_line_has_the_slots_site(meaning):
    frames = {
        "talk": {
            "slots": {"line": "text"},
            "states": {"a": {"then": [{"say": "<line>"}, {"say": "So <line>"}]}},
        }
    }
    plan = played(meaning, frames, {"guide": {"frame": "talk", "with": {"line": "<pick(colors)>!"}}})
    whole, part = (rule.say for rule in plan.states[0].then)
    assert (whole.site, whole.parts[0].site) == ("cast.guide.with.line", "")
    assert (part.site, part.parts[1].site) == (
        "guide/frames.talk.states.a.then[1].say",
        "cast.guide.with.line",
    )


def test_a_bool_slot_is_put_in_wherever_it_is_used(meaning):
    frames = {"talk": {"slots": {"near": "bool"}, "states": {"a": {"then": [{"when": "near", "say": "x"}]}}}}
    plan = played(meaning, frames, {"guide": {"frame": "talk", "with": {"near": "pick(true | false)"}}})
    assert plan.states[0].then[0].when.term.site == "cast.guide.with.near"


def test_hears_with_a_value_becomes_a_condition(meaning):
    rule = {"hears": "Here is <n>", "when": "next_to(agent)", "say": "x"}
    plan = played(meaning, frame(a={"then": [rule]}), let={"n": "pick(1..3)"})
    rule = plan.states[0].then[0]
    assert rule.hears == ()
    choices, near = rule.when.term.args
    assert isinstance(choices, Logic)
    assert len(choices.args) == 3
    heard, equal = choices.args[0].args
    assert isinstance(heard, Heard)
    assert heard.patterns[0].pairs == {(1, 6)}
    assert equal.left == Read(equal.left.type, "let.n")
    assert near.name == "next_to"


def test_hears_takes_alternatives_and_any_noun(meaning):
    plan = played(meaning, frame(a={"then": [{"hears": ["How are you?", "where is <noun>"], "say": "x"}]}))
    one, many = plan.states[0].then[0].hears
    assert one.pairs == {(2, 2)}
    assert many.pairs == {(0, n) for n in range(9)}


def test_npcs_hear_each_other(meaning):
    frames = frame(a={"then": [{"hears": "hello there", "say": "x"}]})
    frames["greet"] = {"steps": [{"say": "Hello there!"}]}
    plan = played(meaning, frames, {"guide": {"frame": "talk"}, "other": {"frame": "greet"}, "agent": {}})
    (pattern,) = plan.states[0].then[0].hears
    assert (pattern.pairs, pattern.said_by_npcs) == (frozenset(), {"Hello there!"})


def test_steps(meaning):
    frames = {
        "talk": {
            "steps": [
                {"do": "stay", "for": 2},
                {"do": "face(agent)", "until": "eye_contact(agent)"},
                {"say": "x", "state": "end", "for": "ever"},
            ]
        }
    }
    steps = played(meaning, frames).steps
    assert [s.duration for s in steps] == [2, None, -1]
    assert [s.state for s in steps] == [None, None, "end"]
    assert steps[1].until.site == "guide/frames.talk.steps[1].until"


def test_wander_chooses_among_three_actions(meaning):
    activity = played(meaning, frame(a={"do": "wander"})).states[0].activity
    assert (activity.name, [a.value for a in activity.args], activity.weights) == (
        "choose",
        [2, 0, 1],
        (1, 1, 1),
    )


def test_choose_has_weights(meaning):
    activity = played(meaning, frame(a={"do": "choose(left | 3 * forward)"})).states[0].activity
    assert ([a.value for a in activity.args], activity.weights) == ([0, 2], (1, 3))


def test_effects_on_a_group(meaning):
    plan = played(
        meaning, frame(a={"then": [{"cause": ["doors.open", "exit.become(locked)", "self.vanish"]}]})
    )
    opened, locked, gone = plan.states[0].then[0].causes
    assert [e.value for e in opened.entities] == [2, 3, 4, 5]
    assert (locked.name, locked.value.value) == ("become", 2)
    assert gone.entities[0].value == 1


def test_an_unplayed_frame_is_checked_too(mistakes):
    assert mistakes(frames=frame(a={"do": "go_to(nowhere_to_be_found)"}))[0].startswith("S201")


def test_a_slot_is_looked_at_though_the_frame_never_uses_it(mistakes):
    frames = {"talk": {"slots": {"line": "text"}, "states": {"a": {}}}}
    found = mistakes(frames=frames, cast={"guide": {"frame": "talk", "with": {"line": "<exitt.color>"}}})
    assert [line[:4] for line in found] == ["S201"]


def test_what_the_agent_says_is_spelled_as_in_the_grammar(meaning):
    frames = {"talk": {"steps": [{"say": "how are YOU?"}]}}
    plan = played(meaning, frames, {"guide": {}, "agent": {"frame": "talk"}})
    assert plan.steps[0].say.parts == ("How are you",)


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


def test_a_constant_is_no_pick(meaning):
    assert isinstance(register(meaning, "pick(1..3)", 2)[1].term, Const)


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
