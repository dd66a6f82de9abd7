"""What members of the cast take for true."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.terms import Const, Read, Sees, Select, walk

BOXES = {
    "boxes": {"type": "box", "count": 2, "place": "anywhere"},
    "toy": {"type": "ball", "inside": "pick(boxes)"},
}
SALLY = {"beliefs": {"toy_in": {"of": "toy.inside", "when": "sees(toy.inside)"}}}


@pytest.fixture
def believing(meaning):
    """A scenario in which Sally believes something, with an outcome about it."""

    def checked(condition, **cast):
        return meaning(objects=BOXES, cast={"sally": SALLY, **cast}, outcome=[{"success": condition}])

    return checked


def test_a_belief_starts_with_what_is_true(believing):
    checked = believing("sally.believes.toy_in == pick(boxes)")
    (register,) = [item for item in checked.setup if isinstance(item, Drawn) and "believes" in item.path]
    (plan,) = checked.beliefs
    assert register.path == plan.path == "sally.believes.toy_in"
    assert plan.member == "sally"
    assert register.value.term == plan.value.term


def test_it_is_renewed_when_its_condition_holds(believing):
    (plan,) = believing("sally.believes.toy_in == pick(boxes)").beliefs
    assert isinstance(plan.when.term, Sees)
    sally = plan.when.term.viewer
    assert isinstance(sally, Const)
    assert sally.value == 2  # after the agent and the guide


def test_without_a_condition_it_is_always_renewed(meaning):
    cast = {"sally": {"beliefs": {"way": {"of": "agent.facing"}}}}
    (plan,) = meaning(cast=cast, outcome=[{"success": "sally.believes.way == up"}]).beliefs
    assert plan.when is None


def test_of_one_of_several_the_one_that_is_meant_is_asked(believing):
    checked = believing("any(p in pair where p.believes.toy_in == pick(boxes))", pair={"count": 2, **SALLY})
    assert [plan.path for plan in checked.beliefs] == [
        "sally.believes.toy_in", "pair[0].believes.toy_in", "pair[1].believes.toy_in"
    ]  # fmt: skip
    (asked,) = [part for part in walk(checked.outcomes[0]) if isinstance(part, Select)]
    read = {part.path for part in walk(asked) if isinstance(part, Read)}
    assert read == {"pair[0].believes.toy_in", "pair[1].believes.toy_in"}


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


def test_a_belief_with_one_source_in_a_list_is_the_short_form(meaning):
    short = {"hue": {"of": "exit.color", "when": "sees(exit)"}}
    listed = {"hue": {"from": [{"of": "exit.color", "when": "sees(exit)"}]}}
    plans = [meaning(cast={"guide": {"beliefs": one}}).beliefs for one in (short, listed)]
    (a,), (b,) = plans
    assert (a.value.term, a.when.term, a.path) == (b.value.term, b.when.term, b.path)


def test_a_belief_has_room_for_the_things_of_all_its_sources(meaning):
    beliefs = {"who": {"start": "none", "from": [{"of": "agent", "when": "t > 3"}, {"of": "exit"}]}}
    checked = meaning(cast={"guide": {"beliefs": beliefs}})
    (drawn,) = [item for item in checked.setup if getattr(item, "path", "") == "guide.believes.who"]
    assert (drawn.type.kind, drawn.type.low, drawn.nothing) == ("entity", 0, -1)


def test_a_belief_of_a_belief(meaning):
    cast = {
        "guide": {"beliefs": {"hue": {"of": "exit.color", "when": "sees(exit)"}}},
        "witness": {"beliefs": {"guide_thinks": {"of": "guide.believes.hue", "when": "sees(guide)"}}},
    }
    checked = meaning(cast=cast)
    assert [belief.path for belief in checked.beliefs] == [
        "guide.believes.hue",
        "witness.believes.guide_thinks",
    ]
