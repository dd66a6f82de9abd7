"""Follows every path through the code of a program with intervals for values, one pass since skips only go forward."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from socialai_dsl.compiler.instruction_checks import problem_of, written_temporaries
from socialai_dsl.compiler.intervals import Known, Ranges
from socialai_dsl.compiler.invalid import InvalidProgramError
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TESTS,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
)
from socialai_dsl.program.instructions import TABLE
from socialai_dsl.program.ranges import ANYTHING

_ENTRIES = (
    Header.RESET_PC,
    Header.SETTLE_PC,
    Header.RULES_PC,
    Header.BEFORE_PC,
    Header.LINKS_PC,
    Header.REQUIRE_PC,
    Header.TICK_PC,
)


def verify_code(program: Program) -> None:
    """Raise InvalidProgramError unless every block that a table names is safe from its start to its HALTs."""
    _Code(program).check()


@dataclass(frozen=True)
class _Loop:
    """A loop: the address of its END_EACH, which temporaries it writes, and what was known before it."""

    end: int
    written: frozenset[int] = field(compare=False)
    before: Known = field(compare=False)


@dataclass
class _Path:
    """What is known before an instruction, and the loop it lies in."""

    known: Known
    loop: _Loop | None


class _Code:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.code = program.code.tolist()
        self.ranges = Ranges.of(program)
        named = frozenset(name.register for name in program.registers)
        set_up = frozenset(
            FIRST_ENTITY + ENTITY_FIELDS * entity + which
            for entity in range(program.header(Header.ENTITIES))
            for which in (Field.DIR, Field.COLOR, Field.STATUS)
        )
        self.writable = {
            Header.RESET_PC: named | set_up,
            Header.REQUIRE_PC: frozenset((int(Register.ACCEPTED),)),
        }
        self.named = named
        self.of_agent = _of_agent(program)
        self.is_agents = False

    def check(self) -> None:
        if not self.code or self.code[0][0] != Op.HALT:
            raise InvalidProgramError("address 0 is not a HALT")
        for pc, entry in sorted(set(self._entries())):
            if not 0 <= pc < len(self.code):
                raise InvalidProgramError(f"an entry at {pc}, outside of the code")
            self.is_agents = pc in self.of_agent
            self._block(pc, entry)

    def _entries(self) -> Iterator[tuple[int, Header]]:
        """Addresses where code starts, and the word or table of the header that names them."""
        for word in _ENTRIES:
            yield self.program.header(word), word
        for table in (Header.STATE_AT, Header.OUTCOME_AT):
            yield from ((pc, table) for pc in self.program.table(table).ravel().tolist())
        for pc in _of_frames(self.program):
            yield pc, Header.FRAME_AT

    def _block(self, start: int, entry: Header) -> None:
        pending: dict[int, _Path] = {
            start: _Path(Known(self.ranges, has_room=entry != Header.RESET_PC), None)
        }
        while pending:
            pc = min(pending)
            path = pending.pop(pc)
            if pc >= len(self.code):
                raise InvalidProgramError(f"the code that starts at {start} runs over the end of the table")
            for target, known, loop in self._next(pc, path, entry):
                if target <= pc:
                    raise InvalidProgramError(f"at {pc}: a jump backward to {target}")
                known_there = pending.get(target)
                if known_there is not None and known_there.loop != loop:
                    raise InvalidProgramError(f"at {pc}: a jump into or out of a loop")
                pending[target] = _Path(known.joined(known_there.known if known_there else None), loop)

    def _next(self, pc: int, path: _Path, entry: Header) -> Iterator[tuple[int, Known, _Loop | None]]:
        op, a, b, c = self.code[pc]
        known, loop = path.known, path.loop
        if op not in TABLE:
            raise InvalidProgramError(f"at {pc}: op {op} is not in the instruction table")
        if TABLE[op].setup and entry != Header.RESET_PC:
            raise InvalidProgramError(f"at {pc}: {Op(op).name} outside of reset code")
        if loop is not None and pc > loop.end:
            raise InvalidProgramError(f"at {pc}: a loop is left past its end")
        if op == Op.HALT:
            if loop is not None:
                raise InvalidProgramError(f"at {pc}: HALT inside a loop")
            return
        before = known.copy()
        writable = self.writable.get(entry, self.named)
        problem = problem_of((op, a, b, c), self.program, known, writable, self.is_agents)
        if problem:
            raise InvalidProgramError(f"at {pc}, {Op(op).name} {a} {b} {c}: {problem}")
        if op == Op.SKIP or op in TESTS:
            if c < 0:
                raise InvalidProgramError(f"at {pc}: a skip of {c} goes backward")
            yield pc + 1 + c, known, loop
            if op == Op.SKIP:
                return
        if op == Op.EACH_CELL:
            loop = self._enter_loop(pc, loop, known, before)
        elif op == Op.DROP_CELL and loop is None:
            raise InvalidProgramError(f"at {pc}: DROP_CELL outside of a loop")
        elif op == Op.END_EACH:
            if loop is None or loop.end != pc:
                raise InvalidProgramError(f"at {pc}: the end of no loop")
            known, loop = known.after_loop(loop.written, loop.before), None
        yield pc + 1, known, loop

    def _enter_loop(self, pc: int, outer: _Loop | None, known: Known, before: Known) -> _Loop:
        """Temporaries written inside may hold anything at the start of the next round."""
        length = self.code[pc][3]
        end = pc + 1 + length
        if outer is not None or length < 1 or end >= len(self.code) or self.code[end][0] != Op.END_EACH:
            raise InvalidProgramError(f"at {pc}: a loop without its own end, or inside another")
        inside = {
            temporary for instruction in self.code[pc + 1 : end] for temporary in self._written(instruction)
        }
        for temporary in inside & known.temporaries.keys():
            known.temporaries[temporary] = ANYTHING
        own = self._written(self.code[pc])
        return _Loop(end, frozenset(inside.union(own)), before)

    @staticmethod
    def _written(instruction: list[int]) -> range:
        """What an op that is in no table writes is not asked: it is refused when it is reached."""
        return written_temporaries(*instruction) if instruction[0] in TABLE else range(0)


def _of_frames(program: Program) -> Iterator[int]:
    """Addresses in the frame table."""
    for row in program.table(Header.FRAME_AT).tolist():
        yield from (row[FrameColumn.PERCEIVE], row[FrameColumn.DEFERRED])


def _of_agent(program: Program) -> frozenset[int]:
    """Addresses of the code that chooses what the agent does, if it follows a frame."""
    if not program.header(Header.FLAGS) & Flag.AGENT_FRAME or not program.header(Header.FRAMES):
        return frozenset()
    frame = program.table(Header.FRAME_AT)[0].tolist()
    first, count = frame[FrameColumn.ROWS], frame[FrameColumn.STATES]
    return frozenset(program.table(Header.STATE_AT)[first : first + count].ravel().tolist())
