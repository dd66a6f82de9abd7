"""The tests of the instruction set."""

import numpy as np

from socialai_dsl.engine import entities, rng
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.operands import draw_at, value
from socialai_dsl.engine.paths import reaches
from socialai_dsl.engine.speech import is_in_inbox
from socialai_dsl.engine.state import PIN_NONE, Row
from socialai_dsl.program import Field, Op


@inline
def holds(row: Row, op: int, a: int, b: int) -> bool:
    """Whether a test holds."""
    if op == Op.IF_HEARD:
        return is_in_inbox(row, b, a)
    if op == Op.IF_UNPINNED:
        return row.pins[a] == PIN_NONE
    if op == Op.IF_CHANCE:
        return rng.holds_with_chance(draw_at(row, b), a)
    left = value(row, a)
    right = value(row, b)
    return _compares(op, left, right) if op <= Op.IF_BIT else _relates(row, op, left, right)


@inline
def _compares(op: int, left: int, right: int) -> bool:
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
def _relates(row: Row, op: int, a: int, b: int) -> bool:
    """Tests of two entities: false unless both are in the room."""
    if not entities.are_present(row, a, b):
        return False
    if op == Op.IF_NEXT_TO:
        return entities.distance(row, a, b) == 1
    if op == Op.IF_SAME_CELL:
        return entities.distance(row, a, b) == 0
    if op == Op.IF_FACES:
        return entities.faces(row, a, b)
    if op == Op.IF_IN_FRONT_OF:
        return entities.is_at(row, a, entities.front_x(row, b), entities.front_y(row, b))
    if op == Op.IF_EYE_CONTACT:
        return entities.make_eye_contact(row, a, b)
    if op == Op.IF_FACES_TOWARD:
        return entities.field(row, a, Field.DIR) == entities.quadrant(row, a, b)
    if op == Op.IF_IN_LINE:
        return entities.share_line(row, a, b)
    if op == Op.IF_REACHES:
        return reaches(row, a, b)
    return np.bool_(False)
