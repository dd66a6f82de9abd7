"""What each instruction asks of its operands, and the range of what it writes."""

from __future__ import annotations

from collections.abc import Callable

from socialai_dsl.compiler.interval_arithmetic import ARITHMETIC
from socialai_dsl.compiler.intervals import ANYTHING, Interval, Known, inbox_registers
from socialai_dsl.program import (
    BOARDS,
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    MOST_CHOICES,
    TEMPORARIES,
    TEMPORARY,
    Body,
    Counting,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Program,
    room_words,
)

_TWO_PLACES = range(Op.IF_SAME_CELL, Op.IF_UNOBSTRUCTED + 1)
_BOUNDS = 64
_WHOLE_REWARD = 100
_NOWHERE = CELL - 1


def problem_of(
    instruction: tuple[Op, int, int, int],
    program: Program,
    known: Known,
    writable: frozenset[int],
    is_agents: bool = False,
) -> str | None:
    """What is wrong with an instruction where so much is known, or None; then `known` includes what it writes.

    `is_agents`: it belongs to the frame of the agent, who can do less than NPCs.
    """
    op, a, b, c = instruction
    return _Instruction(program, known, writable, is_agents).problem(op, a, b, c)


class _Instruction:
    """Checks one instruction and notes what it writes."""

    def __init__(self, program: Program, known: Known, writable: frozenset[int], is_agents: bool) -> None:
        self.program, self.known, self.writable, self.is_agents = program, known, writable, is_agents
        self.entities = program.header(Header.ENTITIES)

    def problem(self, op: Op, a: int, b: int, c: int) -> str | None:
        """What is wrong with it, or None."""
        if op in _CHECKS:
            return _CHECKS[op](self, a, b, c)
        if op in _TWO_PLACES:
            return self.place(a) or self.place(b)
        if op in ARITHMETIC:
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
        return self.value(operand, 0, self.entities - 1)

    def place(self, operand: int) -> str | None:
        """An entity, or a cell or none; never something that may be either an entity or a cell."""
        return (
            self.value(operand, _NOWHERE, self._last_cell())
            if self._is_cell(operand)
            else self.entity(operand)
        )

    def _is_cell(self, operand: int) -> bool:
        interval = self.known.value(operand)
        return interval is not None and interval[0] >= _NOWHERE

    def write(self, target: int, interval: Interval) -> str | None:
        """A temporary, or a register that this code may write."""
        if target < TEMPORARY and target not in self.writable:
            return f"writes to {target}, which is neither a temporary nor a register for it to write"
        return self.known.write(target, interval)

    @staticmethod
    def literal(value: int, low: int, high: int) -> str | None:
        return None if low <= value <= high else f"{value} is not within {low}..{high}"

    def temporaries(self, operand: int, count: int) -> str | None:
        """Temporaries one behind the other."""
        return self.literal(operand, TEMPORARY, TEMPORARY + TEMPORARIES - count)

    def site(self, row: int) -> str | None:
        return self.literal(row, 0, self.program.header(Header.SITES) - 1)

    def _interval(self, operand: int) -> Interval:
        interval = self.known.value(operand)
        assert interval is not None, "internal: an operand is used before it is checked"
        return interval

    # --- values ---

    def _arithmetic(self, op: Op, a: int, b: int, c: int) -> str | None:
        problem = self.value(b) or self.value(c)
        return problem or self.write(a, ARITHMETIC[op](self._interval(b), self._interval(c)))

    def load(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b) or self.write(a, self._interval(b))

    def absolute(self, a: int, b: int, _c: int) -> str | None:
        if problem := self.value(b):
            return problem
        low, high = self._interval(b)
        least = 0 if low <= 0 <= high else min(abs(low), abs(high))
        return self.write(a, (least, max(abs(low), abs(high))))

    def field(self, a: int, b: int, c: int) -> str | None:
        if problem := self.place(b) or self.literal(c, 0, ENTITY_FIELDS - 1):
            return problem
        if self._is_cell(b):
            return self.write(a, (-1, 31))
        return self.write(a, self.known.ranges.of_field(self._interval(b), c))

    def distance(self, a: int, b: int, c: int) -> str | None:
        return self.place(b) or self.place(c) or self.write(a, (0, 128))

    def nearest(self, a: int, b: int, c: int) -> str | None:
        first, last = c >> 8, c & 255
        problem = self.place(b) or self.literal(last, 0, self.entities - 1) or self.literal(first, 0, last)
        return problem or self.write(a, (-1, last))

    def quadrant(self, a: int, b: int, c: int) -> str | None:
        return self.place(b) or self.place(c) or self.write(a, (0, 3))

    def sees(self, a: int, b: int, c: int) -> str | None:
        """The direction is read from where the answer goes."""
        problem = self.temporaries(a, 1) or self.value(a, 0, 3) or self.entity(b) or self.place(c)
        return problem or self.write(a, (0, 1))

    def cell_of(self, a: int, b: int, _c: int) -> str | None:
        return self.place(b) or self.write(a, (_NOWHERE, self._last_cell()))

    def _last_cell(self) -> int:
        h = self.program.header
        return CELL + 32 * (h(Header.CANVAS_HEIGHT) - 1) + h(Header.CANVAS_WIDTH) - 1

    def cell_beside(self, a: int, b: int, c: int) -> str | None:
        return self.value(c, 0, 3) or self.cell_of(a, b, c)

    def heard_from(self, a: int, b: int, c: int) -> str | None:
        return self._about_heard(b, c) or self.write(a, (-1, self.program.header(Header.NPCS)))

    def heard_noun(self, a: int, b: int, c: int) -> str | None:
        return self._about_heard(b, c) or self.write(a, (-1, self.program.header(Header.NOUNS) - 1))

    def _about_heard(self, inbox: int, classes: int) -> str | None:
        h = self.program.header
        if not h(Header.FLAGS) & Flag.HEARD_BY:
            return "nobody notes who said what"
        return self.inbox(inbox) or self.literal(classes, 0, h(Header.CLASS_SETS) - 1)

    def draw(self, a: int, b: int, c: int) -> str | None:
        problem = self.value(b, 1, 1 << 30) or self.site(c)
        return problem or self.write(a, (0, self._interval(b)[1] - 1))

    def draw_other(self, a: int, b: int, c: int) -> str | None:
        first, count = c >> 16 & 255, c >> 24
        problem = self.value(b) or self.site(c & 65535) or self.literal(count, 2, 127)
        return problem or self.write(a, (first, first + count - 1))

    def set_bit(self, a: int, b: int, _c: int) -> str | None:
        if problem := self.value(b, 0, 62) or self.value(a, 0):
            return problem
        bits = max(self._interval(a)[1].bit_length(), self._interval(b)[1] + 1)
        return self.write(a, (0, (1 << bits) - 1))

    def count_bits(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b) or self.write(a, (0, self._interval(b)[1].bit_length()))

    def lowest_bit(self, a: int, b: int, _c: int) -> str | None:
        return self.value(b, 0) or self.write(a, (0, max(0, self._interval(b)[1].bit_length() - 1)))

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
        return self.inbox(a) or self.literal(b, 1, h(Header.CLASSES) - 1)

    def inbox(self, register: int) -> str | None:
        h, size = self.program.header, inbox_registers(self.program)
        inboxes = range(h(Header.INBOX), h(Header.INBOX) + h(Header.FRAMES) * size)
        return None if register in inboxes[::size] else f"{register} is not the first register of an inbox"

    # --- effects and activities ---

    def set_field(self, a: int, b: int, c: int) -> str | None:
        if b not in (Field.DIR, Field.COLOR, Field.POKED, Field.LAST, Field.POINTING, Field.INSIDE):
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

    def answer(self, a: int, b: int, c: int) -> str | None:
        problem = self.count(a, 0, 0) or self.value(b, 0, self.program.header(Header.LINES) - 1)
        return problem or (self.goto(c >> 8, (c & 255) - 1, 0) if c != 0 else None)

    def end(self, a: int, b: int, _c: int) -> str | None:
        return self.literal(a, 0, len(self.program.outcome_table) - 3) or self.literal(b, 0, 100)

    def end_graded(self, a: int, b: int, _c: int) -> str | None:
        return self.literal(a, 0, len(self.program.outcome_table) - 3) or self.value(b)

    def reward(self, a: int, _b: int, _c: int) -> str | None:
        return self.value(a, -_WHOLE_REWARD, _WHOLE_REWARD)

    def put_on(self, a: int, b: int, _c: int) -> str | None:
        return self.entity(a) or self.place(b)

    def body(self, a: int, _b: int, _c: int) -> str | None:
        if self.is_agents:
            return self.value(a, 0, Body.NONE)
        if self.known.value(a) == (Body.STOP_POINTING, Body.STOP_POINTING):
            return None
        return self.value(a, 0, Body.NONE)

    def choose(self, a: int, b: int, c: int) -> str | None:
        if problem := self.literal(b, 1, MOST_CHOICES) or self.literal(a, 0, (1 << 4 * MOST_CHOICES) - 1):
            return problem
        if any(a >> 4 * k & 15 > Body.NONE for k in range(b)):
            return f"{a} holds what is no action"
        return self.site(c)

    def point(self, a: int, b: int, _c: int) -> str | None:
        if self.is_agents:
            return "the agent cannot point"
        return self.value(a, 1, self.program.header(Header.NPCS)) or self.value(b, 0, 3)

    def turn_to(self, a: int, b: int, c: int) -> str | None:
        return self.entity(a) or self.value(b, 0, 3) or self.site(c)

    def go(self, a: int, b: int, c: int) -> str | None:
        return self.entity(a) or self.place(b) or self.site(c)

    # --- boards ---

    def board(self, a: int) -> str | None:
        """A board that is filled."""
        problem = self.literal(a, 0, BOARDS - 1)
        return problem or (None if a in self.known.boards else f"board {a} was never filled")

    def fill(self, a: int, _b: int = 0, _c: int = 0) -> str | None:
        if problem := self.literal(a, 0, BOARDS - 1):
            return problem
        self.known.boards.add(a)
        return None

    def free(self, a: int, _b: int, _c: int) -> str | None:
        return self.board(a)

    def two_boards(self, a: int, b: int, _c: int) -> str | None:
        return self.board(a) or self.board(b)

    def copy_board(self, a: int, b: int, _c: int) -> str | None:
        return self.board(b) or self.fill(a)

    def wall(self, a: int, b: int, c: int) -> str | None:
        return self.literal(b, 0, 3) or self.literal(c, 0, _BOUNDS) or self.fill(a)

    def rectangle(self, a: int, b: int, c: int) -> str | None:
        corners = range(b, b + 4)
        problem = next(filter(None, (self.value(t, -_BOUNDS, _BOUNDS) for t in corners)), None)
        return self.literal(c, 0, Counting.ALL) or self.temporaries(b, 4) or problem or self.fill(a)

    def near_place(self, a: int, b: int, _c: int) -> str | None:
        return self.place(b) or self.fill(a)

    def each_cell(self, a: int, b: int, _c: int) -> str | None:
        problem = self.board(a) or self.temporaries(b, 3) or self._cell(b, 0)
        return problem or self.write(b + 2, (CELL, self._last_cell()))

    def count_cells(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        most = h(Header.CANVAS_WIDTH) * h(Header.CANVAS_HEIGHT)
        return self.board(b) or self.temporaries(a, 1) or self.write(a, (0, most))

    def pick_cell(self, a: int, b: int, c: int) -> str | None:
        return self.site(c) or self.first_cell(a, b)

    def first_cell(self, a: int, b: int, _c: int = 0) -> str | None:
        return self.board(b) or self.temporaries(a, 2) or self._cell(a, -1)

    def nearest_cell(self, a: int, b: int, c: int) -> str | None:
        return self.place(c) or self.first_cell(a, b)

    def _cell(self, pair: int, least: int) -> str | None:
        h = self.program.header
        self.known.write(pair, (least, h(Header.CANVAS_WIDTH) - 1))
        return self.known.write(pair + 1, (least, h(Header.CANVAS_HEIGHT) - 1))

    def put(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        problem = self.entity(a) or self.temporaries(b, 2) or self.value(b, -1, h(Header.CANVAS_WIDTH) - 1)
        return problem or self.value(b + 1, -1, h(Header.CANVAS_HEIGHT) - 1)

    def make_room(self, a: int, b: int, _c: int) -> str | None:
        h = self.program.header
        low, high = h(Header.MIN_HEIGHT), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1
        if problem := self.value(a, h(Header.MIN_WIDTH), h(Header.CANVAS_WIDTH)) or self.value(b, low, high):
            return problem
        size = room_words(h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT))
        templates = (self._interval(a)[1] - h(Header.MIN_WIDTH) + 1) * h(Header.HEIGHTS)
        fits = h(Header.ROOM_AT) + templates * size <= len(self.program.words)
        self.known.has_room = True
        return None if fits else "a room without a template"

    def draw_room(self, a: int, _b: int, _c: int) -> str | None:
        return self.literal(a, 0, 1) or (None if self.known.has_room else "there is no room yet")


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
    Op.NEAREST: _Instruction.nearest,
    Op.QUADRANT: _Instruction.quadrant,
    Op.DRAW: _Instruction.draw,
    Op.DRAW_OTHER: _Instruction.draw_other,
    Op.SET_BIT: _Instruction.set_bit,
    Op.COUNT_BITS: _Instruction.count_bits,
    Op.LOWEST_BIT: _Instruction.lowest_bit,
    Op.PICK_BIT: _Instruction.pick_bit,
    Op.SEES: _Instruction.sees,
    Op.CELL_OF: _Instruction.cell_of,
    Op.CELL_BESIDE: _Instruction.cell_beside,
    Op.HEARD_FROM: _Instruction.heard_from,
    Op.HEARD_NOUN: _Instruction.heard_noun,
    Op.SET_FIELD: _Instruction.set_field,
    Op.BECOME: _Instruction.become,
    Op.VANISH: _Instruction.vanish,
    Op.SAY: _Instruction.say,
    Op.GOTO: _Instruction.goto,
    Op.COUNT: _Instruction.count,
    Op.ANSWER: _Instruction.answer,
    Op.END: _Instruction.end,
    Op.END_GRADED: _Instruction.end_graded,
    Op.REWARD: _Instruction.reward,
    Op.PLACE: _Instruction.put_on,
    Op.POINT: _Instruction.point,
    Op.BODY: _Instruction.body,
    Op.CHOOSE: _Instruction.choose,
    Op.FACE: _Instruction.go,
    Op.TURN_TO: _Instruction.turn_to,
    **dict.fromkeys((Op.GO_TO, Op.GO_NEXT_TO), _Instruction.go),
    Op.B_FLOOR: _Instruction.fill,
    Op.B_FREE: _Instruction.free,
    Op.B_WALL: _Instruction.wall,
    Op.B_RECT: _Instruction.rectangle,
    **dict.fromkeys((Op.B_NEXT_TO, Op.B_IN_FRONT_OF), _Instruction.near_place),
    **dict.fromkeys((Op.B_AND, Op.B_OR, Op.B_WITHOUT), _Instruction.two_boards),
    Op.EACH_CELL: _Instruction.each_cell,
    Op.PICK_CELL: _Instruction.pick_cell,
    Op.FIRST_CELL: _Instruction.first_cell,
    Op.NEAREST_CELL: _Instruction.nearest_cell,
    Op.B_COPY: _Instruction.copy_board,
    Op.B_COUNT: _Instruction.count_cells,
    Op.PUT: _Instruction.put,
    Op.MAKE_ROOM: _Instruction.make_room,
    Op.DRAW_ROOM: _Instruction.draw_room,
}

_ONE_TEMPORARY = frozenset(
    (*ARITHMETIC, *range(Op.LOAD, Op.CELL_BESIDE + 1), Op.B_COUNT, Op.HEARD_FROM, Op.HEARD_NOUN)
)
_TWO_TEMPORARIES = frozenset((Op.PICK_CELL, Op.FIRST_CELL, Op.NEAREST_CELL))


def written_temporaries(op: int, a: int, b: int) -> range:
    """Indices of the temporaries that an instruction writes, should its operands name temporaries."""
    first, count = a, 0
    if op in _ONE_TEMPORARY:
        count = 1
    elif op in _TWO_TEMPORARIES:
        count = 2
    elif op == Op.EACH_CELL:
        first, count = b, 3
    if not TEMPORARY <= first < TEMPORARY + TEMPORARIES:
        return range(0)
    return range(first - TEMPORARY, first - TEMPORARY + count)
