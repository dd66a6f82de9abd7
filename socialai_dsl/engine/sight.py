"""Lines of sight: view squares, and opaque cells between two cells. Bodies are never opaque."""

import numpy as np

from socialai_dsl.engine.boards import is_opaque
from socialai_dsl.engine.entities import column, sign, step_x, step_y
from socialai_dsl.engine.jit import outline, stay_outline
from socialai_dsl.engine.shadows import is_lit, look_around
from socialai_dsl.engine.state import NO_CELL, Row
from socialai_dsl.engine.whereabouts import is_somewhere, x_of, y_of
from socialai_dsl.program import EntityColumn, Flag, Header


@outline
def is_in_view(row: Row, viewer: int, target: int, direction: int) -> bool:
    """Whether an entity would have a thing in its view square if it faced this direction.

    The viewer is in the middle of the near edge of the square, and its own row belongs to it.
    """
    stay_outline()
    if viewer >= NO_CELL or not (is_somewhere(row, viewer) and is_somewhere(row, target)):
        return np.bool_(False)
    direction &= 3
    x = x_of(row, viewer)
    y = y_of(row, viewer)
    dx = x_of(row, target) - x
    dy = y_of(row, target) - y
    ahead = dx * step_x(direction) + dy * step_y(direction)
    right = dy * step_x(direction) - dx * step_y(direction)
    side = column(row, viewer, EntityColumn.VIEW)
    if not (0 <= ahead < side and abs(right) <= side // 2):
        return np.bool_(False)
    return row.program[Header.FLAGS] & Flag.OCCLUSION == 0 or is_lit(
        row, x, y, direction, side // 2, ahead, right
    )


@outline
def is_unobstructed(row: Row, x: int, y: int, dx: int, dy: int) -> bool:
    """Whether nothing opaque lies strictly between (x, y) and the cell dx, dy away in its row or column."""
    stay_outline()
    look_around(row)
    step_right = sign(dx)
    step_down = sign(dy)
    for _ in range(abs(dx) + abs(dy) - 1):
        x += step_right
        y += step_down
        if is_opaque(row, x, y):
            return np.bool_(False)
    return np.bool_(True)
