"""Shortest paths by flooding sets of cells from the goal, one layer at a time; bounded by the size of the room."""

import numpy as np

from socialai_dsl.engine import small_paths
from socialai_dsl.engine.boards import is_deadly, is_solid, npcs_are_hidden, room_table, solid_line
from socialai_dsl.engine.entities import field, is_at, is_present, npc_at, preferred, quadrant, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.operands import draw_below
from socialai_dsl.engine.sets import add_cell, clear, drop_cell, fill_next_to, get_line, has_cell, set_line
from socialai_dsl.engine.state import AGENT, FREE, FRONT, NO_CELL, NO_PATH, ONE, SEEN, STILL, ZERO, Row
from socialai_dsl.engine.whereabouts import distance, is_somewhere, x_of, y_of
from socialai_dsl.program import Body, Field, Header

_SIDES = np.int64(2)

_ROUND = 16
"""Turns of a search after which the mover looks around again, and prefers the other side."""

_LOOKS = 3
"""Quarter turns with which it has looked in all directions."""

_KEPT = np.int64(2)
"""Free cells that it leaves before it turns, in the first round: from there it sees as far as the wall."""


@outline
def find_way(row: Row, mover: int, target: int, beside: bool) -> int:
    """Direction of the next cell of a shortest path to the cell of `target`, or to a free cell `beside` it.

    NO_PATH if there is none, or if the mover is there already. `preferred` chooses among equally good cells. The target
    may be a cell itself.
    """
    stay_outline()
    if mover >= NO_CELL or not (is_present(row, mover) and is_somewhere(row, target)):
        return NO_PATH
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    x = x_of(row, target)
    y = y_of(row, target)
    if x >= width or y >= height or distance(row, mover, target) == (1 if beside else 0):
        return NO_PATH
    if width * height <= small_paths.MOST_CELLS:
        return small_paths.find_way(row, mover, y * width + x, beside)
    _find_free(row, mover)
    if beside:
        fill_next_to(row, FRONT, x, y)
        for line in range(height):
            set_line(row, FRONT, line, get_line(row, FRONT, line) & get_line(row, FREE, line))
    else:
        clear(row, FRONT)
        add_cell(row, FRONT, x, y)
    return _first_direction(row, mover)


@inline
def _find_free(row: Row, mover: int) -> None:
    """Fill the board FREE with the cells that `mover` could stand on."""
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    full = (np.int64(1) << width) - 1
    for y in range(height):
        set_line(row, FREE, y, ~row.board[solid_line(row, y)] & full)
    if mover > 0 or not npcs_are_hidden(row):
        for npc in range(1, row.program[Header.NPCS] + 1):
            if npc != mover and is_present(row, npc):
                drop_cell(row, FREE, field(row, npc, Field.X), field(row, npc, Field.Y))
    if mover > 0 and is_present(row, AGENT):
        drop_cell(row, FREE, field(row, AGENT, Field.X), field(row, AGENT, Field.Y))
    if row.program[Header.DEADLY] != 0:
        for y in range(height):
            for x in range(width):
                if is_deadly(row, x, y):
                    drop_cell(row, FREE, x, y)


@inline
def _first_direction(row: Row, mover: int) -> int:
    """Direction of the next cell from `mover` to the set FRONT through FREE, or NO_PATH. Destroys FRONT."""
    x = field(row, mover, Field.X)
    y = field(row, mover, Field.Y)
    clear(row, SEEN)
    while True:
        right = has_cell(row, FRONT, x + 1, y)
        down = has_cell(row, FRONT, x, y + 1)
        left = has_cell(row, FRONT, x - 1, y)
        up = has_cell(row, FRONT, x, y - 1)
        if right or down or left or up:
            return preferred(row, mover, right + 2 * down + 4 * left + 8 * up)
        if not _grow(row):
            return NO_PATH


@inline
def _grow(row: Row) -> bool:
    """Let FRONT be the free neighbours of its cells that were not in it before; whether there are any."""
    height = row.program[Header.CANVAS_HEIGHT]
    above = 0
    any_grown = 0
    for y in range(height):
        here = get_line(row, FRONT, y)
        under = get_line(row, FRONT, y + 1) if y + 1 < height else 0
        known = get_line(row, SEEN, y) | here
        grown = (here | here << 1 | here >> 1 | above | under) & get_line(row, FREE, y) & ~known
        set_line(row, SEEN, y, known)
        set_line(row, FRONT, y, grown)
        above = here
        any_grown |= grown
    return any_grown != 0


@outline
def explore(row: Row, mover: int, turn: int) -> int:
    """The body action in a turn of a search, the first of which is 0.

    It depends on cells that the mover has in view alone: on those straight ahead and beside it.
    """
    stay_outline()
    if not is_present(row, mover):
        return STILL
    if turn % _ROUND < _LOOKS:
        return np.int64(Body.LEFT)
    facing = field(row, mover, Field.DIR)
    kept = _KEPT if turn < _ROUND else ZERO
    if _walks(row, mover, facing, kept + 1):
        return np.int64(Body.FORWARD)
    left = _walks(row, mover, facing - 1 & 3, ONE)
    right = _walks(row, mover, facing + 1 & 3, ONE)
    if left == right:
        left = turn // _ROUND % 2 == 0
    return np.int64(Body.LEFT) if left else np.int64(Body.RIGHT)


@inline
def _walks(row: Row, mover: int, direction: int, cells: int) -> bool:
    """Whether the next `cells` cells in a direction are floor that a mover could walk on now."""
    height = row.program[Header.CANVAS_HEIGHT]
    floor = room_table(row) + row.program[Header.CANVAS_WIDTH] * height + 1 + height
    for k in range(1, cells + 1):
        x = field(row, mover, Field.X) + k * step_x(direction)
        y = field(row, mover, Field.Y) + k * step_y(direction)
        if is_solid(row, x, y) or (row.program[floor + y] >> x) & 1 == 0 or is_deadly(row, x, y):
            return False
        if (mover > 0 or not npcs_are_hidden(row)) and npc_at(row, x, y) > 0:
            return False
        if mover > 0 and is_at(row, AGENT, x, y):
            return False
    return True


@outline
def face(row: Row, mover: int, thing: int, site: int) -> int:
    """The quarter turn towards a thing, none if that is not in the room; from out of the room it is down."""
    stay_outline()
    if not is_somewhere(row, thing):
        return STILL
    x = field(row, mover, Field.X)
    y = field(row, mover, Field.Y)
    wanted = quadrant(x_of(row, thing) - x, y_of(row, thing) - y) if is_present(row, mover) else ONE
    return turn_towards(row, mover, wanted, site)


@inline
def turn_towards(row: Row, mover: int, wanted: int, site: int) -> int:
    """The quarter turn towards a direction; if it lies behind, the agent turns left and an NPC draws at a site."""
    turn = (wanted - field(row, mover, Field.DIR)) & 3
    if turn == 0:
        return STILL
    if turn == 2 and mover != AGENT:
        return Body.LEFT + draw_below(row, site, _SIDES)
    return np.int64(Body.RIGHT) if turn == 1 else np.int64(Body.LEFT)
