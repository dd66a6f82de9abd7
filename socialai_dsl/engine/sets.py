"""Sets of cells on scratch boards: one 32-bit word for each line of the room, bit x of word y is the cell (x, y)."""

import numpy as np

from socialai_dsl.engine.bits import count_bits
from socialai_dsl.engine.entities import step_x, step_y
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import ZERO, Row
from socialai_dsl.program import MAX_SIDE, Header


@inline
def get_line(row: Row, board: int, y: int) -> int:
    """One line of a board."""
    return row.sets[board * MAX_SIDE + y]


@inline
def set_line(row: Row, board: int, y: int, cells: int) -> None:
    """Write one line of a board."""
    row.sets[board * MAX_SIDE + y] = cells


@inline
def has_cell(row: Row, board: int, x: int, y: int) -> bool:
    """Whether (x, y) is on the canvas and in the set."""
    on_canvas = 0 <= x < row.program[Header.CANVAS_WIDTH] and 0 <= y < row.program[Header.CANVAS_HEIGHT]
    return on_canvas and (get_line(row, board, y) >> x) & 1 == 1


@inline
def add_cell(row: Row, board: int, x: int, y: int) -> None:
    """Put (x, y) into the set if it is on the canvas."""
    if 0 <= x < row.program[Header.CANVAS_WIDTH] and 0 <= y < row.program[Header.CANVAS_HEIGHT]:
        set_line(row, board, y, get_line(row, board, y) | np.int64(1) << x)


@inline
def drop_cell(row: Row, board: int, x: int, y: int) -> None:
    """Take (x, y) out of the set."""
    if 0 <= x < row.program[Header.CANVAS_WIDTH] and 0 <= y < row.program[Header.CANVAS_HEIGHT]:
        set_line(row, board, y, get_line(row, board, y) & ~(np.int64(1) << x))


@inline
def clear(row: Row, board: int) -> None:
    """Make the set empty."""
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        set_line(row, board, y, ZERO)


@inline
def count_cells(row: Row, board: int) -> int:
    """How many cells the set has."""
    total = 0
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        total += count_bits(get_line(row, board, y))
    return total


@inline
def fill_next_to(row: Row, board: int, x: int, y: int) -> None:
    """Let the set be the cells at distance 1 from (x, y)."""
    clear(row, board)
    for direction in range(4):
        add_cell(row, board, x + step_x(direction), y + step_y(direction))
