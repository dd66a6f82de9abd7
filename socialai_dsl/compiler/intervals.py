"""Ranges of values: what the verifier knows about registers and temporaries at one instruction."""

from __future__ import annotations

from dataclasses import dataclass

from socialai_dsl.program import (
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    EntityColumn,
    Field,
    Header,
    Program,
    Register,
)

Interval = tuple[int, int]
WHOLE_REGISTER: Interval = (-32768, 32767)
WIDEST = 1 << 62
ANYTHING: Interval = (-WIDEST, WIDEST)


def hull(a: Interval, b: Interval) -> Interval:
    """The least interval around both."""
    return min(a[0], b[0]), max(a[1], b[1])


def clamp(low: int, high: int) -> Interval:
    """An interval cut to what 64 bits hold with room to spare."""
    return max(low, -WIDEST), min(high, WIDEST)


@dataclass(frozen=True)
class Ranges:
    """What every register may hold at any time: each write is proven to keep it so."""

    of_register: tuple[Interval, ...]

    @classmethod
    def of(cls, program: Program) -> Ranges:
        """Ranges that follow from the header, the entities and the names of the program's own registers."""
        header = program.header
        ranges = [WHOLE_REGISTER] * header(Header.REGISTERS)
        width, height = header(Header.CANVAS_WIDTH), header(Header.CANVAS_HEIGHT)
        ranges[Register.T] = (0, header(Header.HORIZON))
        ranges[Register.WIDTH], ranges[Register.HEIGHT] = (0, width), (0, height)
        ranges[Register.ACTION] = ranges[Register.LAST_TURN] = (-1, 7)
        ranges[Register.CLASS] = (0, header(Header.CLASSES) - 1)
        ranges[Register.TEMPLATE] = (-1, header(Header.TEMPLATES) - 1)
        ranges[Register.NOUN] = (-1, header(Header.NOUNS) - 1)
        ranges[Register.POKED] = (-1, header(Header.ENTITIES) - 1)
        for entity in range(header(Header.ENTITIES)):
            for which, interval in _field_ranges(program, entity, width, height).items():
                ranges[FIRST_ENTITY + ENTITY_FIELDS * entity + which] = interval
        for name in program.registers:
            ranges[name.register] = (name.low, name.high)
        return cls(tuple(ranges))

    def of_field(self, entities: Interval, which: int) -> Interval:
        """The range of a field over several entities."""
        first, last = (FIRST_ENTITY + ENTITY_FIELDS * entity + which for entity in entities)
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
        Field.STATUS: (0, max(1, len(program.entities[entity].states)) - 1),
        Field.GONE: (0, 1),
        Field.POKED: (0, 1),
        Field.LAST: (-1, 7),
    }


class Known:
    """Ranges of the temporaries on a path; a temporary that is absent was never written."""

    def __init__(self, ranges: Ranges, temporaries: dict[int, Interval] | None = None) -> None:
        self.ranges = ranges
        self.temporaries = dict(temporaries or {})

    def value(self, operand: int) -> Interval | None:
        """The range of an operand; None if it is nothing that can be read."""
        if operand >= CONSTANT // 2:
            return operand - CONSTANT, operand - CONSTANT
        if operand >= TEMPORARY:
            return self.temporaries.get(operand - TEMPORARY)
        if 0 <= operand < len(self.ranges.of_register):
            return self.ranges.of_register[operand]
        return None

    def write(self, target: int, interval: Interval) -> str | None:
        """Note a write; what is wrong with it, or None."""
        if TEMPORARY <= target < TEMPORARY + TEMPORARIES:
            self.temporaries[target - TEMPORARY] = clamp(*interval)
            return None
        if not 0 <= target < len(self.ranges.of_register):
            return f"writes to {target}, which is neither a register nor a temporary"
        low, high = self.ranges.of_register[target]
        if interval[0] < low or interval[1] > high:
            return f"may write {interval[0]}..{interval[1]} to register {target}, which holds {low}..{high}"
        return None

    def joined(self, other: Known | None) -> Known:
        """What is known where two paths meet."""
        if other is None:
            return Known(self.ranges, self.temporaries)
        both = self.temporaries.keys() & other.temporaries.keys()
        return Known(self.ranges, {k: hull(self.temporaries[k], other.temporaries[k]) for k in both})


def entity_type_row(program: Program, entity: int) -> int:
    """First row of the type table of an entity."""
    return int(
        program.words[program.header(Header.ENTITY_AT) + entity * EntityColumn.COLUMNS + EntityColumn.TYPE]
    )
