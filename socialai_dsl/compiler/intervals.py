"""Ranges of values: what the verifier knows about registers and temporaries at one instruction."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from socialai_dsl.program import (
    CELL,
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    Body,
    EntityColumn,
    Field,
    Flag,
    Header,
    Program,
    Register,
)
from socialai_dsl.program.ranges import ANYTHING, Interval, hull

WHOLE_REGISTER: Interval = (-32768, 32767)
LAST_BODY = Body.STOP_POINTING


@dataclass(frozen=True)
class Ranges:
    """What every register may hold at any time, which each write is proven to keep; the `Bounds` of a program."""

    of_register: tuple[Interval, ...]
    width: int
    height: int
    npcs: int
    nouns: int
    first_cell: int = CELL

    @property
    def last_cell(self) -> int:
        """The last cell of the canvas as an operand."""
        return CELL + 32 * (self.height - 1) + self.width - 1

    @classmethod
    def of(cls, program: Program) -> Ranges:
        """Ranges that follow from the header, the entities and the names of the program's own registers."""
        header = program.header
        ranges = [WHOLE_REGISTER] * header(Header.REGISTERS)
        width, height = header(Header.CANVAS_WIDTH), header(Header.CANVAS_HEIGHT)
        least = header(Header.MIN_HEIGHT)
        ranges[Register.T] = (0, header(Header.HORIZON))
        ranges[Register.WIDTH] = (header(Header.MIN_WIDTH), width)
        ranges[Register.HEIGHT] = (least, least + header(Header.HEIGHTS) - 1)
        ranges[Register.ACTION] = (0, 7)
        ranges[Register.LAST_TURN] = (-1, LAST_BODY)
        ranges[Register.CLASS] = (0, header(Header.CLASSES) - 1)
        ranges[Register.TEMPLATE] = (-1, header(Header.TEMPLATES) - 1)
        ranges[Register.NOUN] = (-1, header(Header.NOUNS) - 1)
        ranges[Register.UTTERANCE] = (0, header(Header.TEMPLATES) * header(Header.NOUNS))
        ranges[Register.CHANGED] = ranges[Register.ACCEPTED] = (0, 1)
        ranges[Register.POKED] = (-1, header(Header.ENTITIES) - 1)
        for entity in range(header(Header.ENTITIES)):
            for which, interval in _field_ranges(program, entity, width, height).items():
                ranges[FIRST_ENTITY + ENTITY_FIELDS * entity + which] = interval
        for name in program.registers:
            ranges[name.register] = (name.low, name.high)
        return cls(tuple(ranges), width, height, header(Header.NPCS), header(Header.NOUNS))

    def field(self, things: Interval, which: int) -> Interval:
        """The range of a field over several entities, or over cells."""
        if things[0] >= self.first_cell - 1:
            return -1, max(self.width, self.height, 32) - 1
        first, last = (FIRST_ENTITY + ENTITY_FIELDS * entity + which for entity in things)
        result = self.of_register[first]
        for register in range(first, last + 1, ENTITY_FIELDS):
            result = hull(result, self.of_register[register])
        return result


def _field_ranges(program: Program, entity: int, width: int, height: int) -> dict[Field, Interval]:
    return {
        Field.X: (-1, width - 1),
        Field.Y: (-1, height - 1),
        Field.DIR: (0, 3),
        Field.COLOR: (0, 5),
        Field.STATUS: (0, greatest_status(program, entity)),
        Field.GONE: (0, 1),
        Field.POKED: (0, 1),
        Field.LAST: (-1, LAST_BODY),
        Field.POINTING: (0, 4),
        Field.INSIDE: (0, program.header(Header.ENTITIES) - 1),
    }


class Known:
    """What is known on a path: ranges of temporaries, boards that are filled (what is absent was never written), and
    whether the room has its size.
    """

    def __init__(self, ranges: Ranges, has_room: bool) -> None:
        self.ranges = ranges
        self.has_room = has_room
        self.temporaries: dict[int, Interval] = {}
        self.boards: set[int] = set()

    def copy(self) -> Known:
        """The same, to be changed by itself."""
        known = Known(self.ranges, self.has_room)
        known.temporaries, known.boards = dict(self.temporaries), set(self.boards)
        return known

    def value(self, operand: int) -> Interval | None:
        """The range of an operand; None if it is nothing that can be read."""
        if operand >= CONSTANT // 2:
            return operand - CONSTANT, operand - CONSTANT
        if operand >= TEMPORARY:
            return self.temporaries.get(operand - TEMPORARY)
        if operand in (Register.WIDTH, Register.HEIGHT) and not self.has_room:
            return WHOLE_REGISTER
        if 0 <= operand < len(self.ranges.of_register):
            return self.ranges.of_register[operand]
        return None

    def write(self, target: int, interval: Interval) -> str | None:
        """Note a write; what is wrong with it, or None."""
        if TEMPORARY <= target < TEMPORARY + TEMPORARIES:
            self.temporaries[target - TEMPORARY] = interval
            return None
        if not 0 <= target < len(self.ranges.of_register):
            return f"writes to {target}, which is neither a register nor a temporary"
        low, high = self.ranges.of_register[target]
        if interval[0] < low or interval[1] > high:
            return f"may write {interval[0]}..{interval[1]} to register {target}, which holds {low}..{high}"
        return None

    def joined(self, other: Known | None) -> Known:
        """What is known where two paths meet."""
        known = self.copy()
        if other is not None:
            both = self.temporaries.keys() & other.temporaries.keys()
            known.temporaries = {k: hull(self.temporaries[k], other.temporaries[k]) for k in both}
            known.boards &= other.boards
            known.has_room &= other.has_room
        return known

    def after_loop(self, written: Iterable[int], before: Known) -> Known:
        """What is left of it behind a loop that ran any number of times, none included.

        A temporary that was written inside may hold anything, or was never written unless it was before the loop.
        """
        known = self.copy()
        known.boards &= before.boards
        for temporary in written:
            known.temporaries.pop(temporary, None)
            if temporary in before.temporaries:
                known.temporaries[temporary] = ANYTHING
        return known


def inbox_registers(program: Program) -> int:
    """Registers of an inbox: a count, then entries of a class each, or of class, speaker and noun."""
    entry = 3 if program.header(Header.FLAGS) & Flag.HEARD_BY else 1
    return 1 + entry * program.header(Header.INBOX_SIZE)


def greatest_status(program: Program, entity: int) -> int:
    """The last status of an object; the greatest status code of an NPC."""
    if program.entities[entity].role == "object":
        return max(1, len(program.entities[entity].states)) - 1
    return int(program.table(Header.ENTITY_AT)[entity, EntityColumn.KIND])
