"""What is hidden behind what, for the agent's picture and for whoever is asked whether it sees something."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from socialai_dsl.program import CELL, Field, Flag, Op
from tests.assembly import OPEN, Assembly, batch_of, constant, entity_register, holds, result_of, step

SIDE = 9
OCCLUSION = int(Flag.OCCLUSION)
Cells = set[tuple[int, int]]


def shadow_cast(transparent: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The shadow casting of MiniGrid, bool (row, column): row 0 is the viewer's, who is in its middle."""
    rows, columns = transparent.shape
    lit = np.zeros((rows + 1, columns), np.bool_)
    lit[0, columns // 2] = True
    for row in range(rows):
        for start, end, side in ((0, columns - 1, 1), (columns - 1, 0, -1)):
            for column in range(start, end, side):
                if lit[row, column] and transparent[row, column]:
                    lit[row, column + side] = True
                    lit[row + 1, column + side] = True
                    lit[row + 1, column] = True
    return lit[:rows]


def view_of(opaque: Cells, x: int, y: int, direction: int, side: int) -> dict[tuple[int, int], bool]:
    """Cell -> whether it is lit, for each cell of the view that is on the canvas."""
    ahead = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    half = side // 2
    cells = {
        (row, right + half): (x + row * ahead[0] - right * ahead[1], y + row * ahead[1] + right * ahead[0])
        for row in range(side)
        for right in range(-half, half + 1)
    }

    def is_transparent(cell: tuple[int, int]) -> bool:
        return all(0 < z < SIDE - 1 for z in cell) and cell not in opaque

    transparent = np.array(
        [[is_transparent(cells[row, i]) for i in range(2 * half + 1)] for row in range(side)]
    )
    lit = shadow_cast(transparent)
    return {cell: bool(lit[place]) for place, cell in cells.items() if all(0 <= z < SIDE for z in cell)}


@pytest.mark.parametrize("seed", range(12))
def test_the_picture_and_what_is_seen_follow_the_shadows(seed: int) -> None:
    rng = np.random.default_rng(seed)
    inside = [(x, y) for x in range(1, SIDE - 1) for y in range(1, SIDE - 1)]
    doors = [inside[i] for i in rng.permutation(len(inside))[:12]]
    opened = [int(rng.integers(2)) for _ in doors]
    agent, npc = [cell for cell in inside if cell not in doors][:2]
    direction, side = int(rng.integers(4)), (3, 5, 7, 4)[seed % 4]
    room = Assembly(
        at=(agent, npc, *doors),
        npcs=1,
        facing=(direction,),
        objects=("door",) * len(doors),
        size=(SIDE, SIDE),
        canvas=(SIDE, SIDE),
        flags=OCCLUSION,
        reset=[
            (Op.LOAD, entity_register(2 + i, Field.STATUS), constant(OPEN)) for i, o in enumerate(opened) if o
        ],
        view=side,
        registers=SIDE * SIDE,
        horizon=100,
    )
    closed = {cell for cell, o in zip(doors, opened, strict=True) if not o}
    room.rules = []
    for y in range(SIDE):
        for x in range(SIDE):
            register = room.own + y * SIDE + x
            room.rules += [
                (Op.LOAD, register, constant(direction)),
                (Op.SEES, register, constant(0), constant(CELL + 32 * y + x)),
            ]
    batch = batch_of(room.program())
    step(batch)
    lit = view_of(closed, *agent, direction, side)
    asked = batch.state.registers[0, room.own : room.own + SIDE * SIDE].reshape(SIDE, SIDE)
    assert {(x, y) for y, x in np.argwhere(asked)} == {cell for cell, seen in lit.items() if seen}
    picture = batch.state.image.view(np.uint8).reshape(7, 7, 4)
    board = batch.state.boards[0, : SIDE * SIDE].view(np.uint8).reshape(SIDE, SIDE, 4)
    ahead = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    lit = view_of(closed, *agent, direction, 7)
    for i in range(7):
        for j in range(7):
            x = agent[0] + (6 - j) * ahead[0] - (i - 3) * ahead[1]
            y = agent[1] + (6 - j) * ahead[1] + (i - 3) * ahead[0]
            if (i, j) != (3, 6) and (x, y) in lit:
                expected = board[y, x].tolist() if lit[x, y] else [0, 0, 0, 0]
                assert picture[i, j].tolist() == expected, (i, j)
    assert picture[3, 6].tolist() == [1, 0, 0, 0]


# Light goes round a single thing, so there are three in a row.
ROOM = {"at": ((1, 2), (3, 2), (2, 1), (2, 2), (2, 3)), "npcs": 1}


@pytest.mark.parametrize(("flags", "seen"), [(0, 1), (OCCLUSION, 0)])
def test_a_closed_door_hides_what_is_behind_it_only_with_occlusion(flags: int, seen: int) -> None:
    own = Assembly(at=ROOM["at"]).own  # type: ignore[arg-type]
    sees = [(Op.LOAD, own, constant(0)), (Op.SEES, own, constant(0), constant(1))]
    assert result_of(sees, own, objects=("door",) * 3, flags=flags, **ROOM) == seen
    assert result_of(sees, own, objects=("door", "platform", "door"), flags=flags, **ROOM) == 1
    assert result_of(sees, own, objects=("door", "generator", "door"), flags=flags, **ROOM) == 1


def test_bodies_hide_nothing() -> None:
    own = Assembly(at=((1, 2),) * 4).own
    sees = [(Op.LOAD, own, constant(0)), (Op.SEES, own, constant(0), constant(3))]
    room = {"at": ((1, 2), (2, 2), (1, 1), (3, 2)), "npcs": 2, "objects": ("lava",), "flags": OCCLUSION}
    assert result_of(sees, own, **room) == 1


def test_one_opaque_thing_of_several_in_a_cell_is_enough() -> None:
    room = {**ROOM, "at": (*ROOM["at"], (2, 2)), "flags": OCCLUSION}  # type: ignore[misc]
    for objects in (("door", "door", "door", "platform"), ("door", "platform", "door", "door")):
        own = Assembly(at=room["at"]).own  # type: ignore[arg-type]
        sees = [(Op.LOAD, own, constant(0)), (Op.SEES, own, constant(0), constant(1))]
        assert result_of(sees, own, objects=objects, **room) == 0
        assert not holds((Op.IF_UNOBSTRUCTED, constant(0), constant(1)), objects=objects, **room)
