"""Occlusion: the usual shadow casting of grid-worlds, row by row away from the viewer.

A row of a view is a word, bit 0 its leftmost cell. Light that reaches a cell one can look through goes on along the row
and lights the three cells before it in the next row.
"""

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.boards import is_opaque, note_opaque, opaque_line
from socialai_dsl.engine.entities import step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import ONE, RESETTING, ZERO, Row
from socialai_dsl.program import VIEW, Header, Register

_HALF = VIEW // 2
_ROW = np.int64((1 << VIEW) - 1)
_BLOCKED = _ROW << VIEW


def _onward() -> NDArray[np.uint8]:
    """Where light goes on to, (16384,): by the opaque cells of a row << 7 | those that it reaches."""
    through = ~(np.arange(1 << 2 * VIEW) >> VIEW) & _ROW
    passed = np.arange(1 << 2 * VIEW) & through
    for _ in range(VIEW):
        passed |= (passed << 1 | passed >> 1) & through
    return ((passed | passed << 1 | passed >> 1) & _ROW).astype(np.uint8)


def _spread() -> NDArray[np.uint64]:
    """The cells of a row of a view as bits of a picture's last row, (256,): bit 7 i for image[i, 0].

    By the cells, bit 0 the leftmost; from 128 on bit 0 is the rightmost.
    """
    cell = np.arange(VIEW)
    shown = np.uint64(1) << np.stack([VIEW * cell, VIEW * cell[::-1]]).astype(np.uint64)
    chosen = np.arange(1 << VIEW)[:, None] >> cell & 1
    return (chosen.astype(np.uint64) @ shown.T).T.ravel().copy()


_ONWARD = _onward()
_SPREAD = _spread()
_BYTES = np.uint64(0x00FF00FF00FF00FF)
_PAIRS = np.uint64(0x0000FFFF0000FFFF)


@inline
def look_around(row: Row) -> None:
    """Prepare questions about opaque and lit cells: while reset code runs nothing is drawn yet."""
    if row.registers[Register.ENDED] == RESETTING:
        note_opaque(row)


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
        through |= np.int64(not is_opaque(row, x + (i - half) * right_x, y + (i - half) * right_y)) << i
    passed = lit & through
    before = ZERO
    while passed != before:
        before = passed
        passed |= ((passed << 1) | (passed >> 1)) & through
    ahead = _beside(passed) & ((ONE << (2 * half + 1)) - 1)
    return lit | ahead | ahead << 32


@inline
def _beside(cells: int) -> int:
    """These cells of a row and their neighbours."""
    return cells | cells << 1 | cells >> 1


@outline
def is_lit(row: Row, x: int, y: int, direction: int, half: int, ahead: int, right: int) -> bool:
    """Whether one who stands at (x, y) and looks in a direction has light from the cell so far ahead and to the right.

    That cell must lie in the view, which has `half` cells to each side of the middle.
    """
    stay_outline()
    look_around(row)
    if half == _HALF:
        return _is_lit_in_picture(row, x, y, direction, ahead, right)
    lit = ONE << half
    for _ in range(ahead):
        lit = light_next(row, x, y, direction, half, lit) >> 32
        x += step_x(direction)
        y += step_y(direction)
    lit = light_next(row, x, y, direction, half, lit)
    return (lit >> (right + half)) & 1 == 1


@inline
def _is_lit_in_picture(row: Row, x: int, y: int, direction: int, ahead: int, right: int) -> bool:
    """The same with the whole view in one word."""
    opaque = _opaque_in_view(row, x, y, direction)
    reached = ONE << _HALF
    for i in range(ahead):
        reached = _onward_from(opaque, i, reached)
    reached |= _onward_from(opaque, ahead, reached)
    place = _HALF - right if _is_mirrored(direction) == 1 else _HALF + right
    return (reached >> place) & 1 == 1


@outline
def lit_cells(row: Row, x: int, y: int, direction: int) -> np.uint64:
    """The cells of the agent's picture that light reaches it from: bit 7 i + j for image[i, j].

    The same as `light_next` row by row, with the whole view in one word. The room must be drawn.
    """
    stay_outline()
    opaque = _opaque_in_view(row, x, y, direction)
    mirrored = _is_mirrored(direction) << VIEW
    reached = ONE << _HALF
    lit = np.uint64(0)
    for ahead in range(VIEW):
        onward = _onward_from(opaque, ahead, reached)
        lit |= _SPREAD[mirrored | reached | onward] << np.uint64(VIEW - 1 - ahead)
        reached = onward
    return lit


@inline
def _onward_from(opaque: np.uint64, ahead: int, reached: int) -> int:
    """The cells that light goes on to from those that it reaches in a row of the view."""
    # One row waits for the other, so the cells that are reached come last into the index.
    blocked = np.int64(opaque >> np.uint64(8 * ahead)) << VIEW & _BLOCKED
    return np.int64(_ONWARD[blocked + reached])


@inline
def _is_mirrored(direction: int) -> int:
    """1 if the columns of the view of `_opaque_in_view` run from right to left, as when looking down or left."""
    return (direction ^ (direction >> 1)) & 1


@inline
def _opaque_in_view(row: Row, x: int, y: int, direction: int) -> np.uint64:
    """Where one cannot look through in the view of the agent's size: a byte for each row, the nearest the lowest.

    There are no branches: they would depend on positions and be mispredicted. Cells off the canvas are opaque.
    """
    height = row.program[Header.CANVAS_HEIGHT]
    top = y - _HALF * (1 - step_y(direction))
    left = x - _HALF * (1 - step_x(direction))
    # Rows of the view are rows of the room when looking down or up, else its columns, which lie behind its rows.
    along = 1 - (direction & 1)
    turned = (top ^ left) & -along
    wider = (row.program[Header.CANVAS_WIDTH] ^ height) & -along
    first = opaque_line(row, along * height)
    beyond = np.int64(-1) << (row.program[Header.CANVAS_WIDTH] ^ wider)
    opaque = _opaque_lines(row, first, height ^ wider, top ^ turned, beyond, left ^ turned)
    return _chosen(direction >> 1, _swapped(opaque), opaque)  # from lines of the room to rows ahead


@inline
def _opaque_lines(row: Row, first: int, lines: int, top: int, beyond: int, left: int) -> np.uint64:
    """The lines of the room that such a view has, a byte for each.

    Line 0 of the room is number `first` of the board, bit k of a line its cell k, and the view begins at cell `left` of
    line `top`. What is off the canvas is opaque: lines from `lines` on, cells whose bit in `beyond` is set, and
    whatever comes before.
    """
    opaque = np.uint64(0)
    for r in range(VIEW):
        inside = np.int64(top + r >= 0) & np.int64(top + r < lines)
        line = row.board[first + (top + r) * inside] | beyond | (inside - 1)
        opaque |= np.uint64((((line << VIEW) | _ROW) >> (left + VIEW)) & _ROW) << np.uint64(8 * r)
    return opaque


@inline
def _chosen(which: int, if_one: np.uint64, if_zero: np.uint64) -> np.uint64:
    """One of two words by a bit, without a branch."""
    return if_zero ^ ((if_zero ^ if_one) & (np.uint64(0) - np.uint64(which)))


@inline
def _swapped(bits: np.uint64) -> np.uint64:
    """The seven lower bytes in the opposite order."""
    bits = ((bits >> np.uint64(8)) & _BYTES) | ((bits & _BYTES) << np.uint64(8))
    bits = ((bits >> np.uint64(16)) & _PAIRS) | ((bits & _PAIRS) << np.uint64(16))
    return ((bits >> np.uint64(32)) | (bits << np.uint64(32))) >> np.uint64(8)
