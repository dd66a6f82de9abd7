"""Shortest paths on canvases of at most 64 cells, where a set of cells is one word: bit y * width + x."""

from typing import Final

import numpy as np

from socialai_dsl.engine.boards import npcs_are_hidden, solid_line
from socialai_dsl.engine.entities import field, is_present, preferred
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import AGENT, NO_PATH, Row
from socialai_dsl.program import Field, Header

MOST_CELLS: Final = 64
_NONE = np.uint64(0)
_ONE = np.uint64(1)


@inline
def find_way(row: Row, mover: int, target: int, beside: bool) -> int:
    """The result of `paths.find_way` for the cell of this number, if the mover is in the room and not there already."""
    width = np.uint64(row.program[Header.CANVAS_WIDTH])
    first_column = _first_column(row)
    free = _find_free(row, mover)
    start = _cell_of(row, mover)
    near = _neighbours(start, width, first_column)
    front = _ONE << np.uint64(target)
    if beside:
        front = _neighbours(front, width, first_column) & free
    seen = _NONE
    while front & near == _NONE:
        seen |= front
        front = _neighbours(front, width, first_column) & free & ~seen
        if front == _NONE:
            return NO_PATH
    good = front & near
    ways = np.int64(good & (start << _ONE) != _NONE)
    ways += 2 * (good & (start << width) != _NONE)
    ways += 4 * (good & (start >> _ONE) != _NONE)
    ways += 8 * (good & (start >> width) != _NONE)
    return preferred(row, mover, ways)


@inline
def _neighbours(cells: np.uint64, width: np.uint64, first_column: np.uint64) -> np.uint64:
    """The cells next to those of a set; below the canvas there may be some that are none."""
    last_column = first_column << (width - _ONE)
    along = ((cells & ~last_column) << _ONE) | ((cells & ~first_column) >> _ONE)
    return along | (cells << width) | (cells >> width)


@inline
def _first_column(row: Row) -> np.uint64:
    width = np.uint64(row.program[Header.CANVAS_WIDTH])
    column = _NONE
    for _ in range(row.program[Header.CANVAS_HEIGHT]):
        column = (column << width) | _ONE
    return column


@inline
def _cell_of(row: Row, entity: int) -> np.uint64:
    place = field(row, entity, Field.Y) * row.program[Header.CANVAS_WIDTH] + field(row, entity, Field.X)
    return _ONE << np.uint64(place)


@inline
def _find_free(row: Row, mover: int) -> np.uint64:
    """The cells that `mover` could stand on."""
    width = row.program[Header.CANVAS_WIDTH]
    full = (_ONE << np.uint64(width)) - _ONE
    free = _NONE
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        line = ~np.uint64(row.board[solid_line(row, y)]) & full
        free |= line << np.uint64(y * width)
    if mover > 0 or not npcs_are_hidden(row):
        for npc in range(1, row.program[Header.NPCS] + 1):
            if npc != mover and is_present(row, npc):
                free &= ~_cell_of(row, npc)
    if mover > 0 and is_present(row, AGENT):
        free &= ~_cell_of(row, AGENT)
    if row.program[Header.DEADLY] != 0:
        free &= ~_deadly_cells(row)
    return free


@inline
def _deadly_cells(row: Row) -> np.uint64:
    mask = row.program[Header.DEADLY]
    deadly = _NONE
    for cell in range(row.program[Header.CANVAS_WIDTH] * row.program[Header.CANVAS_HEIGHT]):
        code = row.board[cell] & 0xFF
        if code < 32 and (mask >> code) & 1 == 1:
            deadly |= _ONE << np.uint64(cell)
    return deadly
