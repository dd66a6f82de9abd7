"""What can be seen from where: view squares, and what stands between two cells. Bodies never stand in the way."""

import numpy as np

from socialai_dsl.engine.boards import room_table, type_row
from socialai_dsl.engine.entities import column, object_at, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import NO_CELL, Row
from socialai_dsl.engine.whereabouts import is_somewhere, x_of, y_of
from socialai_dsl.program import CODES_OF_TYPES, EntityColumn, Header, TypeColumn

_EMPTY = CODES_OF_TYPES["empty"]
_WALL = CODES_OF_TYPES["wall"]
_WITHOUT_COLOR = np.int64(0xFFFF00FF)


@outline
def is_in_view(row: Row, viewer: int, target: int, direction: int) -> bool:
    """Whether an entity would have a thing in its view square if it faced this direction.

    The viewer is in the middle of the near edge of the square, and its own row belongs to it.
    """
    stay_outline()
    if viewer >= NO_CELL or not (is_somewhere(row, viewer) and is_somewhere(row, target)):
        return np.bool_(False)
    dx = x_of(row, target) - x_of(row, viewer)
    dy = y_of(row, target) - y_of(row, viewer)
    ahead_x = step_x(direction & 3)
    ahead_y = step_y(direction & 3)
    side = column(row, viewer, EntityColumn.VIEW)
    return 0 <= dx * ahead_x + dy * ahead_y < side and abs(dx * ahead_y - dy * ahead_x) <= side // 2


@outline
def is_unobstructed(row: Row, x: int, y: int, dx: int, dy: int) -> bool:
    """Whether nothing opaque lies strictly between (x, y) and the cell dx, dy away in its row or column."""
    stay_outline()
    step_right = np.int64(dx > 0) - np.int64(dx < 0)
    step_down = np.int64(dy > 0) - np.int64(dy < 0)
    for _ in range(abs(dx) + abs(dy) - 1):
        x += step_right
        y += step_down
        if _is_opaque(row, x, y):
            return np.bool_(False)
    return np.bool_(True)


@inline
def _is_opaque(row: Row, x: int, y: int) -> bool:
    """Whether one cannot look through this cell: walls, objects that are not transparent, all off the canvas."""
    width = row.program[Header.CANVAS_WIDTH]
    if x < 0 or x >= width or y < 0 or y >= row.program[Header.CANVAS_HEIGHT]:
        return np.bool_(True)
    entity = object_at(row, x, y)
    if entity > 0:
        return row.program[type_row(row, entity) + TypeColumn.TRANSPARENT] == 0
    return _is_built_opaque(row, row.program[room_table(row) + y * width + x] & _WITHOUT_COLOR)


@inline
def _is_built_opaque(row: Row, look: int) -> bool:
    """The same for a cell of the bare room, by its look: what is built there is a type in a status."""
    if look & 0xFF == _EMPTY:
        return np.bool_(False)
    table = row.program[Header.TYPE_AT]
    for _ in range(row.program[Header.TYPE_ROWS]):
        shown = row.program[table + TypeColumn.CODE] | row.program[table + TypeColumn.STATUS] << 16
        if look == shown | row.program[table + TypeColumn.ORIENTATION] << 24:
            return row.program[table + TypeColumn.TRANSPARENT] == 0
        table += TypeColumn.COLUMNS
    return look & 0xFF == _WALL
