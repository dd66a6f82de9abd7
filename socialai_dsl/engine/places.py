"""Sets of cells: choosing a cell and putting an entity there."""

import numpy as np

from socialai_dsl.engine.bits import count_bits, lowest_bit, nth_bit
from socialai_dsl.engine.boards import copy_room, draw_all, room_table
from socialai_dsl.engine.entities import field, front_direction, is_present, set_field, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.operands import draw_below, value
from socialai_dsl.engine.sets import add_cell, clear, count_cells, fill_next_to, get_line, set_line
from socialai_dsl.engine.state import NO_CELL, NOTHING, OCCUPIED, ONE, ZERO, Row
from socialai_dsl.engine.whereabouts import is_somewhere, x_of, y_of
from socialai_dsl.program import TEMPORARY, Counting, Field, Header, Op, Register, Side


@outline
def place(row: Row, op: int, a: int, b: int, c: int) -> None:
    """Run one instruction on boards."""
    stay_outline()
    if op == Op.MAKE_ROOM:
        make_room(row, value(row, a), value(row, b))
    elif op == Op.PUT:
        put(row, value(row, a), row.scratch[b - TEMPORARY], row.scratch[b - TEMPORARY + 1])
    elif op == Op.PICK_CELL:
        _pick_cell(row, a, b, c)
    elif op == Op.B_COUNT:
        row.scratch[a - TEMPORARY] = count_cells(row, b)
    elif op == Op.FIRST_CELL:
        _write_cell(row, a, next_cell(row, b, NOTHING, ZERO))
    elif op == Op.NEAREST_CELL:
        _write_cell(row, a, _nearest_cell(row, b, value(row, c)))
    elif op == Op.DRAW_ROOM:
        copy_room(row)
        if a == 1:
            draw_all(row)
    elif op == Op.B_FLOOR:
        _fill_floor(row, a)
    elif op == Op.B_RECT:
        if c == Counting.ALL:
            _fill_all(row, a)
        elif c == Counting.BUILT:
            _fill_inside(row, a)
        else:
            _fill_floor(row, a)
        _cut(row, a, b - TEMPORARY)
    elif op == Op.B_WALL:
        _fill_wall(row, a, b, c)
    elif op == Op.B_NEXT_TO:
        _fill_next_to(row, a, value(row, b))
    elif op == Op.B_IN_FRONT_OF:
        _fill_in_front_of(row, a, value(row, b))
    else:
        _combine(row, op, a, OCCUPIED if op == Op.B_FREE else b)


@inline
def _combine(row: Row, op: int, a: int, b: int) -> None:
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        one = get_line(row, a, y)
        other = get_line(row, b, y)
        if op == Op.B_AND:
            one &= other
        elif op == Op.B_OR:
            one |= other
        elif op == Op.B_COPY:
            one = other
        else:
            one &= ~other
        set_line(row, a, y, one)


@inline
def _fill_floor(row: Row, a: int) -> None:
    height = row.program[Header.CANVAS_HEIGHT]
    table = room_table(row) + row.program[Header.CANVAS_WIDTH] * height + 1 + height
    for y in range(height):
        set_line(row, a, y, row.program[table + y])


@inline
def _fill_all(row: Row, a: int) -> None:
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        set_line(row, a, y, (ONE << row.program[Header.CANVAS_WIDTH]) - 1)


@inline
def _fill_inside(row: Row, a: int) -> None:
    """All cells inside the walls, whatever is built there."""
    clear(row, a)
    columns = (np.int64(1) << (row.registers[Register.WIDTH] - 1)) - 2
    for y in range(1, row.registers[Register.HEIGHT] - 1):
        set_line(row, a, y, columns)


@inline
def _fill_wall(row: Row, a: int, side: int, margin: int) -> None:
    width = row.registers[Register.WIDTH]
    height = row.registers[Register.HEIGHT]
    clear(row, a)
    if side <= Side.BOTTOM:
        for x in range(margin, width - margin):
            add_cell(row, a, x, ZERO if side == Side.TOP else height - 1)
    else:
        for y in range(margin, height - margin):
            add_cell(row, a, ZERO if side == Side.LEFT else width - 1, y)


@inline
def _cut(row: Row, a: int, b: int) -> None:
    """Keep the cells of board a that lie in the rectangle of temporaries from b on: left, right, top, bottom."""
    left = max(row.scratch[b], 0)
    right = min(row.scratch[b + 1], row.program[Header.CANVAS_WIDTH] - 1)
    columns = 0
    if left <= right:
        columns = (np.int64(1) << (right + 1)) - (np.int64(1) << left)
    top = row.scratch[b + 2]
    bottom = row.scratch[b + 3]
    for y in range(row.program[Header.CANVAS_HEIGHT]):
        set_line(row, a, y, get_line(row, a, y) & columns if top <= y <= bottom else ZERO)


@inline
def _fill_next_to(row: Row, a: int, thing: int) -> None:
    if is_somewhere(row, thing):
        fill_next_to(row, a, x_of(row, thing), y_of(row, thing))
    else:
        clear(row, a)


@inline
def _fill_in_front_of(row: Row, a: int, entity: int) -> None:
    clear(row, a)
    if entity < NO_CELL and is_present(row, entity):
        direction = front_direction(row, entity)
        if direction >= 0:
            x = field(row, entity, Field.X) + step_x(direction)
            add_cell(row, a, x, field(row, entity, Field.Y) + step_y(direction))


@inline
def _pick_cell(row: Row, target: int, a: int, site: int) -> None:
    """Draw one cell of board a; its x and y go to the temporaries `target` and the next."""
    total = count_cells(row, a)
    x = NOTHING
    y = NOTHING
    if total > 0:
        left = draw_below(row, site, total)
        y = ZERO
        while left >= count_bits(get_line(row, a, y)):
            left -= count_bits(get_line(row, a, y))
            y += 1
        x = nth_bit(get_line(row, a, y), left)
    row.scratch[target - TEMPORARY] = x
    row.scratch[target - TEMPORARY + 1] = y


@inline
def next_cell(row: Row, a: int, x: int, y: int) -> int:
    """The first cell of board a after (x, y), row by row, as y * 32 + x; -1 if there is none."""
    x += 1
    while y < row.program[Header.CANVAS_HEIGHT]:
        line = get_line(row, a, y) >> x << x
        if line != 0:
            return y * 32 + lowest_bit(line)
        x = ZERO
        y += 1
    return NOTHING


@inline
def _nearest_cell(row: Row, a: int, thing: int) -> int:
    """The cell of board a nearest to a thing in the room, the first of equally near ones; as `next_cell`."""
    if not is_somewhere(row, thing):
        return NOTHING
    x = x_of(row, thing)
    y = y_of(row, thing)
    nearest = NOTHING
    least = NOTHING
    cell = next_cell(row, a, NOTHING, ZERO)
    while cell >= 0:
        away = abs((cell & 31) - x) + abs((cell >> 5) - y)
        if least < 0 or away < least:
            nearest = cell
            least = away
        cell = next_cell(row, a, cell & 31, cell >> 5)
    return nearest


@inline
def _write_cell(row: Row, target: int, cell: int) -> None:
    """Write x and y of a cell to the temporaries `target` and the next; -1 and -1 if it is none."""
    row.scratch[target - TEMPORARY] = cell & 31 if cell >= 0 else NOTHING
    row.scratch[target - TEMPORARY + 1] = cell >> 5


@inline
def put(row: Row, entity: int, x: int, y: int) -> None:
    """Place an entity, or leave it out of the room if x is negative."""
    set_field(row, entity, Field.X, x)
    set_field(row, entity, Field.Y, y)
    if x < 0:
        set_field(row, entity, Field.GONE, ONE)
    else:
        set_field(row, entity, Field.GONE, ZERO)
        occupy(row, entity)


@inline
def occupy(row: Row, entity: int) -> None:
    """Mark the cell of an entity as taken."""
    add_cell(row, OCCUPIED, field(row, entity, Field.X), field(row, entity, Field.Y))


@inline
def make_room(row: Row, width: int, height: int) -> None:
    """Set the size of the room and copy it bare."""
    row.registers[Register.WIDTH] = width
    row.registers[Register.HEIGHT] = height
    across = width - row.program[Header.MIN_WIDTH]
    down = height - row.program[Header.MIN_HEIGHT]
    row.registers[Register.ROOM] = across * row.program[Header.HEIGHTS] + down
    copy_room(row)
