"""The position of an operand, an entity or a cell; a cell is always in the room and faces nowhere."""

import numpy as np

from socialai_dsl.engine.entities import field, is_present, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import NO_CELL, NOTHING, Row
from socialai_dsl.program import CELL, Field, Header

_FIRST_CELL = np.int64(CELL)
_FAR = 1 << 30


@inline
def is_somewhere(row: Row, thing: int) -> bool:
    """Whether it is in the room; what is in no cell (`NO_CELL`) is not."""
    if thing >= NO_CELL:
        return thing > NO_CELL
    return is_present(row, thing)


@inline
def x_of(row: Row, thing: int) -> int:
    """Its column; that of an entity which is not in the room is the last it had, -1 if none."""
    return thing & 31 if thing >= NO_CELL else field(row, thing, Field.X)


@inline
def y_of(row: Row, thing: int) -> int:
    """Its line, as `x_of`; what is in no cell is above the room."""
    return (thing - _FIRST_CELL) >> 5 if thing >= NO_CELL else field(row, thing, Field.Y)


@inline
def facing(row: Row, thing: int) -> int:
    """The direction that it faces; -1 of a cell."""
    return NOTHING if thing >= NO_CELL else field(row, thing, Field.DIR)


@inline
def attribute(row: Row, thing: int, name: int) -> int:
    """One field. X and Y are -1 for a thing outside the room; a cell has 0 in all other fields."""
    if name <= Field.Y and not is_somewhere(row, thing):
        return np.int64(NOTHING)
    if thing < NO_CELL:
        return field(row, thing, name)
    if name == Field.X:
        return x_of(row, thing)
    return y_of(row, thing) if name == Field.Y else np.int64(0)


@inline
def cell_of(row: Row, thing: int) -> int:
    """The cell that it is in, as an operand."""
    if not is_somewhere(row, thing):
        return NO_CELL
    return _FIRST_CELL + 32 * y_of(row, thing) + x_of(row, thing)


@outline
def cell_beside(row: Row, thing: int, direction: int) -> int:
    """The cell beside it in this direction, as an operand; `NO_CELL` if that is off the canvas."""
    stay_outline()
    x = x_of(row, thing) + step_x(direction & 3)
    y = y_of(row, thing) + step_y(direction & 3)
    on_canvas = 0 <= x < row.program[Header.CANVAS_WIDTH] and 0 <= y < row.program[Header.CANVAS_HEIGHT]
    if not (on_canvas and is_somewhere(row, thing)):
        return NO_CELL
    return _FIRST_CELL + 32 * y + x


@outline
def nearest(row: Row, thing: int, first: int, last: int) -> int:
    """Which of some entities in a row is nearest to a thing, ties: the first; see `Op.NEAREST`."""
    stay_outline()
    found = np.int64(NOTHING)
    if is_somewhere(row, thing):
        x = x_of(row, thing)
        y = y_of(row, thing)
        least = np.int64(_FAR)
        for entity in range(first, last + 1):
            away = abs(field(row, entity, Field.X) - x) + abs(field(row, entity, Field.Y) - y)
            if away < least and is_present(row, entity):
                least = away
                found = entity
    return found


@inline
def distance(row: Row, a: int, b: int) -> int:
    """Manhattan distance."""
    return abs(x_of(row, a) - x_of(row, b)) + abs(y_of(row, a) - y_of(row, b))
