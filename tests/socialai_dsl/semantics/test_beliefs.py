"""What members of the cast take for true."""

from __future__ import annotations

import pytest

BOXES = {
    "boxes": {"type": "box", "count": 2, "place": "anywhere"},
    "toy": {"type": "ball", "inside": "pick(boxes)"},
}
SALLY = {"beliefs": {"toy_in": {"of": "toy.inside", "when": "sees(toy.inside)"}}}


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("sally.believes.toy_on == toy", "`sally` has no belief `toy_on`"),
        ("toy.believes.toy_in == toy", "only a member of the cast believes something"),
        ("guide.believes.toy_in == toy", "`guide` has no belief `toy_in`"),
        ("agent.believes", "`believes` needs the name of a belief after a dot: `agent.believes.where_it_is`"),
    ],
)
def test_beliefs_that_nobody_has(examine, condition, message):
    result = examine(objects=BOXES, cast={"sally": SALLY}, outcome=[{"success": condition}])
    assert [d.message for d in result.diagnostics] == [message]


def test_a_belief_has_room_for_the_things_of_all_its_sources(meaning):
    beliefs = {"who": {"start": "none", "from": [{"of": "agent", "when": "t > 3"}, {"of": "exit"}]}}
    checked = meaning(cast={"guide": {"beliefs": beliefs}})
    (drawn,) = [item for item in checked.setup if getattr(item, "path", "") == "guide.believes.who"]
    assert (drawn.type.kind, drawn.type.low, drawn.nothing) == ("entity", 0, -1)
