"""Room templates: for every size a room can have, its cells as pictured, its solid cells and its floor."""

from __future__ import annotations

from itertools import product

from socialai_dsl.program import CODES_OF_TYPES, pack_cell
from socialai_dsl.semantics.geometry import interior_cells
from socialai_dsl.semantics.terms import ObjectType, RoomPlan

EMPTY = pack_cell(CODES_OF_TYPES["empty"])
GREY = 5
WALL = pack_cell(CODES_OF_TYPES["wall"], GREY)


def room_templates(room: RoomPlan) -> list[int]:
    """The room table, row by row: sizes by width, then height."""
    (low_width, high_width), (low_height, high_height) = room.width, room.height
    return [
        word
        for width in range(low_width, high_width + 1)
        for height in range(low_height, high_height + 1)
        for word in _template(room, width, height)
    ]


def _template(room: RoomPlan, width: int, height: int) -> list[int]:
    columns, rows = room.canvas
    cells = [[EMPTY] * columns for _ in range(rows)]
    solid = [(1 << columns) - 1] * rows
    floor, opaque = [0] * rows, [0] * rows
    for x, y in product(range(width), range(height)):
        if x in (0, width - 1) or y in (0, height - 1):
            cells[y][x] = WALL
            opaque[y] |= 1 << x
        else:
            solid[y] &= ~(1 << x)
            floor[y] |= 1 << x
    for kind, region, _span in room.build:
        for x, y in interior_cells(region, (width, height)):
            _build(kind, x, y, cells, solid, floor, opaque)
    columns_too = [sum((row >> x & 1) << y for y, row in enumerate(opaque)) for x in range(columns)]
    return [*(cell for row in cells for cell in row), WALL, *solid, *floor, *opaque, *columns_too]


def _build(
    kind: ObjectType,
    x: int,
    y: int,
    cells: list[list[int]],
    solid: list[int],
    floor: list[int],
    opaque: list[int],
) -> None:
    shown = kind.shown.get(kind.initial, (kind.initial, 0))
    cells[y][x] = pack_cell(kind.code, kind.color, *shown)
    floor[y] &= ~(1 << x)
    for rows, here in (
        (solid, kind.initial not in kind.walkable),
        (opaque, kind.initial not in kind.transparent),
    ):
        rows[y] = rows[y] | 1 << x if here else rows[y] & ~(1 << x)
