"""Proves that a program cannot make the engine leave its arrays or run for ever; nothing runs that is not proven."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import prod

from socialai_dsl.compiler.instruction_checks import (
    Known,
    Ranges,
    inbox_registers,
    problem_of,
    written_temporaries,
)
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    MAX_SIDE,
    TESTS,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
    TypeColumn,
)
from socialai_dsl.program.instructions import ANYTHING, TABLE


class InvalidProgramError(AssertionError):
    """A program that is not proven safe. Its author is the compiler, so it is our mistake and not an author's."""

    def __init__(self, message: str) -> None:
        super().__init__(f"internal: the program is refused: {message}")


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


# -- tables --------------------------------------------------------------------------------------------------


def verify(program: Program) -> None:
    """Raise InvalidProgramError unless the program is proven safe."""
    _header(program)
    _entities(program)
    _frames(program)
    _lines(program)
    _inside(program, Header.ACTION_AT, program.header(Header.PRIMITIVES) + 1, 0, 7)
    pairs = program.header(Header.TEMPLATES) * program.header(Header.NOUNS)
    _inside(program, Header.CLASS_AT, pairs, 1, program.header(Header.CLASSES) - 1)
    verify_code(program)


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise InvalidProgramError(message)


_TABLES = (
    *(Header.CODE_AT, Header.ACTION_AT, Header.CLASS_AT, Header.ENTITY_AT, Header.TYPE_AT, Header.ROOM_AT),
    *(Header.FRAME_AT, Header.STATE_AT, Header.OUTCOME_AT, Header.LINE_AT, Header.SITE_AT),
    Header.CLASS_SET_AT,
)


def _sizes(program: Program) -> dict[Header, int]:
    return {table: prod(program.shape(table)) for table in _TABLES}


def _header(program: Program) -> None:
    h = program.header
    _require(len(program.words) >= Header.END, "the header is cut off")
    _require(
        h(Header.SIZE) == len(program.words), f"{len(program.words)} words, the header says {h(Header.SIZE)}"
    )
    for word in (Header.CANVAS_WIDTH, Header.CANVAS_HEIGHT):
        _require(3 <= h(word) <= MAX_SIDE, f"{word.name} is {h(word)}")
    for word in (
        Header.ENTITIES,
        Header.PRIMITIVES,
        Header.TEMPLATES,
        Header.NOUNS,
        Header.HORIZON,
        Header.HEIGHTS,
    ):
        _require(0 < h(word) < 32768, f"{word.name} is {h(word)}")
    _require(h(Header.CLASSES) >= 2 and h(Header.NPCS) < h(Header.ENTITIES), "too few classes or entities")
    _require(
        h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1 <= h(Header.CANVAS_HEIGHT),
        "a room is higher than the canvas",
    )
    sets, words = h(Header.CLASS_SETS), h(Header.CLASS_SET_WORDS)
    _require(0 <= sets < 32768 and (not sets or 32 * words >= h(Header.CLASSES)), "a class in no set")
    _require(h(Header.CHANNELS) in (4, 6), f"a picture of {h(Header.CHANNELS)} channels")
    _require(0 <= h(Header.SLOPE) <= 1000, f"SLOPE is {h(Header.SLOPE)}")
    for offset in _OFFSETS:
        _require(Header.END <= h(offset) <= len(program.words), f"{offset.name} is {h(offset)}")
    for offset, size in _sizes(program).items():
        _require(h(offset) + size <= len(program.words), f"the table at {offset.name} is cut off")
    _registers(program)


_OFFSETS = [word for word in Header if word.name.endswith("_AT")]


def _registers(program: Program) -> None:
    """Entities, inboxes, lines heard and the log lie inside the row and do not overlap."""
    h = program.header
    areas = sorted(
        [
            (0, FIRST_ENTITY + ENTITY_FIELDS * h(Header.ENTITIES), "entities"),
            (h(Header.INBOX), h(Header.INBOX) + h(Header.FRAMES) * inbox_registers(program), "inboxes"),
            (h(Header.HEARD), h(Header.HEARD) + h(Header.HEARD_SIZE), "lines heard"),
            (h(Header.LOG), h(Header.LOG) + h(Header.LOG_SIZE), "log"),
        ]
    )
    for (_, end, name), (start, _, following) in pairwise(areas):
        _require(end <= start, f"registers of {name} reach into {following}")
    _require(areas[-1][1] <= h(Header.REGISTERS) < 8192, "registers beyond the end of the row")
    _require(h(Header.INBOX_SIZE) >= 1 + h(Header.FRAMES), "an inbox could overflow")
    named = [name.register for name in program.registers]
    _require(len(set(named)) == len(named), "a register has two names")
    for start, end, name in areas:
        _require(not any(start <= register < end for register in named), f"a named register lies in {name}")


def _inside(program: Program, table: Header, count: int, low: int, high: int) -> None:
    words = program.words[program.header(table) : program.header(table) + count]
    _require(
        bool(((words >= low) & (words <= high)).all()), f"{table.name} holds a number outside {low}..{high}"
    )


def _entities(program: Program) -> None:
    h = program.header
    types = program.table(Header.TYPE_AT).tolist()
    _require(len(program.entities) == h(Header.ENTITIES), "entities without names")
    for number, entity in enumerate(program.entities):
        row = program.table(Header.ENTITY_AT)[number].tolist()
        first = row[EntityColumn.TYPE]
        statuses = max(1, len(entity.states))
        _require(first >= 0 and first + statuses <= len(types), f"the type of {entity} is out of range")
        kind, view, pushed_by = (
            row[column] for column in (EntityColumn.KIND, EntityColumn.VIEW, EntityColumn.PUSHED_BY)
        )
        _require(0 <= kind < 256, f"the status code of {entity} does not fit into the picture")
        _require(0 < view <= 2 * MAX_SIDE, f"{entity} sees {view} cells far")
        _require(pushed_by in (0, 1), f"{entity} is pushed by {pushed_by}")
        for status in types[first : first + statuses]:
            toggled, pushed, rolls = (
                status[column] for column in (TypeColumn.TOGGLED, TypeColumn.PUSHED, TypeColumn.ROLLS)
            )
            _require(0 <= toggled < statuses, f"a toggle gives {entity} a status it does not have")
            _require(0 <= pushed < statuses, f"a push gives {entity} a status it does not have")
            _require(0 <= rolls <= statuses, f"what stops {entity} gives it a status it does not have")
    for number, status in enumerate(types):
        _require(0 < status[TypeColumn.CODE] < 32, f"type row {number} has no type code")
        for column in (TypeColumn.STATUS, TypeColumn.ORIENTATION):
            _require(0 <= status[column] < 256, f"type row {number} does not fit into the picture")


def _frames(program: Program) -> None:
    h = program.header
    named = {name.register: name for name in program.registers}
    for number, row in enumerate(program.table(Header.FRAME_AT).tolist()):
        _require(
            0 <= row[FrameColumn.ENTITY] <= h(Header.NPCS), f"frame {number} moves what is no cast member"
        )
        _require(row[FrameColumn.STATES] > 0, f"frame {number} has no state")
        last = row[FrameColumn.ROWS] + row[FrameColumn.STATES]
        _require(
            row[FrameColumn.ROWS] >= 0 and last <= h(Header.STATES),
            f"states of frame {number} are out of range",
        )
        state, clock = named.get(row[FrameColumn.STATE]), named.get(row[FrameColumn.CLOCK])
        _require(state is not None and state.low == 0, f"frame {number} has no register for its state")
        assert state is not None
        _require(state.high < row[FrameColumn.STATES], f"frame {number} may be in a state it does not have")
        _require(clock is not None, f"frame {number} has no clock")
        inbox = h(Header.INBOX) + number * inbox_registers(program)
        _require(row[FrameColumn.INBOX] == inbox, f"frame {number} has no inbox of its own")


def _lines(program: Program) -> None:
    h = program.header
    tokens_end = h(Header.SITE_AT)
    _require(len(program.lines) == h(Header.LINES) < 32767, "lines without texts")
    _require(h(Header.TOKENS) >= 8, "no room for a history")
    for number, (first, count, heard_as, noun) in enumerate(program.table(Header.LINE_AT).tolist()):
        _require(1 <= count <= h(Header.TOKENS), f"line {number} does not fit into the history")
        inside = first >= 0 and h(Header.TOKEN_AT) + first + count <= tokens_end
        _require(inside, f"words of line {number} are out of range")
        _require(
            count * (h(Header.LOG_SIZE) + 1) > h(Header.TOKENS),
            f"the log cannot hold line {number} often enough",
        )
        _require(1 <= heard_as < h(Header.CLASSES), f"line {number} has no utterance class")
        _require(-1 <= noun < h(Header.NOUNS), f"line {number} has a noun that does not exist")
        tokens = program.words[h(Header.TOKEN_AT) + first : h(Header.TOKEN_AT) + first + count]
        known = bool(((tokens >= 1) & (tokens < len(program.vocabulary))).all())
        _require(known, f"line {number} has a word outside the vocabulary")
