"""The registers that decide how an episode can continue; states that agree on them are one state to a search.

Everything a program does after a reset lies in the code at a few addresses. What no instruction there reads, such as
the time or what was heard so far, cannot matter. Where it is in doubt a register counts as read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    SECRET,
    TEMPORARY,
    TESTS,
    Field,
    FrameColumn,
    Header,
    LineColumn,
    Op,
    OpClass,
    Program,
    Register,
    constant_of,
)
from socialai_dsl.program.instructions import TABLE
from socialai_dsl.widths import REGISTER, WHOLE_REGISTER

_UNLIMITED = WHOLE_REGISTER[1]
_ADDRESSES = (Header.SETTLE_PC, Header.RULES_PC, Header.BEFORE_PC, Header.LINKS_PC, Header.TICK_PC)

_OF_ONE_STEP = (
    Register.ACTION,
    Register.CLASS,
    Register.TEMPLATE,
    Register.NOUN,
    Register.UTTERANCE,
    Register.POKED,
    Register.SAID_LINE,
    Register.LAST_TURN,
    Register.BONUS,
)
"""Written anew in every step; code can read what the last step left only at BEFORE_PC."""

_RECORDS = (
    *(Register.HEARD, Register.LOGGED, Register.OLDEST, Register.TOKENS),
    *(Register.ATTEMPT, Register.ACCEPTED),
)
"""For the observation and for resets alone."""

_WHOLE_UTTERANCE = (Register.TEMPLATE, Register.NOUN, Register.UTTERANCE)

_OF_MEMBERS = ((Field.LAST, Field.TOGGLED), (Field.POKED,))
"""Fields of members of the cast that only code reads: what they did in the last turn; whether they were poked."""

_COMPARISONS = (Op.IF_EQ, Op.IF_NE, Op.IF_LT, Op.IF_LE)
_DRAWS = frozenset(op for op, entry in TABLE.items() if entry.draws and entry.results)
"""They write what they draw."""

_CHANCY = frozenset(op for op, entry in TABLE.items() if entry.draws and not entry.results)
_TURNS = (Op.TURN_TO, Op.GO_TO, Op.GO_NEXT_TO, Op.FACE)
"""They draw left or right."""

_VALUES = frozenset(op for op, entry in TABLE.items() if entry.op_class is OpClass.VALUE and not entry.draws)

Instruction = tuple[Op, tuple[int, int, int]]


@dataclass(frozen=True)
class Relevance:
    """The relevant part of a program's states.

    Attributes:
        registers: numbers of the registers that decide how an episode goes on.
        limits: for each of them the value from which on all values are alike.
        whole_utterance: whether utterances of one class may have different effects.
        chance: whether anything but what is said is drawn after the reset.
        drawn: whether anything at all is drawn after the reset, if only which line is said.
        choices: the sites that are drawn at after the reset, with how many results each has; None where that is known
            only when it is drawn.
    """

    registers: NDArray[np.intp]
    limits: NDArray[np.int32]
    whole_utterance: bool
    chance: bool
    drawn: bool
    choices: tuple[tuple[int, int], ...] | None

    def of_rows(self, registers: NDArray[np.int32]) -> NDArray[np.int32]:
        """What matters of registers, int32 (..., R), as int32 (..., N)."""
        return np.minimum(np.take(registers, self.registers, axis=-1), self.limits)

    @classmethod
    def of(cls, program: Program) -> Relevance:
        """Find out from the code."""
        blocks = [list(_block(program, pc)) for pc in sorted(set(_entries(program))) if pc != 0]
        limits = _limits(blocks)
        limits |= _of_entities(program, blocks)
        before = program.header(Header.BEFORE_PC)
        read_before = set(_limits([list(_block(program, before))])) if before else set()
        ignored: set[int] = {register for register in _OF_ONE_STEP if register not in read_before} | set(
            _RECORDS
        )
        ignored |= {name.register for name in program.registers if name.fleeting} - read_before
        ignored |= {register for register in (Register.T, *_clocks(program)) if register not in limits}
        ignored |= {register for register in _of_members(program, *_OF_MEMBERS) if register not in limits}
        h = program.header
        for first, size in ((Header.LOG, Header.LOG_SIZE), (Header.HEARD, Header.HEARD_SIZE)):
            ignored |= set(range(h(first), h(first) + h(size)))
        kept = [register for register in range(h(Header.REGISTERS)) if register not in ignored]
        counting = {Register.T, *_clocks(program)}
        return cls(
            np.array(kept, np.intp),
            np.array([limits[r] if r in counting else _UNLIMITED for r in kept], REGISTER),
            any(register in limits for register in _WHOLE_UTTERANCE)
            or any(op == Op.HEARD_NOUN for block in blocks for op, _ in block),
            any(_draws_matter(program, block) for block in blocks),
            any(op in (*_DRAWS, *_CHANCY) for block in blocks for op, _ in block),
            _choices(blocks),
        )


def _entries(program: Program) -> Iterator[int]:
    """Addresses of all code that a step may run."""
    yield from (program.header(address) for address in _ADDRESSES)
    for table in (Header.STATE_AT, Header.OUTCOME_AT):
        yield from program.table(table).ravel().tolist()
    for column in (FrameColumn.PERCEIVE, FrameColumn.DEFERRED):
        yield from _frame_column(program, column)


def _block(program: Program, start: int) -> Iterator[Instruction]:
    """The instructions that can be reached from an address, in their order."""
    code = program.code.tolist()
    waiting: list[int] = [start]
    reached: set[int] = set()
    while waiting:
        pc = waiting.pop()
        if pc in reached:
            continue
        reached.add(pc)
        op, _, _, c = code[pc]
        if op == Op.HALT:
            continue
        if op == Op.SKIP or op in TESTS:
            waiting.append(pc + 1 + c)
        if op != Op.SKIP:
            waiting.append(pc + 1)
    for pc in sorted(reached):
        op, a, b, c = code[pc]
        yield Op(op), (a, b, c)


def _limits(blocks: list[list[Instruction]]) -> dict[int, int]:
    """Each register that is read, with the value from which on no comparison tells its values apart."""
    limits: dict[int, int] = {}
    for block in blocks:
        for op, operands in block:
            for position in TABLE[op].reads:
                register = operands[position]
                if not 0 <= register < TEMPORARY:
                    continue
                limit = _UNLIMITED
                if op in _COMPARISONS and (bound := constant_of(operands[1 - position])) is not None:
                    limit = max(bound, -1) + 1
                limits[register] = max(limits.get(register, 0), limit)
    return limits


def _of_entities(program: Program, blocks: list[list[Instruction]]) -> dict[int, int]:
    """What instructions read of entities by name of the field; only what code alone reads may be left out."""
    named = {operands[2] for block in blocks for op, operands in block if op == Op.FIELD}
    read = [fields for fields in _OF_MEMBERS if not named.isdisjoint(fields)]
    return dict.fromkeys(_of_members(program, *read), _UNLIMITED)


def _of_members(program: Program, *groups: tuple[Field, ...]) -> list[int]:
    """Registers of these fields of the members of the cast."""
    members = [number for number, entity in enumerate(program.entities) if entity.role != "object"]
    fields = [field for group in groups for field in group]
    return [FIRST_ENTITY + ENTITY_FIELDS * number + field for number in members for field in fields]


def _clocks(program: Program) -> list[int]:
    return _frame_column(program, FrameColumn.CLOCK)


def _frame_column(program: Program, column: FrameColumn) -> list[int]:
    return program.table(Header.FRAME_AT)[:, column].tolist()  # type: ignore[no-any-return]


def _choices(blocks: list[list[Instruction]]) -> tuple[tuple[int, int], ...] | None:
    """The sites that are drawn at, with how many results each has; None where that is not fixed."""
    drawn = {(op, operands) for block in blocks for op, operands in block if op in _DRAWS | _CHANCY}
    if any(op not in (*_TURNS, Op.CHOOSE) for op, _ in drawn):
        return None
    return tuple(sorted({(site, 2 if op in _TURNS else count) for op, (_, count, site) in drawn}))


def _draws_matter(program: Program, block: list[Instruction]) -> bool:
    """Whether chance decides anything there but which line is said, where lines are only words to their hearer."""
    if any(op in _CHANCY for op, _ in block):
        return True
    selected = _selected(block)
    drawn = {word for op, operands in block if op in _DRAWS for word in TABLE[op].written(operands)}
    while True:
        more = {
            operands[0]
            for number, (op, operands) in enumerate(block)
            if op in _VALUES and _reads(drawn, block[number - (number in selected) : number + 1])
        } - drawn
        if not more:
            break
        drawn |= more
    if any(0 <= register < TEMPORARY for register in drawn):
        return True
    for number, (op, operands) in enumerate(block):
        if op in _VALUES or op in _DRAWS or number + 1 in selected:
            continue
        used = [position for position in TABLE[op].reads if _reads_at(drawn, op, position, operands)]
        if used and not (op in (Op.SAY, Op.ANSWER) and used == [1] and not _lines_are_triggers(program)):
            return True
    return False


def _selected(block: list[Instruction]) -> set[int]:
    """Numbers of the values that are computed or not as the comparison before them says: they follow from it too."""
    return {
        number
        for number, ((test, (_, _, skipped)), (op, _)) in enumerate(pairwise(block), 1)
        if test in _COMPARISONS and skipped == 1 and op in _VALUES
    }


def _reads(drawn: set[int], instructions: list[Instruction]) -> bool:
    return any(
        _reads_at(drawn, op, position, operands)
        for op, operands in instructions
        for position in TABLE[op].reads
    )


def _reads_at(drawn: set[int], op: Op, position: int, operands: tuple[int, int, int]) -> bool:
    return not drawn.isdisjoint(TABLE[op].read_at(position, operands))


def _lines_are_triggers(program: Program) -> bool:
    return bool((program.table(Header.LINE_AT)[:, LineColumn.CLASS] % SECRET > 1).any())
