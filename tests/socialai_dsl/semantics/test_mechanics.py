"""What is pushed, rolls, opens, runs out, is pointed at and attended to."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import Const, FieldOf, Measure, PokedNow, walk
from socialai_dsl.semantics.terms import Test as Relation

THINGS = {
    "marble": {"type": "marble", "place": "anywhere"},
    "engines": {
        "type": "generator",
        "count": 2,
        "place": "anywhere",
        "pushed_by": "marble",
        "exclusive": True,
    },
    "lever": {"type": "lever", "place": "wall(top)", "timer": 5, "opens": "gate"},
    "gate": {"type": "remote_door", "place": "wall(bottom)"},
}


def test_what_objects_do_to_each_other(meaning):
    by_key = {}
    for entity in meaning(objects=THINGS).entities:
        by_key.setdefault(entity.key, []).append(entity)
    (lever,), (gate,), engines = by_key["lever"], by_key["gate"], by_key["engines"]
    assert (lever.timer, lever.opens) == (5, (gate.number,))
    assert [engine.exclusive for engine in engines] == [tuple(engine.number for engine in engines)] * 2
    assert all(engine.pushed_by_rolling for engine in engines)
    assert not by_key["marble"][0].pushed_by_rolling


@pytest.mark.parametrize(
    ("key", "changes", "code"),
    [
        ("engines", {"pushed_by": "gate"}, "S204"),
        ("engines", {"pushed_by": "marbel"}, "S204"),
        ("gate", {"pushed_by": "marble"}, "S204"),
        ("gate", {"timer": 3}, "S204"),
        ("gate", {"exclusive": True}, "S204"),
        ("lever", {"timer": 0}, "S106"),
        ("lever", {"opens": "marble"}, "S204"),
        ("lever", {"opens": "agent"}, "S204"),
        ("marble", {"opens": "gate"}, "S204"),
        ("gate", {"count": 3}, None),
        ("lever", {"count": 3}, None),
    ],
)
def test_what_they_cannot_do(examine, key, changes, code):
    objects = {**THINGS, key: {**THINGS[key], **changes}}
    found = examine(objects=objects, room={"size": 8}).diagnostics
    assert [d.code for d in found] == [code] * (code is not None)


@pytest.fixture
def doing(meaning):
    """The activity of the guide."""

    def activity(do):
        frames = {"act": {"states": {"s": {"do": do}}}}
        checked = meaning(objects=THINGS, frames=frames, cast={"guide": {"frame": "act"}})
        return checked.frames[0].states[0].activity

    return activity


def test_pointing_at_something_is_pointing_its_way(doing):
    activity = doing("point(marble)")
    assert activity.name == "point"
    (way,) = activity.args
    assert isinstance(way, Measure)
    assert (way.name, way.args[0].value) == ("dir_to", 1)


@pytest.mark.parametrize(
    ("do", "name", "arguments"),
    [
        ("push(marble, up)", "push", 2),
        ("follow(agent)", "go_next_to", 1),
        ("flee(agent)", "flee", 1),
        ("stop_pointing", "stop_pointing", 0),
    ],
)
def test_activities(doing, do, name, arguments):
    activity = doing(do)
    assert (activity.name, len(activity.args)) == (name, arguments)


@pytest.mark.parametrize(
    ("member", "do", "code"),
    [
        ("guide", "push(gate, up)", "S204"),
        ("guide", "push(marble)", "S211"),
        ("guide", "push(marble, forward)", "S204"),
        ("guide", "push(engines, up)", "S204"),
        ("guide", "point(red)", "S204"),
        ("guide", "follow(agent.cell)", "S204"),
        ("agent", "point(marble)", "S204"),
        ("agent", "stop_pointing", "S204"),
    ],
)
def test_activities_that_nobody_can_do(examine, member, do, code):
    frames = {"act": {"states": {"s": {"do": do}}}}
    result = examine(objects=THINGS, frames=frames, cast={member: {"frame": "act"}})
    assert [d.code for d in result.diagnostics] == [code]


def test_a_frame_that_nobody_plays_may_point(examine):
    frames = {"act": {"states": {"s": {"do": "point(marble)"}}}}
    found = examine(objects=THINGS, frames=frames, cast={"guide": None, "agent": {}}).diagnostics
    assert "S204" not in [d.code for d in found]


def test_both_look_at_the_same(outcome_term):
    term = outcome_term("guide.joint_attention(agent, marble)", objects=THINGS)
    looks = [part for part in walk(term) if isinstance(part, Relation)]
    assert [(look.name, look.subject.value) for look in looks] == [("looks_at", 1), ("looks_at", 0)]


def test_without_an_object_any_will_do(outcome_term):
    term = outcome_term("guide.joint_attention(agent)", objects=THINGS)
    looks = [part for part in walk(term) if isinstance(part, Relation)]
    assert len({look.object.value for look in looks}) == 4 + 5  # the doors, and the things


def test_who_toggled(outcome_term):
    asked = {"objects": THINGS, "let": {"one": "pick(agent | guide)"}}
    term = outcome_term("lever.toggled_by(one)", **asked)
    assert [type(part) for part in walk(term) if isinstance(part, PokedNow)] == [PokedNow]
    (used,) = [part for part in walk(term) if isinstance(part, FieldOf)]
    assert isinstance(used.entity, Const)
    assert (used.name, used.entity.value) == ("toggled", 1)


@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("agent.pointing", "S204"),
        ("agent.points_at(lever)", "S204"),
        ("lever.pointing", "S204"),
        ("lever.joint_attention(agent)", "S204"),
        ("agent.joint_attention(lever)", "S204"),
        ("agent.toggled", "S204"),
        ("guide.toggled_by(agent)", "S204"),
        ("lever.toggled_by(gate)", "S211"),
        ("lever.looks_at(agent)", "S211"),
    ],
)
def test_what_is_asked_of_the_wrong_one(examine, condition, code):
    result = examine(objects=THINGS, outcome=[{"success": condition}])
    assert [d.code for d in result.diagnostics] == [code]
