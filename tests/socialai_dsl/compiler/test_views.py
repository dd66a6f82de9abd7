"""What cast members see: squares of view, straight looks, and how the compiler asks for them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from socialai_dsl.program import EntityColumn, Flag, Header
from socialai_dsl.semantics.terms import DIRECTION, Const, Measure, Sees, Term
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DIE,
    DOOR,
    GUIDE,
    STATUE,
    cell,
    compiled,
    entity,
    workbench,
    worth,
)


def direction(value: int) -> Const:
    return Const(DIRECTION, value)


CONDITIONS: list[tuple[Term, bool]] = [
    (Sees(entity(AGENT), entity(GUIDE)), True),
    (Sees(entity(AGENT), entity(STATUE)), True),
    (Sees(entity(AGENT), entity(GUIDE), direction(2)), False),
    (Sees(entity(GUIDE), cell(1, 1)), True),
    (Sees(entity(GUIDE), cell(5, 5)), False),
    (Sees(entity(GUIDE), cell(5, 5), direction(1)), True),
    (Sees(entity(GUIDE), entity(AGENT), Measure(DIRECTION, "dir_to", (entity(GUIDE), entity(AGENT)))), True),
    (Relation("looks_at", entity(AGENT), entity(BOX)), True),
    (Relation("looks_at", entity(STATUE), entity(AGENT)), False),
    (Relation("looks_at", entity(STATUE), entity(GUIDE)), True),
    (Relation("unobstructed", entity(AGENT), entity(STATUE)), False),
    (Relation("unobstructed", entity(STATUE), entity(GUIDE)), True),
]


@pytest.mark.parametrize(("term", "expected"), CONDITIONS)
def test_conditions(term: Term, expected: bool) -> None:
    assert worth(term) is expected


def test_the_direction_may_be_drawn() -> None:
    seen = [worth(Sees(entity(AGENT), cell(1, 1), DIE), {"let": {"die": value}}) for value in range(4)]
    assert seen == [False, False, True, True]


def test_what_is_not_in_the_room_is_not_seen() -> None:
    gone = {"statue": {"gone": True}}
    assert worth(Sees(entity(AGENT), entity(STATUE)), gone) is False


def test_the_square_is_as_large_as_the_entity_says() -> None:
    near = replace(
        workbench(),
        entities=tuple(replace(e, view=2) if e.number == AGENT else e for e in workbench().entities),
    )
    program = compiled(near)
    at = program.header(Header.ENTITY_AT)
    views = [program.words[at + EntityColumn.COLUMNS * e.number + EntityColumn.VIEW] for e in near.entities]
    assert views == [2, 7, 7, 7, 7, 7, 7]
    assert worth(Sees(entity(AGENT), entity(BOX)), checked=near) is True
    assert worth(Sees(entity(AGENT), entity(GUIDE)), checked=near) is False
    assert worth(Relation("looks_at", entity(AGENT), entity(GUIDE)), checked=near) is False


def test_only_cast_members_see() -> None:
    with pytest.raises(AssertionError, match="refused"):
        worth(Sees(cell(1, 1), entity(DOOR), direction(0)))


@pytest.mark.parametrize("egocentric", [False, True])
def test_the_flag_of_egocentric_pictures(egocentric: bool) -> None:
    program = compiled(replace(workbench(), egocentric=egocentric))
    assert bool(program.header(Header.FLAGS) & Flag.EGOCENTRIC) is egocentric
