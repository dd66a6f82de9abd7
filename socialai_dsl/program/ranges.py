"""Ranges of values: exact arithmetic on intervals, and the range of what each instruction writes.

An interval is sound: whatever the operands are within theirs, the engine's result lies within that of the result. The
engine computes with 64 bits and wraps around, so a result that may leave them may be anything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

Interval = tuple[int, int]

ANYTHING: Interval = (-(1 << 63), (1 << 63) - 1)
"""What 64 bits hold."""

_BITS_OF_A_SET = 32


class Bounds(Protocol):
    """What the range of a result may depend on besides its operands."""

    @property
    def first_cell(self) -> int:
        """The first cell as an operand; the number before it is no cell."""

    @property
    def last_cell(self) -> int:
        """The last cell of the canvas as an operand."""

    @property
    def width(self) -> int:
        """Columns of the canvas."""

    @property
    def height(self) -> int:
        """Lines of the canvas."""

    @property
    def npcs(self) -> int:
        """The greatest number of an NPC."""

    @property
    def nouns(self) -> int:
        """How many nouns there are."""

    def field(self, things: Interval, which: int) -> Interval:
        """The range of a field over several entities, or over cells."""


Operands = Sequence[Interval]
"""Ranges of an instruction's three operands; a literal's holds it alone, and that of an unused one 0."""

Rule = Callable[[Bounds, Operands], Interval]
"""The range of what an instruction writes."""


def hull(a: Interval, b: Interval) -> Interval:
    """The least interval around both."""
    return min(a[0], b[0]), max(a[1], b[1])


def within_64_bits(low: int, high: int) -> Interval:
    """The interval, or everything if it leaves 64 bits."""
    return (low, high) if low >= ANYTHING[0] and high <= ANYTHING[1] else ANYTHING


def same(_: Bounds, operands: Operands) -> Interval:
    """Of LOAD."""
    return operands[1]


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


def field(bounds: Bounds, operands: Operands) -> Interval:
    """Of FIELD."""
    things, which = operands[1:]
    return bounds.field(things, which[0])


def distance(bounds: Bounds, _: Operands) -> Interval:
    """Of DISTANCE: from cell to cell, or to what is not in the room the sum of its sides.

    The number of a cell holds 32 columns, on however narrow a canvas.
    """
    return 0, 32 + bounds.height


def one_of_those(_: Bounds, operands: Operands) -> Interval:
    """Of NEAREST: one of the entities, or -1."""
    return -1, operands[2][0] & 255


def direction(_: Bounds, __: Operands) -> Interval:
    """Of QUADRANT."""
    return 0, 3


def truth(_: Bounds, __: Operands) -> Interval:
    """Of SEES."""
    return 0, 1


def drawn(_: Bounds, operands: Operands) -> Interval:
    """Of DRAW: below a number that is at least 1."""
    return 0, operands[1][1] - 1


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
    return bounds.first_cell - 1, bounds.last_cell


def a_speaker(bounds: Bounds, _: Operands) -> Interval:
    """Of HEARD_FROM."""
    return -1, bounds.npcs


def a_noun(bounds: Bounds, _: Operands) -> Interval:
    """Of HEARD_NOUN."""
    return -1, bounds.nouns - 1


def a_column(bounds: Bounds, _: Operands) -> Interval:
    """The x of a cell, or -1."""
    return -1, bounds.width - 1


def a_line(bounds: Bounds, _: Operands) -> Interval:
    """The y of a cell, or -1."""
    return -1, bounds.height - 1


def column_of_loop(bounds: Bounds, _: Operands) -> Interval:
    """The x of the cell that a loop is at."""
    return 0, bounds.width - 1


def line_of_loop(bounds: Bounds, _: Operands) -> Interval:
    """The y of the cell that a loop is at."""
    return 0, bounds.height - 1


def cell_of_loop(bounds: Bounds, _: Operands) -> Interval:
    """The cell that a loop is at."""
    return bounds.first_cell, bounds.last_cell


def how_many_cells(bounds: Bounds, _: Operands) -> Interval:
    """Of B_COUNT."""
    return 0, bounds.width * bounds.height
