"""The instruction table: of each op its class, its operands, what it reads and writes, and the range of its results.

An instruction is four words: op, a, b, c. The interpreter, the verifier, the listing, the liveness of registers and
`docs/instructions.md` are made from this table or checked against it; an op without an entry can neither be assembled
nor verified. An op's number is its class and its place in the class, so a new one renumbers nothing.

An interval is sound: whatever the operands are within theirs, the engine's result lies within that of the result. The
engine computes with 64 bits and wraps around, so a result that may leave them may be anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Final

from socialai_dsl.program.format import CELL, ENTITY_FIELDS, FIRST_ENTITY, MOST_CHOICES

Interval = tuple[int, int]

ANYTHING: Interval = (-(1 << 63), (1 << 63) - 1)
"""What 64 bits hold."""

_BITS_OF_A_SET = 32


def hull(a: Interval, b: Interval) -> Interval:
    """The least interval around both."""
    return min(a[0], b[0]), max(a[1], b[1])


@dataclass(frozen=True)
class Bounds:
    """The bounds that the range of a result may depend on besides its operands.

    Attributes:
        of_register: the range of every register.
        width, height: of the canvas.
        npcs: the greatest number of an NPC.
        nouns: how many nouns there are.
    """

    of_register: tuple[Interval, ...]
    width: int
    height: int
    npcs: int
    nouns: int

    @property
    def last_cell(self) -> int:
        """The last cell of the canvas as an operand."""
        return CELL + 32 * (self.height - 1) + self.width - 1

    def field(self, things: Interval, which: int) -> Interval:
        """The range of a field over several entities, or over cells, whose numbers hold 32 columns."""
        if things[0] >= CELL - 1:
            return -1, 31
        first, last = (FIRST_ENTITY + ENTITY_FIELDS * entity + which for entity in things)
        return reduce(hull, self.of_register[first : last + 1 : ENTITY_FIELDS])

    def row(self, first: int, last: int) -> Interval:
        """The range of all registers from one to another."""
        return reduce(hull, self.of_register[first : last + 1])


Operands = Sequence[Interval]
"""Ranges of an instruction's three operands; a literal's holds it alone, and that of an unused one 0."""

Rule = Callable[[Bounds, Operands], Interval]
"""The range of what an instruction writes."""


def within_64_bits(low: int, high: int) -> Interval:
    """The interval, or everything if it leaves 64 bits."""
    return (low, high) if low >= ANYTHING[0] and high <= ANYTHING[1] else ANYTHING


def total(_: Bounds, operands: Operands) -> Interval:
    """Of ADD."""
    a, b = operands[1:]
    return within_64_bits(a[0] + b[0], a[1] + b[1])


def difference(_: Bounds, operands: Operands) -> Interval:
    """Of SUB."""
    a, b = operands[1:]
    return within_64_bits(a[0] - b[1], a[1] - b[0])


def product(_: Bounds, operands: Operands) -> Interval:
    """Of MUL."""
    a, b = operands[1:]
    corners = [x * y for x in a for y in b]
    return within_64_bits(min(corners), max(corners))


def quotient(_: Bounds, operands: Operands) -> Interval:
    """Of DIV, which is floored, and 0 for the divisor 0."""
    a, b = operands[1:]
    divisors = [d for d in (b[0], b[1], -1, 1) if d != 0 and b[0] <= d <= b[1]]
    corners = [x // y for x in a for y in divisors]
    if b[0] <= 0 <= b[1]:
        corners.append(0)
    return within_64_bits(min(corners), max(corners))


def remainder(_: Bounds, operands: Operands) -> Interval:
    """Of MOD, which has the sign of the divisor, and is 0 for the divisor 0."""
    a, b = operands[1:]
    if b[0] > 0 and a[0] >= 0 and a[1] < b[0]:
        return a
    return min(0, b[0] + 1), max(0, b[1] - 1)


def least(_: Bounds, operands: Operands) -> Interval:
    """Of MIN."""
    a, b = operands[1:]
    return min(a[0], b[0]), min(a[1], b[1])


def greatest(_: Bounds, operands: Operands) -> Interval:
    """Of MAX."""
    a, b = operands[1:]
    return max(a[0], b[0]), max(a[1], b[1])


def magnitude(_: Bounds, operands: Operands) -> Interval:
    """Of ABS."""
    low, high = operands[1]
    nearest = 0 if low <= 0 <= high else min(abs(low), abs(high))
    return within_64_bits(nearest, max(abs(low), abs(high)))


def always(low: int, high: int) -> Rule:
    """The same range whatever the operands are."""
    return lambda _, __: (low, high)


def drawn_other(_: Bounds, operands: Operands) -> Interval:
    """Of DRAW_OTHER."""
    first, count = operands[2][0] >> 16 & 255, operands[2][0] >> 24
    return first, first + count - 1


def with_bit(_: Bounds, operands: Operands) -> Interval:
    """Of SET_BIT, for a set that is not negative and a bit from 0 to 62."""
    bits = max(operands[0][1].bit_length(), operands[1][1] + 1)
    return 0, (1 << bits) - 1


def bits_set(_: Bounds, operands: Operands) -> Interval:
    """Of COUNT_BITS, which looks at 32 bits; a negative number has all its upper ones set."""
    low, high = operands[1]
    return 0, min(high.bit_length(), _BITS_OF_A_SET) if low >= 0 else _BITS_OF_A_SET


def a_bit(_: Bounds, operands: Operands) -> Interval:
    """Of LOWEST_BIT and PICK_BIT: the position of a set bit of the lower 32, or 0."""
    low, high = operands[1]
    return 0, max(0, min(high.bit_length(), _BITS_OF_A_SET) - 1) if low >= 0 else _BITS_OF_A_SET - 1


def a_cell(bounds: Bounds, _: Operands) -> Interval:
    """Of CELL_OF and CELL_BESIDE: a cell, or none."""
    return CELL - 1, bounds.last_cell


# -- ops and their entries -----------------------------------------------------------------------------------


CLASS_BITS: Final = 6
"""Bits of an op's number within its class: op >> CLASS_BITS is the class."""


class OpClass(IntEnum):
    """The classes of instructions."""

    CONTROL = 0  # where code goes on
    TEST = 1  # goes on if true, else skips
    VALUE = 2  # computes a value
    EFFECT = 3  # changes the world
    ACTIVITY = 4  # chooses the body action of the entity on turn
    BOARD = 5  # fills and reads boards, and sets up the room


class Op(IntEnum):
    """The instruction set; `TABLE` says what each does."""

    HALT = 0
    SKIP = 1
    EACH_CELL = 2
    DROP_CELL = 3
    END_EACH = 4

    IF_EQ = 64
    IF_NE = 65
    IF_LT = 66
    IF_LE = 67
    IF_BIT = 68
    IF_UNPINNED = 69
    IF_CHANCE = 70
    IF_HEARD = 71
    IF_SAME_CELL = 72
    IF_NEXT_TO = 73
    IF_FACES = 74
    IF_IN_FRONT_OF = 75
    IF_EYE_CONTACT = 76
    IF_FACES_TOWARD = 77
    IF_IN_LINE = 78
    IF_REACHES = 79
    IF_LOOKS_AT = 80
    IF_UNOBSTRUCTED = 81

    LOAD = 128
    ADD = 129
    SUB = 130
    MUL = 131
    DIV = 132
    MOD = 133
    MIN = 134
    MAX = 135
    ABS = 136
    FIELD = 137
    DISTANCE = 138
    NEAREST = 139
    QUADRANT = 140
    DRAW = 141
    DRAW_OTHER = 142
    SET_BIT = 143
    COUNT_BITS = 144
    LOWEST_BIT = 145
    PICK_BIT = 146
    SEES = 147
    CELL_OF = 148
    CELL_BESIDE = 149
    HEARD_FROM = 150
    HEARD_NOUN = 151
    READ_AT = 152

    SET_FIELD = 192
    BECOME = 193
    VANISH = 194
    SAY = 195
    GOTO = 196
    COUNT = 197
    END = 198
    PLACE = 199
    REWARD = 200
    END_GRADED = 201
    ANSWER = 202
    STORE_AT = 203

    BODY = 256
    TURN_TO = 257
    GO_TO = 258
    GO_NEXT_TO = 259
    POINT = 260
    CHOOSE = 261
    FACE = 262
    EXPLORE = 263

    B_FLOOR = 320
    B_WALL = 321
    B_RECT = 322
    B_NEXT_TO = 323
    B_IN_FRONT_OF = 324
    B_AND = 325
    B_OR = 326
    B_WITHOUT = 327
    B_FREE = 328
    B_COPY = 329
    B_COUNT = 330
    PICK_CELL = 331
    FIRST_CELL = 332
    NEAREST_CELL = 333
    PUT = 334
    MAKE_ROOM = 335
    DRAW_ROOM = 336


TESTS: Final = frozenset(op for op in Op if op >> CLASS_BITS == OpClass.TEST)


class Kind(Enum):
    """The kinds of operand words."""

    UNUSED = "unused"
    VALUE = "a value"
    ENTITY = "an entity's number"
    PLACE = "an entity's number, or a cell"
    TARGET = "a register or temporary that is written"
    UPDATED = "a temporary that is read and written"
    TEMPORARIES = "the first of some temporaries that are written"
    COORDINATES = "the first of some temporaries that are read"
    BOARD = "a board that is read"
    FILLED = "a board that is filled"
    CHANGED = "a board that is read and changed"
    SITE = "a draw site"
    INBOX = "the first register of an inbox"
    REGISTER = "a register's number"
    LITERAL = "a literal number"
    SKIP = "instructions to skip"


@dataclass(frozen=True)
class Operand:
    """One operand: its kind, and the range that its value or literal must be in.

    Attributes:
        kind: what the word is.
        low, high: the range, as far as it is the same in every program.
        count: of COORDINATES how many temporaries are read.
        meaning: what a literal means, or whose number a value is.
    """

    kind: Kind
    low: int = ANYTHING[0]
    high: int = ANYTHING[1]
    count: int = 1
    meaning: str = ""


_READ: Final = frozenset((Kind.VALUE, Kind.ENTITY, Kind.PLACE, Kind.UPDATED, Kind.COORDINATES, Kind.INBOX))
_WRITTEN: Final = frozenset((Kind.TARGET, Kind.UPDATED, Kind.TEMPORARIES))


@dataclass(frozen=True)
class Instruction:
    """The entry of an op in the table.

    Attributes:
        says: what it does, in one sentence; a, b, c are its operands, v(x) the value of one.
        operands: of a, b and c.
        results: the range of each value that it writes, first to last.
        setup: whether only reset code may run it.
    """

    op: Op
    says: str
    operands: tuple[Operand, Operand, Operand]
    results: tuple[Rule, ...] = ()
    setup: bool = False

    @property
    def op_class(self) -> OpClass:
        """Its class."""
        return OpClass(self.op >> CLASS_BITS)

    @cached_property
    def reads(self) -> tuple[int, ...]:
        """Positions of the operands that name registers or temporaries to read."""
        return tuple(k for k, operand in enumerate(self.operands) if operand.kind in _READ)

    @cached_property
    def writes(self) -> int | None:
        """Position of the operand that names what is written, as many registers or temporaries as there are results."""
        return next((k for k, operand in enumerate(self.operands) if operand.kind in _WRITTEN), None)

    def read_at(self, position: int, words: Sequence[int]) -> range:
        """The registers or temporaries that an operand names to be read, as operand words."""
        operand, first = self.operands[position], words[position]
        return range(first, first + operand.count) if operand.kind in _READ else range(0)

    def written(self, words: Sequence[int]) -> range:
        """The registers or temporaries that it writes, as operand words."""
        if self.writes is None:
            return range(0)
        return range(words[self.writes], words[self.writes] + len(self.results))

    @cached_property
    def draws(self) -> bool:
        """Whether chance decides what it does."""
        return any(operand.kind is Kind.SITE for operand in self.operands)

    @property
    def skips(self) -> bool:
        """Whether it may go on behind the instructions that its last operand counts."""
        return self.operands[2].kind is Kind.SKIP


_NONE: Final = Operand(Kind.UNUSED)
_VALUE: Final = Operand(Kind.VALUE)
_NOT_NEGATIVE: Final = Operand(Kind.VALUE, 0)
_DIRECTION: Final = Operand(Kind.VALUE, 0, 3)
_LINE: Final = Operand(Kind.VALUE, 0, meaning="line")
_ENTITY: Final = Operand(Kind.ENTITY)
_PLACE: Final = Operand(Kind.PLACE)
_TARGET: Final = Operand(Kind.TARGET)
_WRITTEN_HERE: Final = Operand(Kind.TEMPORARIES)
_BOARD: Final = Operand(Kind.BOARD)
_FILLED: Final = Operand(Kind.FILLED)
_CHANGED: Final = Operand(Kind.CHANGED)
_SITE: Final = Operand(Kind.SITE)
_INBOX: Final = Operand(Kind.INBOX)
_SKIP: Final = Operand(Kind.SKIP)
_REGISTER: Final = Operand(Kind.REGISTER)


def _literal(meaning: str, low: int = 0, high: int = (1 << 31) - 1) -> Operand:
    return Operand(Kind.LITERAL, low, high, meaning=meaning)


def _test(op: Op, says: str, a: Operand = _PLACE, b: Operand = _PLACE) -> Instruction:
    return Instruction(op, says, (a, b, _SKIP))


def _value(
    op: Op, says: str, rule: Rule, b: Operand = _VALUE, c: Operand = _NONE, a: Operand = _TARGET
) -> Instruction:
    return Instruction(op, says, (a, b, c), (rule,))


def _plain(
    op: Op, says: str, a: Operand = _NONE, b: Operand = _NONE, c: Operand = _NONE, setup: bool = False
) -> Instruction:
    return Instruction(op, says, (a, b, c), setup=setup)


_CELL_FOUND: Final[tuple[Rule, Rule]] = (
    lambda bounds, _: (-1, bounds.width - 1),
    lambda bounds, _: (-1, bounds.height - 1),
)

_ALL: Final = (
    _plain(Op.HALT, "This code ends."),
    _plain(Op.SKIP, "Skip c instructions.", c=_SKIP),
    Instruction(
        Op.EACH_CELL,
        "Run the c instructions up to END_EACH for each cell of board a, row by row; b, b + 1 and b + 2 are its x, its "
        "y and the cell as an operand.",
        (_BOARD, _WRITTEN_HERE, _SKIP),
        (
            lambda bounds, _: (0, bounds.width - 1),
            lambda bounds, _: (0, bounds.height - 1),
            lambda bounds, _: (CELL, bounds.last_cell),
        ),
    ),
    _plain(Op.DROP_CELL, "Take the current cell out of the board of the loop."),
    _plain(Op.END_EACH, "The end of a loop."),
    _test(Op.IF_EQ, "v(a) == v(b).", _VALUE, _VALUE),
    _test(Op.IF_NE, "v(a) != v(b).", _VALUE, _VALUE),
    _test(Op.IF_LT, "v(a) < v(b).", _VALUE, _VALUE),
    _test(Op.IF_LE, "v(a) <= v(b).", _VALUE, _VALUE),
    _test(Op.IF_BIT, "Bit v(b) of v(a) is set.", _VALUE, Operand(Kind.VALUE, 0, 62)),
    _test(Op.IF_UNPINNED, "No layout gives register a.", _REGISTER, _NONE),
    _test(
        Op.IF_CHANCE,
        "An event of probability a / 65536 happens, drawn at site b.",
        _literal("probability", 0, 65536),
        _SITE,
    ),
    _test(Op.IF_HEARD, "Something of class b is in inbox a.", _INBOX, _literal("utterance class", 1)),
    _test(Op.IF_SAME_CELL, "Both are in one cell."),
    _test(Op.IF_NEXT_TO, "Their Manhattan distance is 1."),
    _test(Op.IF_FACES, "b is in the cell ahead of a."),
    _test(
        Op.IF_IN_FRONT_OF,
        "a stands in the cell in front of b: one step into the room from a wall, else ahead of b.",
    ),
    _test(
        Op.IF_EYE_CONTACT,
        "Both are in one row or column, in different cells, each facing the other; nothing is tested between.",
    ),
    _test(Op.IF_FACES_TOWARD, "The direction of a is the quadrant of the way to b."),
    _test(Op.IF_IN_LINE, "Both are in one row or column."),
    _test(Op.IF_REACHES, "a has a path to the cell of b, or next to it."),
    _test(Op.IF_LOOKS_AT, "b lies straight ahead of a, within its view, with nothing opaque between."),
    _test(Op.IF_UNOBSTRUCTED, "Both are in one row or column with nothing opaque between."),
    _value(Op.LOAD, "a = v(b).", lambda _, operands: operands[1]),
    _value(Op.ADD, "a = v(b) + v(c).", total, c=_VALUE),
    _value(Op.SUB, "a = v(b) - v(c).", difference, c=_VALUE),
    _value(Op.MUL, "a = v(b) * v(c).", product, c=_VALUE),
    _value(Op.DIV, "a = v(b) // v(c), floored; 0 if v(c) is 0.", quotient, c=_VALUE),
    _value(Op.MOD, "a = v(b) % v(c), with the sign of v(c); 0 if that is 0.", remainder, c=_VALUE),
    _value(Op.MIN, "a = the lesser of v(b) and v(c).", least, c=_VALUE),
    _value(Op.MAX, "a = the greater of v(b) and v(c).", greatest, c=_VALUE),
    _value(Op.ABS, "a = |v(b)|.", magnitude),
    _value(
        Op.FIELD,
        "a = field c of b; x and y are -1 of what is not in the room.",
        lambda bounds, operands: bounds.field(operands[1], operands[2][0]),
        _PLACE,
        _literal("field", 0, ENTITY_FIELDS - 1),
    ),
    _value(
        Op.DISTANCE,
        "a = the Manhattan distance of b and c; width and height together if one is not in the room.",
        lambda bounds, _: (0, 32 + bounds.height),  # the number of a cell holds 32 columns, on any canvas
        _PLACE,
        _PLACE,
    ),
    _value(
        Op.NEAREST,
        "a = the entity nearest to b of those from c >> 8 to c & 255, ties: the first; -1 if none is in the room.",
        lambda _, operands: (-1, operands[2][0] & 255),
        _PLACE,
        _literal("first and last entity"),
    ),
    _value(
        Op.QUADRANT,
        "a = the direction of c seen from b; on diagonals SE is right, NE up, NW left, SW down.",
        always(0, 3),
        _PLACE,
        _PLACE,
    ),
    _value(
        Op.DRAW,
        "a = a uniform number below v(b), drawn at site c.",
        lambda _, operands: (0, operands[1][1] - 1),
        Operand(Kind.VALUE, 1, 1 << 30),
        _SITE,
    ),
    _value(
        Op.DRAW_OTHER,
        "a = a uniform number other than v(b), drawn at site c & 65535, of the c >> 24 numbers from c >> 16 & 255 on.",
        drawn_other,
        _VALUE,
        Operand(Kind.SITE, meaning="packed"),
    ),
    _value(
        Op.SET_BIT,
        "Bit v(b) of v(a) is set.",
        with_bit,
        Operand(Kind.VALUE, 0, 62),
        a=Operand(Kind.UPDATED, 0),
    ),
    _value(Op.COUNT_BITS, "a = how many of the lower 32 bits of v(b) are set.", bits_set),
    _value(
        Op.LOWEST_BIT,
        "a = the position of the lowest set bit of v(b), of 32; 0 if none.",
        a_bit,
        _NOT_NEGATIVE,
    ),
    _value(
        Op.PICK_BIT,
        "a = the position of a uniformly drawn set bit of v(b), of 32, at site c; 0 if none.",
        a_bit,
        _NOT_NEGATIVE,
        _SITE,
    ),
    _value(
        Op.SEES,
        "a = 1 if c would be in the view square of b if b faced direction v(a), else 0.",
        always(0, 1),
        _ENTITY,
        _PLACE,
        Operand(Kind.UPDATED, 0, 3),
    ),
    _value(Op.CELL_OF, "a = the cell of b; no cell if it is not in the room.", a_cell, _PLACE),
    _value(
        Op.CELL_BESIDE,
        "a = the cell beside b in direction v(c); no cell if that is off the canvas.",
        a_cell,
        _PLACE,
        _DIRECTION,
    ),
    _value(
        Op.HEARD_FROM,
        "a = who said the first entry of inbox b whose class is in class set c; -1 if there is none.",
        lambda bounds, _: (-1, bounds.npcs),
        _INBOX,
        _literal("class set"),
    ),
    _value(
        Op.HEARD_NOUN,
        "a = the noun of the first entry of inbox b whose class is in class set c; -1 if there is none.",
        lambda bounds, _: (-1, bounds.nouns - 1),
        _INBOX,
        _literal("class set"),
    ),
    _value(
        Op.READ_AT,
        "a = register b + v(c).",
        lambda bounds, operands: bounds.row(operands[1][0] + operands[2][0], operands[1][0] + operands[2][1]),
        _REGISTER,
        _VALUE,
    ),
    _plain(
        Op.SET_FIELD,
        "Field b of a = v(c); x, y, status and gone have ops of their own.",
        _ENTITY,
        _literal("field", 0, ENTITY_FIELDS - 1),
        _VALUE,
    ),
    _plain(Op.BECOME, "The status of a = v(b); its cell is drawn anew.", _ENTITY, _VALUE),
    _plain(Op.VANISH, "a leaves the room.", _ENTITY),
    _plain(
        Op.SAY, "a says line v(b) at the end of its turn, unless it says something already.", _ENTITY, _LINE
    ),
    _plain(Op.GOTO, "Frame a enters state b, clock 0.", _literal("frame"), _literal("state")),
    _plain(Op.COUNT, "Counter a += 1.", _literal("rule")),
    _plain(
        Op.END,
        "The episode ends with outcome a, for b per cent of the reward.",
        _literal("outcome"),
        _literal("per cent", 0, 100),
    ),
    _plain(Op.PLACE, "a is put on the cell of b, in the room; it may share the cell.", _ENTITY, _PLACE),
    _plain(
        Op.REWARD,
        "v(a) per cent of the success reward are added to that of this step.",
        Operand(Kind.VALUE, -100, 100),
    ),
    _plain(
        Op.END_GRADED,
        "The episode ends with outcome a, for v(b) per cent of the reward, cut to 0..100.",
        _literal("outcome"),
        _VALUE,
    ),
    _plain(
        Op.ANSWER,
        "Counter a += 1, line v(b) is said as by SAY, and, unless c is 0, frame c >> 8 enters state (c & 255) - 1.",
        _literal("rule"),
        _LINE,
        _literal("goal"),
    ),
    _plain(Op.STORE_AT, "Register b + v(c) = v(a).", _VALUE, _REGISTER, _VALUE),
    _plain(Op.BODY, "Body action v(a).", _VALUE),
    _plain(
        Op.TURN_TO,
        "a makes one quarter turn towards direction v(b), none if it faces it; where it lies behind site c decides.",
        _ENTITY,
        _DIRECTION,
        _SITE,
    ),
    _plain(
        Op.GO_TO, "a steps along a shortest path to the cell of b, turning at site c.", _ENTITY, _PLACE, _SITE
    ),
    _plain(
        Op.GO_NEXT_TO, "a steps along a shortest path next to b, turning at site c.", _ENTITY, _PLACE, _SITE
    ),
    _plain(Op.POINT, "a points in direction v(b), or at the cell v(b).", _ENTITY, _VALUE),
    _plain(
        Op.CHOOSE,
        "One of b body actions, drawn at site c: action k is in the bits 4 k to 4 k + 3 of a.",
        _literal("actions", 0, (1 << 4 * MOST_CHOICES) - 1),
        _literal("how many", 1, MOST_CHOICES),
        _SITE,
    ),
    _plain(
        Op.FACE,
        "a makes one quarter turn towards b, as TURN_TO towards its QUADRANT; none if b is not in the room.",
        _ENTITY,
        _PLACE,
        _SITE,
    ),
    _plain(
        Op.EXPLORE,
        "Turn v(b) of a search by a, in rounds of sixteen: three quarter turns left, then forward while three cells "
        "ahead are free floor, in later rounds one; else left in the first round, right in the second, and so on, "
        "unless only the other side is free.",
        _ENTITY,
        _VALUE,
    ),
    _plain(Op.B_FLOOR, "Board a = the cells of plain floor.", _FILLED),
    _plain(
        Op.B_WALL,
        "Board a = the cells of wall side b, at least c cells from its corners.",
        _FILLED,
        _literal("side", 0, 3),
        _literal("margin", 0, 64),
    ),
    _plain(
        Op.B_RECT,
        "Board a = the cells with v(b) <= x <= v(b + 1) and v(b + 2) <= y <= v(b + 3): of plain floor (c is 0), of "
        "floor and what is built on it (1), of the whole canvas (2).",
        _FILLED,
        Operand(Kind.COORDINATES, -64, 64, 4),
        _literal("which cells", 0, 2),
    ),
    _plain(Op.B_NEXT_TO, "Board a = the cells at Manhattan distance 1 from b.", _FILLED, _PLACE),
    _plain(Op.B_IN_FRONT_OF, "Board a = the cell in front of b.", _FILLED, _PLACE),
    _plain(Op.B_AND, "Board a = a and b.", _CHANGED, _BOARD),
    _plain(Op.B_OR, "Board a = a or b.", _CHANGED, _BOARD),
    _plain(Op.B_WITHOUT, "Board a = a without b.", _CHANGED, _BOARD),
    _plain(Op.B_FREE, "Board a = a without the cells that hold an entity.", _CHANGED, setup=True),
    _plain(Op.B_COPY, "Board a = board b.", _FILLED, _BOARD),
    Instruction(
        Op.B_COUNT,
        "a = how many cells board b has.",
        (_WRITTEN_HERE, _BOARD, _NONE),
        (lambda bounds, _: (0, bounds.width * bounds.height),),
    ),
    Instruction(
        Op.PICK_CELL,
        "a, a + 1 = x, y of a uniformly drawn cell of board b, at site c; -1, -1 if it has none.",
        (_WRITTEN_HERE, _BOARD, _SITE),
        _CELL_FOUND,
    ),
    Instruction(
        Op.FIRST_CELL,
        "a, a + 1 = x, y of the first cell of board b, row by row; -1, -1 if it has none.",
        (_WRITTEN_HERE, _BOARD, _NONE),
        _CELL_FOUND,
    ),
    Instruction(
        Op.NEAREST_CELL,
        "a, a + 1 = x, y of the cell of board b nearest to c, ties: the first; -1, -1 if there is none.",
        (_WRITTEN_HERE, _BOARD, _PLACE),
        _CELL_FOUND,
    ),
    _plain(
        Op.PUT,
        "a is placed at x = v(b), y = v(b + 1), and is not in the room if x is -1.",
        _ENTITY,
        Operand(Kind.COORDINATES, -1, 31, 2),
        setup=True,
    ),
    _plain(Op.MAKE_ROOM, "The room has width v(a) and height v(b).", _VALUE, _VALUE, setup=True),
    _plain(
        Op.DRAW_ROOM,
        "The board shows the room with what stands in it so far (a is 1), or bare again (0).",
        _literal("whether", 0, 1),
        setup=True,
    ),
)

TABLE: Final[Mapping[Op, Instruction]] = MappingProxyType({entry.op: entry for entry in _ALL})
"""Of each op what it is."""
