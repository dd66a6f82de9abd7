"""Things in other things: laid in at reset, released when that is opened, moved from one to another, put back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from socialai_dsl.program import Op
from socialai_dsl.semantics.plans import CheckedScenario, Placing, Region
from socialai_dsl.semantics.terms import Compare, Const, FieldOf, Read, Type, World
from tests.socialai_dsl.compiler.workbench import (
    code,
    compiled,
    entity,
    listed,
    number,
    start,
    step,
    with_let,
    worth,
)
from tests.socialai_dsl.compiler.workshop import (
    AGENT,
    APPLE,
    CHEST,
    MARBLE,
    OTHER_CHEST,
    changed,
    effect,
    rule,
    with_content,
    with_rules,
    workshop,
)

HOLDERS = Type("entity", CHEST, OTHER_CHEST)
NOW = World(Type("int", 0, 20), "t")


def at(time: int) -> Compare:
    """It is this time."""
    return Compare("==", NOW, number(time))


@pytest.fixture
def filled() -> CheckedScenario:
    return with_content(workshop(), APPLE, CHEST)


def test_what_lies_in_something_is_out_of_the_room_and_on_no_cell(filled: CheckedScenario) -> None:
    env = start(filled)
    apple = env.describe()["apple"]
    assert (apple["at"], apple["gone"], apple["state"]) == (None, True, "whole")
    assert worth(FieldOf(Type("int", -1, 31), entity(APPLE), "x"), checked=filled) == -1
    assert worth(FieldOf(Type("int", -1, 31), entity(APPLE), "y"), checked=filled) == -1
    assert worth(FieldOf(HOLDERS, entity(APPLE), "inside"), checked=filled) == CHEST


def test_a_drawn_holder(filled: CheckedScenario) -> None:
    checked = with_let(workshop(), "let.where", Const(HOLDERS, OTHER_CHEST), HOLDERS)
    drawn = Read(HOLDERS, "let.where")
    *others, where = checked.setup
    placed = [
        replace(item, at=None, inside=drawn) if isinstance(item, Placing) and item.entity == APPLE else item
        for item in others
    ]
    placed = [item for item in placed if getattr(item, "entity", None) != APPLE] + [
        where,
        *(item for item in placed if getattr(item, "entity", None) == APPLE),
    ]
    checked = replace(checked, setup=tuple(placed))
    assert worth(FieldOf(Type("int", -1, 31), entity(APPLE), "x"), checked=checked) == 4


def test_a_layout_that_gives_its_place_lays_it_there(filled: CheckedScenario) -> None:
    assert start(filled, {"apple": {"at": [6, 1]}}).describe()["apple"]["at"] == [6, 1]


def test_several_contents_are_all_released(filled: CheckedScenario) -> None:
    both = with_content(filled, MARBLE, CHEST)
    both = changed(both, CHEST, contains=(APPLE, MARBLE))
    env = start(both)
    step(env, "toggle")
    after = env.describe()
    assert after["apple"]["at"] == after["marble"]["at"] == [2, 3]


def test_reset_keeps_only_what_can_change() -> None:
    checked = with_rules(workshop(), rule(None, effect("reset", CHEST), effect("reset", APPLE)))
    assert not [name.path for name in compiled(checked).registers if ".home" in name.path]
    vanishing = with_rules(checked, *checked.rules, rule(None, effect("vanish", APPLE)))
    paths = [name.path for name in compiled(vanishing).registers if ".home" in name.path]
    assert paths == ["apple.reset.home", "apple.reset.home.gone"]


def test_reset_of_one_of_several(filled: CheckedScenario) -> None:
    which = with_let(filled, "let.which", Const(HOLDERS, CHEST), HOLDERS)
    named = replace(effect("reset", CHEST), entities=(Read(HOLDERS, "let.which"),))
    env = start(with_rules(which, rule(at(2), named)))
    step(env, "toggle")
    assert env.describe()["apple"]["at"] == [2, 3]
    step(env)
    after = env.describe()
    assert after["apple"]["at"] is None
    assert after["chests"][0] == {"at": [2, 3], "color": "blue", "state": "shut"}


def test_overlap_counts_cells_that_are_taken() -> None:
    checked = workshop()
    (apple,) = (item for item in checked.setup if isinstance(item, Placing) and item.entity == APPLE)
    assert apple.at is not None
    chest = Region("rect", (number(2), number(3), number(2), number(3)))
    drawn = Placing(APPLE, apple.site, 0, apple.span, regions=(chest,), overlap=True)
    setup = tuple(drawn if item is apple else item for item in checked.setup)
    assert "B_FREE" not in code(compiled(replace(checked, setup=setup)), "reset")
    assert start(replace(checked, setup=setup)).describe()["apple"]["at"] == [2, 3]


def test_the_container_is_one_of_those_there_are(filled: CheckedScenario) -> None:
    """Of what never lay in anything `inside` is still a thing that can hold something."""
    inside = FieldOf(HOLDERS, entity(MARBLE), "inside")
    program = compiled(with_let(workshop(), "let.where", inside, HOLDERS))
    assert any(f"#{CHEST}" in line and Op.MAX.name in line for line in listed(program, "reset"))
    assert worth(inside, checked=workshop()) == CHEST
    assert AGENT not in (CHEST, OTHER_CHEST)
