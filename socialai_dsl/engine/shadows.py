"""What is hidden behind what: the usual shadow casting of grid-worlds, row by row away from the viewer."""

from socialai_dsl.engine.boards import is_built_opaque, type_row
from socialai_dsl.engine.entities import field, is_present, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.sets import add_cell, clear, has_cell
from socialai_dsl.engine.state import FRONT, ONE, SEEN, ZERO, Row
from socialai_dsl.program import Field, Header, TypeColumn

FURNISHED = SEEN
OPAQUE = FRONT
"""Boards of `look_around`: cells with an object, and with one that is not transparent. Paths use them too."""


@inline
def look_around(row: Row) -> None:
    """Note where objects are, and where one cannot look through them; `light_next` reads it."""
    clear(row, FURNISHED)
    clear(row, OPAQUE)
    for entity in range(row.program[Header.NPCS] + 1, row.program[Header.ENTITIES]):
        if is_present(row, entity):
            x = field(row, entity, Field.X)
            y = field(row, entity, Field.Y)
            add_cell(row, FURNISHED, x, y)
            if row.program[type_row(row, entity) + TypeColumn.TRANSPARENT] == 0:
                add_cell(row, OPAQUE, x, y)


@outline
def light_next(row: Row, x: int, y: int, direction: int, half: int, lit: int) -> int:
    """Let light go along a row of a view and on to the next.

    Args:
        row: the environment, after `look_around`.
        x: of the cell in the middle of the row.
        y: of that cell.
        direction: where the viewer looks.
        half: cells of the row to each side of the middle, at most 15.
        lit: cells of the row that are visible from the row before; bit 0 is the leftmost.

    Returns:
        The visible cells of this row in the lower 32 bits, those of the next row in the upper.
    """
    stay_outline()
    right_x = -step_y(direction)
    right_y = step_x(direction)
    through = ZERO
    for i in range(2 * half + 1):
        through |= _is_transparent(row, x + (i - half) * right_x, y + (i - half) * right_y) << i
    ahead = ZERO
    for i in range(2 * half):
        if (lit & through) >> i & 1 == 1:
            lit |= ONE << (i + 1)
            ahead |= (ONE << i) | (ONE << (i + 1))
    for i in range(2 * half, 0, -1):
        if (lit & through) >> i & 1 == 1:
            lit |= ONE << (i - 1)
            ahead |= (ONE << i) | (ONE << (i - 1))
    return lit | ahead << 32


@inline
def _is_transparent(row: Row, x: int, y: int) -> int:
    """1 if one can look through this cell, else 0; nobody can off the canvas."""
    if x < 0 or x >= row.program[Header.CANVAS_WIDTH] or y < 0 or y >= row.program[Header.CANVAS_HEIGHT]:
        return ZERO
    if has_cell(row, FURNISHED, x, y):
        return ZERO if has_cell(row, OPAQUE, x, y) else ONE
    return ZERO if is_built_opaque(row, x, y) else ONE


@outline
def is_lit(row: Row, x: int, y: int, direction: int, half: int, ahead: int, right: int) -> bool:
    """Whether one who stands at (x, y) and looks in a direction has light from the cell so far ahead and to the right.

    That cell must lie in the view, which has `half` cells to each side of the middle.
    """
    stay_outline()
    look_around(row)
    lit = ONE << half
    for _ in range(ahead):
        lit = light_next(row, x, y, direction, half, lit) >> 32
        x += step_x(direction)
        y += step_y(direction)
    lit = light_next(row, x, y, direction, half, lit)
    return (lit >> (right + half)) & 1 == 1
