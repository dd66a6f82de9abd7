"""What is pushed, rolls, opens, runs out, is pointed at and attended to."""

from __future__ import annotations

import pytest

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
