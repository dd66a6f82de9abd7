"""Things in other things: laid in at reset, released when that is opened, moved from one to another, put back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from socialai_dsl.program import Op
from socialai_dsl.semantics.plans import CheckedScenario, Placing, Region
from socialai_dsl.semantics.terms import Compare, Const, FieldOf, Read, Type, World
from tests.socialai_dsl.compiler.workbench import (
    cell,
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
    GUIDE,
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


def test_an_opened_box_is_replaced_by_its_content(filled: CheckedScenario) -> None:
    env = start(filled)
    step(env, "toggle")
    after = env.describe()
    assert after["chests"][0]["at"] is None
    assert after["apple"]["at"] == [2, 3]
    step(env, "toggle")
    assert env.describe()["apple"]["state"] == "eaten"


def test_an_opened_box_without_content_stays(filled: CheckedScenario) -> None:
    env = start(with_content(filled, APPLE, OTHER_CHEST))
    step(env, "toggle")
    after = env.describe()
    assert (after["chests"][0]["at"], after["chests"][0]["state"]) == ([2, 3], "opened")
    assert after["apple"]["at"] is None


def test_several_contents_are_all_released(filled: CheckedScenario) -> None:
    both = with_content(filled, MARBLE, CHEST)
    both = changed(both, CHEST, contains=(APPLE, MARBLE))
    env = start(both)
    step(env, "toggle")
    after = env.describe()
    assert after["apple"]["at"] == after["marble"]["at"] == [2, 3]


def test_reveal_opens(filled: CheckedScenario) -> None:
    env = start(with_rules(filled, rule(at(2), effect("reveal", CHEST))))
    step(env)
    assert env.describe()["apple"]["at"] is None
    step(env)
    assert env.describe()["apple"]["at"] == [2, 3]


def test_move_into_takes_it_out_of_the_room(filled: CheckedScenario) -> None:
    moved = effect("move_into", APPLE, value=entity(OTHER_CHEST))
    checked = with_rules(filled, rule(at(1), moved), rule(at(3), effect("reveal", OTHER_CHEST)))
    env = start(checked, {"apple": {"at": [6, 1]}})
    step(env)
    assert env.describe()["apple"]["at"] is None
    step(env)
    step(env)
    after = env.describe()
    assert after["apple"]["at"] == [4, 3]
    assert after["chests"][1]["at"] is None


def test_put_shares_a_cell(filled: CheckedScenario) -> None:
    checked = with_rules(
        workshop(),
        rule(at(1), effect("put", APPLE, value=entity(CHEST))),
        rule(at(2), effect("put", MARBLE, value=cell(3, 2))),
    )
    env = start(checked)
    step(env)
    assert env.describe()["apple"]["at"] == [2, 3]
    step(env)
    assert env.describe()["marble"]["at"] == [3, 2]


def test_a_body_is_put_where_it_can_stand(filled: CheckedScenario) -> None:
    checked = with_rules(
        workshop(),
        rule(at(1), effect("put", GUIDE, value=entity(CHEST))),
        rule(at(2), effect("put", GUIDE, value=cell(3, 2))),
    )
    env = start(checked)
    step(env)
    assert env.describe()["guide"]["at"] == [7, 5]
    step(env)
    assert env.describe()["guide"]["at"] == [3, 2]


def test_reset_puts_contents_back(filled: CheckedScenario) -> None:
    env = start(with_rules(filled, rule(at(3), effect("reset", CHEST))))
    before = env.describe()
    step(env, "toggle")
    step(env, "toggle")
    assert env.describe()["chests"][0]["at"] is None
    step(env)
    after = env.describe()
    assert after["chests"] == before["chests"]
    assert after["apple"] == before["apple"] | {"state": "eaten"}
    step(env, "toggle")
    assert env.describe()["apple"]["at"] == [2, 3]


def test_reset_puts_back_place_and_direction(filled: CheckedScenario) -> None:
    checked = with_rules(
        workshop(),
        rule(at(1), effect("put", MARBLE, value=cell(3, 2)), effect("put", GUIDE, value=cell(5, 2))),
        rule(at(2), effect("vanish", APPLE)),
        rule(at(3), effect("reset", MARBLE, APPLE, GUIDE)),
    )
    env = start(checked)
    before = env.describe()
    step(env)
    step(env)
    between = env.describe()
    assert between["marble"]["at"] == [3, 2]
    assert between["guide"]["at"] == [5, 2]
    assert between["apple"]["at"] is None
    step(env)
    after = env.describe()
    for thing in ("marble", "apple", "guide"):
        assert after[thing]["at"] == before[thing]["at"]


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
