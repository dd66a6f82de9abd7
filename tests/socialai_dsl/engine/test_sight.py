"""View squares, and what one can look through."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.program import CELL, Field, Header, Op, room_words
from tests.assembly import (
    CLOSED,
    LOCKED,
    OPEN,
    Assembly,
    batch_of,
    constant,
    entity_register,
    holds,
    result_of,
    step,
    temporary,
)

WIDE = {"size": (11, 11), "canvas": (11, 11)}


@pytest.mark.parametrize("direction", range(4))
@pytest.mark.parametrize("side", [3, 5, 7])
def test_the_view_square(side: int, direction: int) -> None:
    """The viewer at (5, 5) in the middle of the near edge, its own row included; as it faces or as if it did."""
    own = Assembly(**WIDE).own  # type: ignore[arg-type]
    ahead = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    aside = ((0, 1), (-1, 0), (0, -1), (1, 0))[direction]
    expected = {
        (5 + f * ahead[0] + s * aside[0], 5 + f * ahead[1] + s * aside[1])
        for f in range(side)
        for s in range(-(side // 2), side // 2 + 1)
    }
    visible = []
    for y in range(11):
        # One bit for each cell of the line; a register holds 16.
        rules = []
        for x in range(11):
            rules += [
                (Op.LOAD, temporary(0), constant(direction)),
                (Op.SEES, temporary(0), constant(0), constant(CELL + 32 * y + x)),
                (Op.IF_NE, temporary(0), constant(0), 1),
                (Op.SET_BIT, own, constant(x)),
            ]
        line = result_of(rules, at=((5, 5),), view=side, facing=(1,), **WIDE)
        visible += [(x, y) for x in range(11) if line >> x & 1]
    assert set(visible) == {(x, y) for x, y in expected if 0 <= x < 11 and 0 <= y < 11}


def test_seeing_entities_that_are_present() -> None:
    room = {"at": ((1, 2), (3, 2)), "npcs": 1}
    own = Assembly(**room).own  # type: ignore[arg-type]
    look = [(Op.LOAD, own, constant(0)), (Op.SEES, own, constant(0), constant(1))]
    back = [(Op.LOAD, own, constant(2)), (Op.SEES, own, constant(0), constant(1))]
    assert result_of(look, **room) == 1
    assert result_of(back, **room) == 0
    for gone in (0, 1):
        assert result_of([(Op.VANISH, constant(gone)), *look], **room) == 0
    assert result_of(look, at=((1, 2), None), npcs=1) == 0


def looks(between: str, status: int = 0, **room: object) -> list[bool]:
    """Whether the agent at (1, 2) looks at, and is unobstructed to, the NPC at (4, 2); at (3, 2) lies something."""
    reset = [(Op.LOAD, entity_register(2, Field.STATUS), constant(status))]
    layout: dict[str, object] = {
        "at": ((1, 2), (4, 2), (3, 2)),
        "npcs": 1,
        "objects": (between,),
        "size": (7, 5),
        "canvas": (8, 6),
        "reset": reset,
        **room,
    }
    return [holds((op, constant(0), constant(1)), **layout) for op in (Op.IF_LOOKS_AT, Op.IF_UNOBSTRUCTED)]


def test_objects_are_looked_through_by_their_status() -> None:
    assert looks("door", OPEN) == [True, True]
    assert looks("door", CLOSED) == [False, False]
    assert looks("door", LOCKED) == [False, False]
    assert looks("lava") == [True, True]
    assert looks("door", CLOSED, at=((1, 2), (4, 2), (4, 2))) == [True, True], "strictly between"
    assert looks("door", CLOSED, at=((1, 2), (4, 2), (3, 1))) == [True, True]
    gone = [(Op.VANISH, constant(2))]
    assert looks("door", reset=gone) == [True, True]


def test_bodies_are_looked_past() -> None:
    at = ((1, 2), (4, 2), (2, 2), (3, 2))
    room = {"at": at, "npcs": 3, "size": (7, 5), "canvas": (8, 6)}
    assert holds((Op.IF_LOOKS_AT, constant(0), constant(1)), **room)
    assert holds((Op.IF_UNOBSTRUCTED, constant(0), constant(1)), **room)


@pytest.mark.parametrize(("view", "expected"), [(3, False), (4, True), (7, True)])
def test_one_looks_as_far_as_ones_view_goes(view: int, expected: bool) -> None:
    assert looks("lava", view=view) == [expected, True]


def test_one_looks_straight_ahead() -> None:
    for facing, expected in ((0, True), (1, False), (2, False), (3, False)):
        assert looks("lava", facing=(facing,)) == [expected, True]
    assert looks("lava", at=((1, 2), (4, 3), (3, 1))) == [False, False], "neither in a row nor in a column"
    assert looks("lava", at=((1, 2), (1, 2), (3, 1)), facing=(1,)) == [False, True], "not at ones own cell"


def test_walls_are_opaque_and_doors_in_them_as_they_stand() -> None:
    room = {"size": (5, 5), "canvas": (9, 7)}
    ray = constant(CELL + 32 * 2 + 8)
    assert not holds((Op.IF_UNOBSTRUCTED, constant(0), ray), at=((2, 2),), **room)
    for status, expected in ((OPEN, True), (CLOSED, False)):
        reset = [(Op.LOAD, entity_register(1, Field.STATUS), constant(status))]
        door = {"at": ((2, 2), (4, 2)), "objects": ("door",), "reset": reset, **room}
        assert holds((Op.IF_UNOBSTRUCTED, constant(0), ray), **door) == expected


@pytest.mark.parametrize("opaque", [False, True])
def test_what_is_built_is_looked_through_where_its_template_says_so(opaque: bool) -> None:
    own = Assembly(at=((1, 2), (3, 2)), npcs=1).own
    rules = [(Op.IF_UNOBSTRUCTED, constant(0), constant(1), 1), (Op.LOAD, own, constant(1))]
    program = Assembly(at=((1, 2), (3, 2)), npcs=1, rules=rules).program()
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    program.words[program.header(Header.ROOM_AT) + room_words(width, height) - width - height + 2] |= (
        opaque << 2
    )
    batch = batch_of(program)
    step(batch)
    assert batch.state.registers[0, own] == (not opaque)


def test_rays_leave_the_canvas() -> None:
    far = constant(CELL + 32 * 2 + 31)
    assert not holds((Op.IF_UNOBSTRUCTED, constant(0), far), at=((2, 2),))
    assert not holds((Op.IF_LOOKS_AT, constant(0), far), at=((2, 2),), view=40)


def test_views_are_symmetric_in_random_rooms() -> None:
    """`unobstructed` is the same from either end."""
    rng = np.random.default_rng(3)
    for _ in range(30):
        cells = rng.permutation(25)[:8]
        at = [(int(c % 5) + 1, int(c // 5) + 1) for c in cells]
        at[1] = (at[0][0], at[1][1])
        room = {"at": at, "npcs": 1, "objects": ("door",) * 6, "size": (7, 7), "canvas": (7, 7)}
        there, back = (
            holds((Op.IF_UNOBSTRUCTED, constant(a), constant(b)), **room) for a, b in ((0, 1), (1, 0))
        )
        low, high = sorted((at[0][1], at[1][1]))
        free = not any(x == at[0][0] and low < y < high for x, y in at[2:])
        assert there == back == free
