"""Follows every path through the code of a program with intervals for values, one pass since skips only go forward."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from socialai_dsl.compiler.intervals import ANYTHING, Interval, Known, Ranges, clamp
from socialai_dsl.compiler.invalid import InvalidProgramError
from socialai_dsl.program import (
    BOARDS,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    TESTS,
    Field,
    FrameColumn,
    Header,
    Op,
    Program,
)

_TWO_ENTITIES = range(Op.IF_SAME_CELL, Op.IF_REACHES + 1)
_BOARD_OPS = range(Op.B_FLOOR, Op.B_COPY + 1)
_BOUNDS = 64


def verify_code(program: Program) -> None:
    """Raise InvalidProgramError unless every block that a table names is safe from its start to its HALTs."""
    _Code(program).check()


@dataclass
class _Path:
    """What is known before an instruction, and the loop it lies in (address of its END_EACH, or None)."""

    known: Known
    loop: int | None


class _Code:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.code = program.code.tolist()
        self.ranges = Ranges.of(program)
        self.entities = program.header(Header.ENTITIES)

    def check(self) -> None:
        if not self.code or self.code[0][0] != Op.HALT:
            raise InvalidProgramError("address 0 is not a HALT")
        reset = self.program.header(Header.RESET_PC)
        for pc in sorted(set(self._entries())):
            if not 0 <= pc < len(self.code):
                raise InvalidProgramError(f"an entry at {pc}, outside of the code")
            self._block(pc, boards=pc == reset)

    def _entries(self) -> Iterator[int]:
        h, words = self.program.header, self.program.words
        yield from (h(Header.RESET_PC), h(Header.SETTLE_PC), h(Header.RULES_PC))
        states = h(Header.STATES) * (1 + 2 * (h(Header.CLASSES) + 1))
        for table, size in ((Header.STATE_AT, states), (Header.OUTCOME_AT, 8 * h(Header.CLASSES))):
            yield from (int(pc) for pc in words[h(table) : h(table) + size])

    def _block(self, start: int, boards: bool) -> None:
        pending: dict[int, _Path] = {start: _Path(Known(self.ranges), None)}
        while pending:
            pc = min(pending)
            path = pending.pop(pc)
            if pc >= len(self.code):
                raise InvalidProgramError(f"the code that starts at {start} runs over the end of the table")
            for target, known, loop in self._next(pc, path, boards):
                if target <= pc:
                    raise InvalidProgramError(f"at {pc}: a jump backward to {target}")
                known_there = pending.get(target)
                if known_there is not None and known_there.loop != loop:
                    raise InvalidProgramError(f"at {pc}: a jump into or out of a loop")
                pending[target] = _Path(known.joined(known_there.known if known_there else None), loop)

    def _next(self, pc: int, path: _Path, boards: bool) -> Iterator[tuple[int, Known, int | None]]:
        op, a, b, c = self.code[pc]
        known, loop = path.known, path.loop
        if op not in Op._value2member_map_:
            raise InvalidProgramError(f"at {pc}: unknown op {op}")
        if op in _BOARD_OPS and not boards:
            raise InvalidProgramError(f"at {pc}: {Op(op).name} outside of reset code")
        if loop is not None and pc > loop:
            raise InvalidProgramError(f"at {pc}: a loop is left past its end")
        if op == Op.HALT:
            if loop is not None:
                raise InvalidProgramError(f"at {pc}: HALT inside a loop")
            return
        problem = _Instruction(self, known).problem(Op(op), a, b, c)
        if problem:
            raise InvalidProgramError(f"at {pc}, {Op(op).name} {a} {b} {c}: {problem}")
        if op == Op.SKIP or op in TESTS:
            if c < 0:
                raise InvalidProgramError(f"at {pc}: a skip of {c} goes backward")
            yield pc + 1 + c, known, loop
            if op == Op.SKIP:
                return
        if op == Op.EACH_CELL:
            loop = self._enter_loop(pc, c, loop, known)
        elif op == Op.END_EACH:
            if loop != pc:
                raise InvalidProgramError(f"at {pc}: the end of no loop")
            loop = None
        yield pc + 1, known, loop

    def _enter_loop(self, pc: int, length: int, loop: int | None, known: Known) -> int:
        """Temporaries written inside may hold anything at the start of the next round."""
        end = pc + 1 + length
        if loop is not None or length < 1 or end >= len(self.code) or self.code[end][0] != Op.END_EACH:
            raise InvalidProgramError(f"at {pc}: a loop without its own end, or inside another")
        for op, a, _, _ in self.code[pc + 1 : end]:
            if op in _WRITERS and TEMPORARY <= a < TEMPORARY + TEMPORARIES:
                known.temporaries[a - TEMPORARY] = ANYTHING
        return end


class _Instruction:
    """Checks one instruction and notes what it writes."""

    def __init__(self, code: _Code, known: Known) -> None:
        self.code, self.known = code, known
        self.program = code.program

    def problem(self, op: Op, a: int, b: int, c: int) -> str | None:
        """What is wrong with it, or None."""
        if op in _CHECKS:
            return _CHECKS[op](self, a, b, c)
        if op in _TWO_ENTITIES:
            return self.entity(a) or self.entity(b)
        if op in _ARITHMETIC:
            return self._arithmetic(op, a, b, c)
        return None

    # --- operands ---

    def value(self, operand: int, low: int = ANYTHING[0], high: int = ANYTHING[1]) -> str | None:
        interval = self.known.value(operand)
        if interval is None:
            return f"operand {operand} is nothing that can be read here"
        if interval[0] < low or interval[1] > high:
            return f"operand {operand} is {interval[0]}..{interval[1]}, not within {low}..{high}"
        return None

    def entity(self, operand: int) -> str | None:
        return self.value(operand, 0, self.code.entities - 1)

    @staticmethod
    def literal(value: int, low: int, high: int) -> str | None:
        return None if low <= value <= high else f"{value} is not within {low}..{high}"

    def pair(self, operand: int) -> str | None:
        """Two temporaries, one behind the other."""
        return self.literal(operand, TEMPORARY, TEMPORARY + TEMPORARIES - 2)

    def site(self, row: int) -> str | None:
        return self.literal(row, 0, self.program.header(Header.SITES) - 1)

    def _interval(self, operand: int) -> Interval:
        interval = self.known.value(operand)
        assert interval is not None, "internal: an operand is used before it is checked"
        return interval

    # --- values ---

    def _arithmetic(self, op: Op, a: int, b: int, c: int) -> str | None:
        problem = self.value(b) or self.value(c)
        return problem or self.known.write(a, _ARITHMETIC[op](self._interval(b), self._interval(c)))

    def load(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b) or self.known.write(a, self._interval(b))

    def absolute(self, a: int, b: int, _c: int) -> str | None:
        if problem := self.value(b):
            return problem
        low, high = self._interval(b)
        least = 0 if low <= 0 <= high else min(abs(low), abs(high))
        return self.known.write(a, (least, max(abs(low), abs(high))))

    def field(self, a: int, b: int, c: int) -> str | None:
        problem = self.entity(b) or self.literal(c, 0, ENTITY_FIELDS - 1)
        return problem or self.known.write(a, self.code.ranges.of_field(self._interval(b), c))

    def distance(self, a: int, b: int, c: int) -> str | None:
        return self.entity(b) or self.entity(c) or self.known.write(a, (0, 128))

    def quadrant(self, a: int, b: int, c: int) -> str | None:
        return self.entity(b) or self.entity(c) or self.known.write(a, (0, 3))

    def draw(self, a: int, b: int, c: int) -> str | None:
        problem = self.value(b, 1, 1 << 30) or self.site(c)
        return problem or self.known.write(a, (0, self._interval(b)[1] - 1))

    def set_bit(self, a: int, b: int, _c: int) -> str | None:
        if problem := self.value(b, 0, 62) or self.value(a, 0):
            return problem
        bits = max(self._interval(a)[1].bit_length(), self._interval(b)[1] + 1)
        return self.known.write(a, (0, (1 << bits) - 1))

    def count_bits(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b) or self.known.write(a, (0, self._interval(b)[1].bit_length()))

    def lowest_bit(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b, 0) or self.known.write(a, (0, max(0, self._interval(b)[1].bit_length() - 1)))

    def pick_bit(self, a: int, b: int, c: int) -> str | None:
        return self.site(c) or self.lowest_bit(a, b, c)

    # --- tests ---

    def compare(self, a: int, b: int, _c: int) -> str | None:
        return self.value(a) or self.value(b)

    def bit(self, a: int, b: int, _c: int) -> str | None:
        return self.value(a) or self.value(b, 0, 62)

    def unpinned(self, a: int, _b: int, _c: int) -> str | None:
        return self.literal(a, 0, self.program.header(Header.REGISTERS) - 1)

    def chance(self, a: int, b: int, _c: int) -> str | None:
        return self.literal(a, 0, 65536) or self.site(b)

    def heard(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        inboxes = range(h(Header.INBOX), h(Header.INBOX) + h(Header.FRAMES) * (1 + h(Header.INBOX_SIZE)))
        if a not in inboxes[:: 1 + h(Header.INBOX_SIZE)]:
            return f"{a} is not the first register of an inbox"
        return self.literal(b, 1, h(Header.CLASSES) - 1)

    # --- effects and activities ---

    def set_field(self, a: int, b: int, c: int) -> str | None:
        if b not in (Field.DIR, Field.COLOR, Field.POKED, Field.LAST):
            return f"field {b} is not to be set like this"
        if problem := self.entity(a) or self.value(c):
            return problem
        first, last = self._interval(a)
        return next(
            filter(
                None,
                (
                    self.known.write(FIRST_ENTITY + ENTITY_FIELDS * entity + b, self._interval(c))
                    for entity in range(first, last + 1)
                ),
            ),
            None,
        )

    def become(self, a: int, b: int, _c: int) -> str | None:
        if problem := self.entity(a):
            return problem
        first, last = self._interval(a)
        statuses = min(max(1, len(self.program.entities[entity].states)) for entity in range(first, last + 1))
        return self.value(b, 0, statuses - 1)

    def vanish(self, a: int, _b: int, _c: int) -> str | None:
        return self.entity(a)

    def say(self, a: int, b: int, _c: int) -> str | None:
        return self.entity(a) or self.value(b, 0, self.program.header(Header.LINES) - 1)

    def goto(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        if problem := self.literal(a, 0, h(Header.FRAMES) - 1):
            return problem
        at = h(Header.FRAME_AT) + FrameColumn.COLUMNS * a + FrameColumn.STATES
        return self.literal(b, 0, int(self.program.words[at]) - 1)

    def count(self, a: int, _b: int, _c: int) -> str | None:
        return self.literal(a, 0, len(self.program.rules) - 1)

    def end(self, a: int, b: int, _c: int) -> str | None:
        return self.literal(a, 0, len(self.program.outcome_table) - 3) or self.literal(b, 0, 100)

    def body(self, a: int, _b: int, _c: int) -> str | None:
        return self.value(a, 0, 7)

    def turn_to(self, a: int, b: int, c: int) -> str | None:
        return self.entity(a) or self.value(b, 0, 3) or self.site(c)

    def go(self, a: int, b: int, c: int) -> str | None:
        return self.entity(a) or self.entity(b) or self.site(c)

    # --- boards ---

    def board(self, a: int, _b: int = 0, _c: int = 0) -> str | None:
        return self.literal(a, 0, BOARDS - 1)

    def two_boards(self, a: int, b: int, _c: int) -> str | None:
        return self.board(a) or self.board(b)

    def wall(self, a: int, b: int, c: int) -> str | None:
        return self.board(a) or self.literal(b, 0, 3) or self.literal(c, 0, _BOUNDS)

    def rectangle(self, a: int, b: int, _c: int) -> str | None:
        corners = range(b, b + 4)
        return self.board(a) or next(filter(None, (self.value(t, -_BOUNDS, _BOUNDS) for t in corners)), None)

    def near_entity(self, a: int, b: int, _c: int) -> str | None:
        return self.board(a) or self.entity(b)

    def each_cell(self, a: int, b: int, _c: int) -> str | None:
        return self.board(a) or self.pair(b) or self._cell(b, 0)

    def pick_cell(self, a: int, b: int, c: int) -> str | None:
        return self.board(b) or self.pair(a) or self.site(c) or self._cell(a, -1)

    def _cell(self, pair: int, least: int) -> str | None:
        h = self.program.header
        self.known.write(pair, (least, h(Header.CANVAS_WIDTH) - 1))
        return self.known.write(pair + 1, (least, h(Header.CANVAS_HEIGHT) - 1))

    def put(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        problem = self.entity(a) or self.pair(b) or self.value(b, -1, h(Header.CANVAS_WIDTH) - 1)
        return problem or self.value(b + 1, -1, h(Header.CANVAS_HEIGHT) - 1)

    def make_room(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        low, high = h(Header.MIN_HEIGHT), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1
        if problem := self.value(a, h(Header.MIN_WIDTH), h(Header.CANVAS_WIDTH)) or self.value(b, low, high):
            return problem
        size = h(Header.CANVAS_WIDTH) * h(Header.CANVAS_HEIGHT) + 1 + 2 * h(Header.CANVAS_HEIGHT)
        templates = (self._interval(a)[1] - h(Header.MIN_WIDTH) + 1) * h(Header.HEIGHTS)
        fits = h(Header.ROOM_AT) + templates * size <= len(self.program.words)
        return None if fits else "a room without a template"


def _sum(a: Interval, b: Interval) -> Interval:
    return clamp(a[0] + b[0], a[1] + b[1])


def _difference(a: Interval, b: Interval) -> Interval:
    return clamp(a[0] - b[1], a[1] - b[0])


def _product(a: Interval, b: Interval) -> Interval:
    corners = [x * y for x in a for y in b]
    return clamp(min(corners), max(corners))


def _quotient(a: Interval, b: Interval) -> Interval:
    if b[0] > 0:
        corners = [x // y for x in a for y in b]
        return min(corners), max(corners)
    # Towards zero or beyond the divisor 0 the magnitude never grows, but floor may add one.
    most = max(abs(a[0]), abs(a[1])) + 1
    return -most, most


def _remainder(a: Interval, b: Interval) -> Interval:
    if b[0] > 0:
        return a if a[0] >= 0 and a[1] < b[0] else (0, b[1] - 1)
    most = max(abs(b[0]), abs(b[1]))
    return -most, most


def _least(a: Interval, b: Interval) -> Interval:
    return min(a[0], b[0]), min(a[1], b[1])


def _greatest(a: Interval, b: Interval) -> Interval:
    return max(a[0], b[0]), max(a[1], b[1])


_ARITHMETIC: dict[Op, Callable[[Interval, Interval], Interval]] = {
    Op.ADD: _sum,
    Op.SUB: _difference,
    Op.MUL: _product,
    Op.DIV: _quotient,
    Op.MOD: _remainder,
    Op.MIN: _least,
    Op.MAX: _greatest,
}

_CHECKS: dict[Op, Callable[[_Instruction, int, int, int], str | None]] = {
    **dict.fromkeys((Op.IF_EQ, Op.IF_NE, Op.IF_LT, Op.IF_LE), _Instruction.compare),
    Op.IF_BIT: _Instruction.bit,
    Op.IF_UNPINNED: _Instruction.unpinned,
    Op.IF_CHANCE: _Instruction.chance,
    Op.IF_HEARD: _Instruction.heard,
    Op.LOAD: _Instruction.load,
    Op.ABS: _Instruction.absolute,
    Op.FIELD: _Instruction.field,
    Op.DISTANCE: _Instruction.distance,
    Op.QUADRANT: _Instruction.quadrant,
    Op.DRAW: _Instruction.draw,
    Op.SET_BIT: _Instruction.set_bit,
    Op.COUNT_BITS: _Instruction.count_bits,
    Op.LOWEST_BIT: _Instruction.lowest_bit,
    Op.PICK_BIT: _Instruction.pick_bit,
    Op.SET_FIELD: _Instruction.set_field,
    Op.BECOME: _Instruction.become,
    Op.VANISH: _Instruction.vanish,
    Op.SAY: _Instruction.say,
    Op.GOTO: _Instruction.goto,
    Op.COUNT: _Instruction.count,
    Op.END: _Instruction.end,
    Op.BODY: _Instruction.body,
    Op.TURN_TO: _Instruction.turn_to,
    **dict.fromkeys((Op.GO_TO, Op.GO_NEXT_TO), _Instruction.go),
    Op.B_FLOOR: _Instruction.board,
    Op.B_FREE: _Instruction.board,
    Op.B_WALL: _Instruction.wall,
    Op.B_RECT: _Instruction.rectangle,
    **dict.fromkeys((Op.B_NEXT_TO, Op.B_IN_FRONT_OF), _Instruction.near_entity),
    **dict.fromkeys((Op.B_AND, Op.B_OR, Op.B_WITHOUT, Op.B_COPY), _Instruction.two_boards),
    Op.EACH_CELL: _Instruction.each_cell,
    Op.PICK_CELL: _Instruction.pick_cell,
    Op.PUT: _Instruction.put,
    Op.MAKE_ROOM: _Instruction.make_room,
}

_WRITERS = frozenset((*_ARITHMETIC, *range(Op.LOAD, Op.PICK_BIT + 1)))
