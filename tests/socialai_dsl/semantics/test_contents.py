"""Objects in objects, and what is done to them."""

from __future__ import annotations

import pytest

BOXES = {
    "boxes": {"type": "box", "count": 2, "place": "anywhere", "exclusive": True},
    "toy": {"type": "ball", "inside": "home"},
    "lamp": {"type": "switch", "place": "anywhere"},
}
LET = {"home": "pick(boxes)"}


@pytest.mark.parametrize(
    ("effect", "code"),
    [
        ("toy.move_into(lamp)", "S204"),
        ("guide.move_into(home)", "S204"),
        ("toy.move_into(boxes)", "S204"),
        ("lamp.put(nowhere)", "S204"),
        ("lamp.reveal", "S204"),
        ("agent.reset", "S211"),
        ("agent.vanish", "S204"),
    ],
)
def test_effects_that_cannot_be(examine, effect, code):
    found = examine(objects=BOXES, let=LET, rules=[{"when": "t > 3", "cause": [effect]}]).diagnostics
    assert [d.code for d in found] == [code]


@pytest.mark.parametrize("inside", ["lamp", "guide", "boxes", "toy"])
def test_where_nothing_can_lie(examine, inside):
    objects = {**BOXES, "toy": {"type": "ball", "inside": inside}}
    assert [d.code for d in examine(objects=objects, let=LET).diagnostics] == ["S204"]


def test_what_is_only_carried_lies_in_nothing_and_the_cure_asks_about_hands(examine):
    """`inside: guide` puts it into hands, so `inside:` is no cure for `x.inside`."""
    objects = {"coin": {"type": "ball", "carryable": True, "inside": "guide"}}
    (found,) = examine(objects=objects, outcome=[{"success": "coin.inside == guide"}]).diagnostics
    assert found.code == "S204"
    assert "`ann.carries(x)`" in found.hint


@pytest.mark.parametrize("inside", ["guide", "holder", "first(c in cast where c != agent)", None])
def test_what_only_hands_ever_held_lies_in_nothing_beside_boxes_as_well(examine, inside):
    """Neither `inside:` nor `move_into` puts it into a box, so `x.inside` would be none that it ever was in."""
    coin = {"coin": {"type": "ball", "carryable": True} | ({"inside": inside} if inside else {})}
    let = {**LET, "holder": "first(c in cast where c != agent)"}
    rules = [{"when": "t == 3", "cause": ["coin.move_into(guide)"]}]
    outcome = [{"success": "coin.inside == home"}, {"failure": "holder == guide"}]
    found = examine(objects={**BOXES, **coin}, let=let, rules=rules, outcome=outcome).diagnostics
    assert [d.code for d in found if d.code.startswith("S")] == ["S204"]
    assert "never lies inside anything" in str(found)


@pytest.mark.parametrize(("start", "codes"), [(None, ["S204"]), ("none", [])])
def test_what_lies_in_nothing_at_first_is_no_start(examine, start, codes):
    belief = {"of": "ball.inside"} | ({"start": start} if start else {})
    rules = [{"when": "t == 3", "cause": ["ball.move_into(home)"]}]
    found = examine(
        objects={**BOXES, "ball": {"type": "ball"}},
        let=LET,
        rules=rules,
        cast={"guide": {"beliefs": {"it_in": belief}}},
        outcome=[{"success": "guide.believes.it_in == home"}],
    ).diagnostics
    assert [d.code for d in found if d.code.startswith("S")] == codes
