"""The status an object begins with, and statuses that follow from a condition."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.terms import FieldOf, Read, Select, walk


def of(checked, key):
    return [entity for entity in checked.entities if entity.key == key]


def objects(**described):
    return {"objects": {"doors": {"type": "door", "count": 2, "place": "wall(top)"}, **described}}


@pytest.mark.parametrize(
    ("described", "status"),
    [
        ({"type": "switch"}, "idle"),
        ({"type": "switch", "pressed": True}, "pressed"),
        ({"type": "switch", "pressed": False}, "idle"),
        ({"type": "box", "opened": True}, "opened"),
        ({"type": "door", "state": "locked"}, "locked"),
        ({"type": "box", "state": "locked"}, "locked"),
    ],
)
def test_a_known_initial_status(meaning, described, status):
    (entity,) = of(meaning(**objects(thing=described)), "thing")
    assert (entity.type.states[entity.status], entity.initial) == (status, None)


def test_a_drawn_initial_status_is_a_register_of_each(meaning):
    checked = meaning(**objects(lamps={"type": "switch", "count": 2, "pressed": "it.index == pick(0 | 1)"}))
    assert [entity.initial.path for entity in of(checked, "lamps")] == [
        "lamps[0].initial",
        "lamps[1].initial",
    ]
    drawn = {item.path: item.value.term for item in checked.setup if isinstance(item, Drawn)}
    term = drawn["lamps[1].initial"]
    assert isinstance(term, Select)
    assert [term.type.words[value.value] for value in (*term.values, term.default)] == ["pressed", "idle"]


def test_a_computed_status_has_one_to_hold_and_one_to_leave_for(meaning):
    checked = meaning(**objects(
        gate={"type": "door", "place": "wall(left)", "locked": "not coin.tagged"},
        coin={"type": "ball", "tagged": "agent.sees(it)"},
    ))  # fmt: skip
    names = {entity.number: entity for entity in checked.entities}
    found = [(names[c.entity].key, names[c.entity].type.states[c.on], names[c.entity].type.states[c.off])
             for c in checked.computed]  # fmt: skip
    assert found == [("coin", "tagged", "plain"), ("gate", "locked", "closed")]


def test_each_of_a_group_has_its_own_condition(meaning):
    checked = meaning(**objects(coins={"type": "ball", "count": 2, "tagged": "agent.next_to(it)"}))
    assert [computed.condition.term.object.value for computed in checked.computed] == [
        entity.number for entity in of(checked, "coins")
    ]
    assert [computed.condition.site for computed in checked.computed] == [
        "objects.coins[0].tagged",
        "objects.coins[1].tagged",
    ]


def test_a_condition_reads_statuses(meaning):
    checked = meaning(
        **objects(gate={"type": "door", "place": "wall(left)", "locked": "not any(d in doors where d.open)"})
    )
    (computed,) = checked.computed
    (read,) = {part.entity.type for part in _fields(computed.condition.term)}
    assert (read.low, read.high) == tuple(entity.number for entity in of(checked, "doors"))


def _fields(term):
    return [part for part in walk(term) if isinstance(part, FieldOf)]


def test_an_effect_resets_to_the_initial_register(meaning):
    checked = meaning(
        **objects(lamp={"type": "switch", "pressed": "agent.x > 2"}),
        rules=[{"when": "t == 3", "cause": "lamp.reset"}],
    )
    (lamp,) = of(checked, "lamp")
    assert isinstance(lamp.initial, Read)
    assert checked.rules[0].causes[0].name == "reset"


@pytest.mark.parametrize(
    ("described", "said"),
    [
        ({"type": "door", "pressed": True}, "S204 a door is never `pressed`; it is open or closed or locked"),
        ({"type": "switch", "locked": "true"}, "S204 a switch is never `locked`; it is idle or pressed"),
        ({"type": "switch", "pressed": True, "state": "idle"}, "S107 only one of `state` and `pressed` can be given"),
        ({"type": "ball", "tagged": "it.tagged"}, "S208 computed statuses in a circle: `thing` needs `thing`"),
        ({"type": "door", "state": "loked"},
         "S204 a door is never `loked`; it is open or closed or locked; did you mean `locked`?"),
        ({"type": "door", "place": "wall(left)", "locked": "3"},
         "S204 `3` is a number, but a condition is expected here"),
    ],
)  # fmt: skip
def test_mistakes(mistakes, described, said):
    assert mistakes(**objects(thing=described)) == [said]
