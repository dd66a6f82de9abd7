"""The tests of the instruction set."""

import numpy as np

from socialai_dsl.engine import rng
from socialai_dsl.engine.entities import column, is_in_front, quadrant
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.operands import draw_at, value
from socialai_dsl.engine.paths import find_way
from socialai_dsl.engine.sight import is_unobstructed
from socialai_dsl.engine.speech import is_in_inbox
from socialai_dsl.engine.state import NO_CELL, NO_PATH, Row
from socialai_dsl.engine.whereabouts import distance, facing, is_somewhere, x_of, y_of
from socialai_dsl.program import EntityColumn, Op
from socialai_dsl.widths import UNPINNED


@inline
def holds(row: Row, op: int, a: int, b: int) -> bool:
    """Whether a test holds."""
    if op == Op.IF_HEARD:
        return is_in_inbox(row, b, a)
    if op == Op.IF_UNPINNED:
        return row.pins[a] == UNPINNED
    if op == Op.IF_CHANCE:
        return rng.holds_with_chance(draw_at(row, b), a)
    left = value(row, a)
    right = value(row, b)
    return compares(op, left, right) if op <= Op.IF_BIT else _relates(row, op, left, right)


@inline
def compares(op: int, left: int, right: int) -> bool:
    """Whether a test of two numbers holds."""
    if op == Op.IF_EQ:
        return left == right
    if op == Op.IF_NE:
        return left != right
    if op == Op.IF_LT:
        return left < right
    if op == Op.IF_LE:
        return left <= right
    return 0 <= right < 63 and (left >> right) & 1 == 1


@inline
def is_away(row: Row, a: int, b: int, cells: int) -> bool:
    """Whether two entities or cells are in the room, and so far from each other."""
    return is_somewhere(row, a) and is_somewhere(row, b) and distance(row, a, b) == cells


@inline
def _relates(row: Row, op: int, a: int, b: int) -> bool:
    """Tests of two entities or cells: false unless both are in the room."""
    if not (is_somewhere(row, a) and is_somewhere(row, b)):
        return np.bool_(False)
    x = x_of(row, a)
    y = y_of(row, a)
    if op == Op.IF_IN_FRONT_OF:
        return b < NO_CELL and is_in_front(row, x, y, b)
    dx = x_of(row, b) - x
    dy = y_of(row, b) - y
    away = abs(dx) + abs(dy)
    if op == Op.IF_SAME_CELL:
        return away == 0
    if op == Op.IF_NEXT_TO:
        return away == 1
    if op == Op.IF_REACHES:
        return away <= 1 or find_way(row, a, b, np.bool_(True)) != NO_PATH
    in_line = dx == 0 or dy == 0
    if op == Op.IF_IN_LINE:
        return in_line
    if op == Op.IF_UNOBSTRUCTED:
        return in_line and is_unobstructed(row, x, y, dx, dy)
    if facing(row, a) != quadrant(dx, dy):
        return np.bool_(False)
    if op == Op.IF_FACES_TOWARD:
        return np.bool_(True)
    if op == Op.IF_FACES:
        return away == 1
    if not in_line or away == 0:
        return np.bool_(False)
    if op == Op.IF_EYE_CONTACT:
        return facing(row, b) == quadrant(-dx, -dy)
    return away < column(row, a, EntityColumn.VIEW) and is_unobstructed(row, x, y, dx, dy)
