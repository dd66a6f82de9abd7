"""Objects in objects, and what is done to them."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Placing
from socialai_dsl.semantics.terms import Const, FieldOf

BOXES = {
    "boxes": {"type": "box", "count": 2, "place": "anywhere", "exclusive": True},
    "toy": {"type": "ball", "inside": "home"},
    "lamp": {"type": "switch", "place": "anywhere"},
}
LET = {"home": "pick(boxes)"}


def of(checked, key):
    return [entity for entity in checked.entities if entity.key == key]


def test_it_is_put_where_its_container_is(meaning):
    checked = meaning(objects=BOXES, let=LET)
    (toy,) = of(checked, "toy")
    (placing,) = [item for item in checked.setup if isinstance(item, Placing) and item.entity == toy.number]
    boxes = [box.number for box in of(checked, "boxes")]
    assert [placing.inside.type.low, placing.inside.type.high] == boxes
    order = [item.entity for item in checked.setup if isinstance(item, Placing)]
    assert all(order.index(box) < order.index(toy.number) for box in boxes)


def test_containers_know_what_may_lie_in_them(meaning):
    checked = meaning(objects=BOXES, let=LET)
    (toy,) = of(checked, "toy")
    assert [box.contains for box in of(checked, "boxes")] == [(toy.number,)] * 2
    assert of(checked, "lamp")[0].contains == ()


def test_without_anything_inside_nothing_is_contained(meaning):
    objects = {**BOXES, "toy": {"type": "ball", "place": "anywhere"}}
    assert {box.contains for box in of(meaning(objects=objects, let=LET), "boxes")} == {()}


def test_what_something_lies_in(outcome_term):
    asked = outcome_term("toy.inside == home", objects=BOXES, let=LET)
    assert isinstance(asked.left, FieldOf)
    assert asked.left.name == "inside"
    assert asked.left.type.size == 2


def test_something_next_to_what_lies_in_a_box_has_a_place(meaning):
    meaning(objects={**BOXES, "lamp": {"type": "switch", "place": "next_to(toy)"}}, let=LET)


@pytest.mark.parametrize(
    ("effect", "name", "subjects"),
    [
        ("toy.move_into(home)", "move_into", 1),
        ("lamp.put(agent)", "put", 1),
        ("home.reveal", "reveal", 1),
        ("boxes.reset", "reset", 2),
        ("guide.reset", "reset", 1),
    ],
)
def test_effects(meaning, effect, name, subjects):
    (rule,) = meaning(objects=BOXES, let=LET, rules=[{"when": "t > 3", "cause": [effect]}]).rules
    (caused,) = rule.causes
    assert (caused.name, len(caused.entities)) == (name, subjects)
    assert (caused.value is not None) == ("(" in effect)


def test_all_objects_are_reset_at_once(meaning):
    checked = meaning(objects=BOXES, let=LET, rules=[{"when": "t > 3", "cause": ["objects.reset"]}])
    (caused,) = checked.rules[0].causes
    numbers = [entity.number for entity in checked.entities if entity.role == "object"]
    assert [entity.value for entity in caused.entities if isinstance(entity, Const)] == numbers


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
