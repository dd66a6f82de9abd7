"""The interpreter: runs one piece of code on one environment. It raises nothing, since programs are proven first."""

import numpy as np

from socialai_dsl.engine import paths
from socialai_dsl.engine.bits import count_bits, lowest_bit, nth_bit
from socialai_dsl.engine.boards import draw_entity
from socialai_dsl.engine.conditions import compares, holds, is_away
from socialai_dsl.engine.entities import field, quadrant, set_field
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.operands import assign, draw_action, draw_below, draw_other, value
from socialai_dsl.engine.places import next_cell, place
from socialai_dsl.engine.pushing import put_on
from socialai_dsl.engine.sets import drop_cell
from socialai_dsl.engine.sight import is_in_view
from socialai_dsl.engine.speech import first_heard
from socialai_dsl.engine.state import NO_PATH, NOTHING, ONE, RESETTING, STILL, ZERO, Row
from socialai_dsl.engine.whereabouts import attribute, cell_beside, cell_of, is_somewhere, nearest, x_of, y_of
from socialai_dsl.program import (
    CELL,
    CLASS_BITS,
    Body,
    Field,
    FrameColumn,
    Header,
    Op,
    OpClass,
    Register,
)

_NO_CELL = -1


@inline
def _compute(row: Row, op: int, a: int, b: int, c: int) -> None:
    """Instructions that write a value."""
    result = value(row, b)
    if op == Op.LOAD:
        pass
    elif op <= Op.MAX:
        result = _combine(op, result, value(row, c))
    elif op == Op.DISTANCE or op == Op.QUADRANT:
        result = _measure(row, op, result, value(row, c))
    elif op == Op.NEAREST:
        result = nearest(row, result, c >> 8, c & 255)
    elif op == Op.FIELD:
        result = attribute(row, result, c)
    elif op == Op.DRAW:
        result = draw_below(row, c, result)
    elif op == Op.DRAW_OTHER:
        result = draw_other(row, c, result)
    elif op == Op.SEES:
        result = np.int64(is_in_view(row, result, value(row, c), value(row, a)))
    elif op == Op.CELL_OF:
        result = cell_of(row, result)
    elif op == Op.CELL_BESIDE:
        result = cell_beside(row, result, value(row, c))
    elif op == Op.READ_AT:
        result = np.int64(row.registers[b + value(row, c)])
    elif op >= Op.HEARD_FROM:
        result = first_heard(row, b, c, op - Op.HEARD_FROM + 1)
    elif op == Op.SET_BIT:
        result = value(row, a) | (np.int64(1) << (result & 63))
    else:
        result = _bits(row, op, result, c)
    assign(row, a, result)


@inline
def _measure(row: Row, op: int, a: int, b: int) -> int:
    """Numbers between two entities or cells; to and from what is not in the room it is far, and that way is down."""
    if not (is_somewhere(row, a) and is_somewhere(row, b)):
        far = row.registers[Register.WIDTH] + row.registers[Register.HEIGHT]
        return np.int64(far) if op == Op.DISTANCE else ONE
    dx = x_of(row, b) - x_of(row, a)
    dy = y_of(row, b) - y_of(row, a)
    return abs(dx) + abs(dy) if op == Op.DISTANCE else quadrant(dx, dy)


@inline
def _combine(op: int, left: int, right: int) -> int:
    if op == Op.ADD:
        return left + right
    if op == Op.SUB:
        return left - right
    if op == Op.MUL:
        return left * right
    if op == Op.MIN:
        return left if left < right else right
    if op == Op.MAX:
        return left if left > right else right
    if right == 0:
        return 0
    if right == -1:  # of the least number the processor refuses to divide
        return 0 - left if op == Op.DIV else 0
    return left // right if op == Op.DIV else left % right


@inline
def _bits(row: Row, op: int, word: int, site: int) -> int:
    """Numbers as sets of bits. A set has at most 32 members."""
    if op == Op.ABS:
        return abs(word)
    word &= 0xFFFFFFFF
    if op == Op.COUNT_BITS:
        return count_bits(word)
    if word == 0:
        return 0
    if op == Op.LOWEST_BIT:
        return lowest_bit(word)
    return nth_bit(word, draw_below(row, site, count_bits(word)))


@inline
def _say(row: Row, line: int) -> None:
    """Say a line, unless something is said already."""
    if row.registers[Register.SAID_LINE] == 0:
        row.registers[Register.SAID_LINE] = value(row, line) + 1


@inline
def _go(row: Row, number: int, state: int) -> None:
    """Let a frame enter a state."""
    frame = row.program[Header.FRAME_AT] + FrameColumn.COLUMNS * number
    row.registers[row.program[frame + FrameColumn.STATE]] = state
    row.registers[row.program[frame + FrameColumn.CLOCK]] = 0


@inline
def answer(row: Row, counter: int, line: int, goal: int) -> None:
    """All that most rules do; see `Op.ANSWER`."""
    row.counters[counter] += 1
    _say(row, line)
    if goal != 0:
        _go(row, goal >> 8, (goal & 255) - 1)


@inline
def _effect(row: Row, op: int, a: int, b: int, c: int) -> None:
    """Instructions that change the world."""
    registers = row.registers
    if op == Op.ANSWER:
        answer(row, a, b, c)
    elif op == Op.SAY:
        _say(row, b)
    elif op == Op.GOTO:
        _go(row, a, b)
    elif op == Op.COUNT:
        row.counters[a] += 1
    elif op == Op.END:
        registers[Register.OUTCOME] = a
        registers[Register.PERCENT] = b
    elif op == Op.PLACE or op == Op.REWARD or op == Op.END_GRADED or op == Op.STORE_AT:
        _rare_effect(row, op, a, b, c)
    else:
        entity = value(row, a)
        if op == Op.SET_FIELD:
            set_field(row, entity, b, value(row, c))
        else:
            name = Field.STATUS if op == Op.BECOME else Field.GONE
            wanted = value(row, b) if op == Op.BECOME else ONE
            if field(row, entity, name) != wanted:
                registers[Register.CHANGED] = 1
                set_field(row, entity, name, wanted)
        if registers[Register.ENDED] != RESETTING:
            draw_entity(row, entity)


@outline
def _rare_effect(row: Row, op: int, a: int, b: int, c: int) -> None:
    stay_outline()
    if op == Op.STORE_AT:
        assign(row, b + value(row, c), value(row, a))
    elif op == Op.PLACE:
        put_on(row, value(row, a), value(row, b))
    elif op == Op.REWARD:
        row.registers[Register.BONUS] += value(row, a)
    else:
        row.registers[Register.OUTCOME] = a
        row.registers[Register.PERCENT] = max(0, min(value(row, b), 100))


@inline
def _choose(row: Row, op: int, a: int, b: int, c: int) -> int:
    """Instructions that choose the body action of the entity on turn."""
    if op == Op.BODY:
        return value(row, a)
    if op == Op.CHOOSE:
        return draw_action(row, a, b, c)
    mover = value(row, a)
    target = value(row, b)
    if op == Op.FACE:
        return paths.face(row, mover, target, c)
    if op == Op.POINT:
        set_field(row, mover, Field.POINTING, target if target >= CELL else 1 + (target & 3))
        return np.int64(Body.POINT)
    if op == Op.TURN_TO:
        return paths.turn_towards(row, mover, target, c)
    if op == Op.EXPLORE:
        return paths.explore(row, mover, target)
    way = paths.find_way(row, mover, target, op == Op.GO_NEXT_TO)
    if way == NO_PATH:
        return STILL
    if way == field(row, mover, Field.DIR):
        return np.int64(Body.FORWARD)
    return paths.turn_towards(row, mover, way, c)


@inline
def past_tests(row: Row, pc: int) -> int:
    """Fast path: evaluates the commonest tests that code begins with outside of the interpreter; 0 if it has ended."""
    start = row.program[Header.CODE_AT]
    code = start + 4 * pc
    op = row.program[code]
    while (op >= Op.IF_EQ and op <= Op.IF_LE) or op == Op.IF_SAME_CELL or op == Op.IF_NEXT_TO:
        left = value(row, row.program[code + 1])
        right = value(row, row.program[code + 2])
        if op <= Op.IF_LE:
            does_hold = compares(op, left, right)
        else:
            does_hold = is_away(row, left, right, np.int64(op == Op.IF_NEXT_TO))
        if not does_hold:
            code += 4 * row.program[code + 3]
        code += 4
        op = row.program[code]
    return ZERO if op == Op.HALT else (code - start) >> 2


@outline
def run(row: Row, pc: int) -> None:
    """Run the code at `pc` to its `HALT`. Skips go forward and `EACH_CELL` counts cells, so it ends."""
    stay_outline()
    start = row.program[Header.CODE_AT]
    loop = 0  # pc of the first instruction in the loop
    loop_board = 0
    loop_target = 0
    cell = _NO_CELL
    while True:
        word = start + 4 * pc
        op = row.program[word]
        a = row.program[word + 1]
        b = row.program[word + 2]
        c = row.program[word + 3]
        pc += 1
        kind = op >> CLASS_BITS
        if kind == OpClass.TEST:
            if not holds(row, op, a, b):
                pc += c
        elif kind == OpClass.VALUE:
            _compute(row, op, a, b, c)
        elif kind == OpClass.EFFECT:
            _effect(row, op, a, b, c)
        elif kind == OpClass.ACTIVITY:
            row.registers[Register.LAST_TURN] = _choose(row, op, a, b, c)
        elif kind == OpClass.BOARD:
            place(row, op, a, b, c)
        elif op == Op.HALT:
            return
        elif op == Op.SKIP:
            pc += c
        elif op == Op.DROP_CELL:
            if cell != _NO_CELL:
                drop_cell(row, loop_board, cell & 31, cell >> 5)
        else:
            if op == Op.EACH_CELL:
                loop = pc
                loop_board = a
                loop_target = b
                cell = next_cell(row, a, NOTHING, ZERO)
                if cell == _NO_CELL:
                    pc += c
                    if row.program[start + 4 * pc] == Op.END_EACH:
                        pc += 1
            elif cell != _NO_CELL:
                cell = next_cell(row, loop_board, cell & 31, cell >> 5)
                if cell != _NO_CELL:
                    pc = loop
            if cell != _NO_CELL:
                assign(row, loop_target, cell & 31)
                assign(row, loop_target + 1, cell >> 5)
                assign(row, loop_target + 2, CELL + cell)
