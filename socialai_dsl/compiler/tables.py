"""The last two passes: the layout of a program's tables, and the proof that it stays within its bounds.

Every address is in range, every skip goes forward, every path ends; each operand is followed as an interval of values,
so an entity, a line, a status or a coordinate that could be out of range is found before the program runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import pairwise, product
from math import prod
from typing import Any

import numpy as np

from socialai_dsl.compiler.assembler import seat_path, state_names
from socialai_dsl.compiler.expressions import Lines
from socialai_dsl.compiler.instruction_checks import (
    PathFacts,
    inbox_registers,
    problem_of,
    written_temporaries,
)
from socialai_dsl.compiler.lowering import Allocation, FrameCode, LoweredCode
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    MAX_SIDE,
    NO_GESTURE,
    SECRET,
    TESTS,
    Body,
    EntityColumn,
    EntityName,
    Field,
    Flag,
    FrameColumn,
    Header,
    LineColumn,
    Op,
    Outcome,
    Program,
    Register,
    SeatColumn,
    SeatRegister,
    TypeColumn,
    pack_cell,
)
from socialai_dsl.program.instructions import ANYTHING, TABLE
from socialai_dsl.program.program import bounds_of
from socialai_dsl.semantics.free_cells import interior_cells
from socialai_dsl.semantics.plans import CheckedScenario, Entity, LookPlan, RoomPlan
from socialai_dsl.semantics.terms import ObjectType
from socialai_dsl.vocabulary import ACTIONS, COLORS, EMPTY, NPC, WALL, normal
from socialai_dsl.widths import MOST_SEATS, MOST_WORDS, WHOLE_REGISTER


def program_of(allocation: Allocation, lowered: LoweredCode) -> Program:
    """Lay out everything of a scenario in the words of a program; see program.Header for the order.

    Registers of what is heard and of the log are reserved here, since only now it is known how many there are.
    """
    checked, lines, code = allocation.checked, allocation.lines, allocation.code
    registers, classes, sites = allocation.registers, allocation.classes, allocation.sites
    frames, rules = lowered.frames, tuple(allocation.rules)
    length = lines.history_length
    heard_size = max(1, len(lines.speakers))
    heard = registers.reserve(heard_size)
    log_size = length // min((len(tokens) for tokens in lines.tokens), default=length)
    log = registers.reserve(log_size)
    seats = [
        _seat_row(allocation, number, says, registers.reserve(heard_size), registers.reserve(log_size))
        for number, says in zip(checked.seated, lowered.seats, strict=True)
    ]

    header = dict.fromkeys(Header, 0)
    body: list[int] = []

    def table(offset: Header, words: list[int]) -> None:
        header[offset] = Header.END + len(body)
        body.extend(words)

    types = _TypeTable(checked)
    if seats:
        body += [len(seats), *(word for row in seats for word in row), *_pairs_said(allocation)]
    table(Header.CODE_AT, [word for row in code.instructions for word in row])
    table(Header.ACTION_AT, [*(ACTIONS.index(action) for action in checked.actions), len(ACTIONS) - 1])
    table(Header.CLASS_AT, classes.of_pair)
    accepts = {number: registers.by_path[path] for number, path in checked.accepting}
    rows = (_entity_row(entity, types, accepts) for entity in checked.entities)
    table(Header.ENTITY_AT, [word for row in rows for word in row])
    table(Header.TYPE_AT, [word for row in types.rows for word in row])
    table(Header.ROOM_AT, room_templates(checked.room))
    table(Header.FRAME_AT, _frame_rows(allocation, frames))
    table(Header.STATE_AT, [word for frame in frames for row in frame.rows for word in row])
    table(Header.OUTCOME_AT, lowered.outcomes)
    table(Header.LINE_AT, _line_rows(lines))
    table(Header.TOKEN_AT, [token for tokens in lines.tokens for token in tokens])
    table(Header.SITE_AT, sites.words())
    table(Header.CLASS_SET_AT, classes.set_words())
    shown = [look for look in checked.looks if look.shown]
    body += _look_rows(allocation, shown)

    header |= lowered.entries | {
        Header.SIZE: Header.END + len(body),
        Header.REGISTERS: max(registers.next_free, registers.end),
        Header.CANVAS_WIDTH: checked.room.canvas[0],
        Header.CANVAS_HEIGHT: checked.room.canvas[1],
        Header.ENTITIES: len(checked.entities),
        Header.NPCS: sum(entity.role == "npc" for entity in checked.entities),
        Header.PRIMITIVES: len(checked.actions),
        Header.TEMPLATES: len(checked.sentences.templates),
        Header.NOUNS: checked.sentences.fillings,
        Header.CLASSES: classes.count,
        Header.HORIZON: checked.horizon,
        Header.FLAGS: _flags(allocation),
        Header.TOKENS: length,
        Header.LOG: log,
        Header.LOG_SIZE: log_size,
        Header.HEARD: heard,
        Header.HEARD_SIZE: heard_size,
        Header.INBOX: allocation.inbox,
        Header.INBOX_SIZE: allocation.inbox_size,
        Header.FRAMES: len(frames),
        Header.DEADLY: types.deadly,
        Header.MIN_WIDTH: checked.room.width[0],
        Header.MIN_HEIGHT: checked.room.height[0],
        Header.HEIGHTS: checked.room.height[1] - checked.room.height[0] + 1,
        Header.OUTSIDE: WALL_CELL,
        Header.INSTRUCTIONS: len(code.instructions),
        Header.LINES: len(lines.texts),
        Header.STATES: sum(len(frame.rows) for frame in frames),
        Header.SITES: len(sites.rows),
        Header.TYPE_ROWS: len(types.rows),
        Header.COUNTERS: len(rules) + len(checked.outcomes) + 3,
        Header.AGENT_SAYS: lines.agent_says,
        Header.SLOPE: checked.slope,
        Header.EACH_STEP: checked.each_step,
        Header.CLASS_SETS: len(classes.sets),
        Header.CLASS_SET_WORDS: classes.words_of_a_set,
        Header.CHANNELS: checked.channels + checked.shows_carrying,
    }
    words = np.array([*(header[word] for word in Header if word != Header.END), *body], dtype=np.int64)
    # Boards are sets of bits, so a word may use the sign bit.
    assert -(1 << 31) <= words.min() <= words.max() < 1 << 32, "internal: a number that no word holds"
    return Program(
        words=words.astype(np.uint64).astype(np.uint32).view(np.int32),
        name=checked.name,
        actions=checked.actions,
        sentences=checked.sentences,
        entities=tuple(_entity_name(entity) for entity in checked.entities),
        registers=tuple(registers.names),
        lines=tuple(lines.texts),
        line_speakers=_speakers_of(lines),
        outcome_table=(
            *(Outcome(o.name, o.success, o.condition.span, o.seats) for o in checked.outcomes),
            Outcome("deadly", False),
            Outcome("timeout", False),
        ),
        rules=rules,
        vocabulary=lines.vocabulary,
        source_map=tuple(code.spans),
        labels=dict(code.labels),
        looks=tuple((look.name, look.words) for look in shown),
        names_shown=checked.names_shown,
        tones=_tones(checked.entities),
        session=checked.session,
    )


def _tones(entities: Iterable[Entity]) -> tuple[str, ...]:
    """The words of all tones, each once."""
    return tuple(
        dict.fromkeys(word for one in entities if one.tone is not None for word in one.tone.type.words)
    )


def _speakers_of(lines: Lines) -> tuple[int, ...]:
    """Who says each line."""
    speaker_of = {line: speaker for speaker, own in lines.speakers.items() for line in own}
    return tuple(speaker_of[line] for line in range(len(lines.texts)))


def _look_rows(allocation: Allocation, shown: list[LookPlan]) -> list[int]:
    """The look table: for each entity the register of each look that the picture shows, 0 where it has none."""
    registers = [dict(look.registers) for look in shown]
    paths = (own.get(entity.number) for entity in allocation.checked.entities for own in registers)
    return [0 if path is None else allocation.registers.by_path[path] for path in paths]


def _flags(allocation: Allocation) -> int:
    checked = allocation.checked
    flags = {
        Flag.NPCS_HIDDEN: checked.npcs_hidden,
        Flag.PICTURE_BEFORE_NPCS: checked.picture_before_npcs,
        Flag.AGENT_FRAME: any(frame.entity == 0 for frame in checked.frames),
        Flag.OWN_VOICE: checked.own_voice,
        Flag.EGOCENTRIC: checked.egocentric,
        Flag.OCCLUSION: checked.room.occlusion,
        Flag.ROLLS: any(entity.type and entity.type.rolls for entity in checked.entities),
        Flag.HEARD_BY: allocation.classes.speakers_matter,
        Flag.SETTLE_ALWAYS: allocation.computed.settle_always,
        Flag.SHOWS_CARRYING: checked.shows_carrying,
        Flag.CARRYING: any(entity.carryable for entity in checked.entities),
        Flag.SEATS: bool(checked.seated),
        Flag.SEATS_HIDDEN: checked.seats_hidden,
    }
    return sum(flag for flag, on in flags.items() if on)


def _seat_row(allocation: Allocation, number: int, says: int, heard: int, log: int) -> list[int]:
    """One row of the seat table, of the seat of a member of the cast."""
    member, by_path = allocation.checked.entities[number], allocation.registers.by_path
    row = {
        SeatColumn.ENTITY: number,
        SeatColumn.FIRST: by_path[seat_path(member, SeatRegister.TAKEN)],
        SeatColumn.HEARD: heard,
        SeatColumn.LOG: log,
        SeatColumn.SAYS: says,
    }
    return _in_columns(SeatColumn, row)


def _pairs_said(allocation: Allocation) -> list[int]:
    """For each line 1 + the pair of the grammar that says the same, 0 if there is none."""
    lines = allocation.lines
    pairs = {normal(text): 1 + k for k, text in reversed([*enumerate(lines.grammar)])}
    return [pairs.get(normal(text), 0) for text in lines.said]


def _frame_rows(allocation: Allocation, frames: list[FrameCode]) -> list[int]:
    words = []
    first_row = 0
    for made, frame in zip(frames, allocation.checked.frames, strict=True):
        row = {
            FrameColumn.ENTITY: frame.entity,
            FrameColumn.STATE: allocation.registers.by_path[f"{frame.member}.frame"],
            FrameColumn.CLOCK: allocation.registers.by_path[f"{frame.member}.clock"],
            FrameColumn.ROWS: first_row,
            FrameColumn.STATES: len(state_names(frame)),
            FrameColumn.INBOX: allocation.inbox_of[frame.member],
            FrameColumn.PERCEIVE: made.perceive,
            FrameColumn.DEFERRED: made.deferred,
        }
        first_row += len(made.rows)
        words += _in_columns(FrameColumn, row)
    return words


def _line_rows(lines: Lines) -> list[int]:
    words = []
    first_token = 0
    for line, (tokens, number, noun) in enumerate(zip(lines.tokens, lines.classes, lines.nouns, strict=True)):
        row = {
            LineColumn.FIRST_TOKEN: first_token,
            LineColumn.TOKENS: len(tokens),
            LineColumn.CLASS: number + (SECRET if line in lines.kept_secret else 0),
            LineColumn.NOUN: noun,
        }
        words += _in_columns(LineColumn, row)
        first_token += len(tokens)
    return words


def _in_columns(columns: type[IntEnum], row: Mapping[Any, int]) -> list[int]:
    """A row of a table, whose last column says only how many there are; 0 where nothing is given."""
    return [row.get(column, 0) for column in columns if column.name != "COLUMNS"]


class _TypeTable:
    """One row for each status of each object type in the scenario, one for NPCs, one for the agent."""

    def __init__(self, checked: CheckedScenario) -> None:
        self.rows: list[list[int]] = []
        self.deadly = 0
        self.agent = self._add({TypeColumn.CODE: EMPTY})
        self.npc = self._add({TypeColumn.CODE: NPC, TypeColumn.TRANSPARENT: 1})
        self._first: dict[ObjectType, int] = {}
        for kind in [
            *(e.type for e in checked.entities if e.type),
            *(kind for kind, _, _ in checked.room.build),
        ]:
            if kind not in self._first:
                self._first[kind] = self._object(kind)

    def _add(self, row: Mapping[TypeColumn, int]) -> int:
        self.rows.append(_in_columns(TypeColumn, row))
        return len(self.rows) - 1

    def _object(self, kind: ObjectType) -> int:
        self.deadly |= int(kind.deadly) << kind.code
        first = len(self.rows)
        for status in range(len(kind.states)):
            shown, orientation = kind.shown.get(status, (status, 0))
            self._add(
                {
                    TypeColumn.CODE: kind.code,
                    TypeColumn.STATUS: shown,
                    TypeColumn.ORIENTATION: orientation,
                    TypeColumn.WALKABLE: int(status in kind.walkable),
                    TypeColumn.TRANSPARENT: int(status in kind.transparent),
                    TypeColumn.TOGGLED: kind.toggled.get(status, status),
                    TypeColumn.PUSHED: kind.pushed.get(status, status),
                    TypeColumn.ROLLS: 1 + kind.initial if status in kind.rolls else 0,
                }
            )
        return first

    def of(self, entity: Entity) -> int:
        """First row of an entity's type."""
        if entity.type is not None:
            return self._first[entity.type]
        return self.npc if entity.role == "npc" else self.agent


def _entity_row(entity: Entity, types: _TypeTable, accepts: Mapping[int, int]) -> list[int]:
    """One row of the entity table; `accepts`: member of the cast -> the register that says whether it takes things."""
    row = {
        EntityColumn.TYPE: types.of(entity),
        EntityColumn.KIND: entity.kind_code,
        EntityColumn.NEAR: entity.near,
        EntityColumn.FAR: entity.far,
        EntityColumn.MANNERS: entity.audible | entity.pushed_by_bodies << 1,
        EntityColumn.VIEW: entity.view,
        EntityColumn.PUSHED_BY: entity.pushed_by_rolling | entity.carryable << 1,
    }
    if entity.number in accepts:
        row[EntityColumn.ACCEPTS] = accepts[entity.number]
    return _in_columns(EntityColumn, row)


def _entity_name(entity: Entity) -> EntityName:
    kind = entity.type.name if entity.type else entity.kind
    states = entity.type.states if entity.type else ()
    return EntityName(entity.key, entity.index, entity.role, kind, states)


# -- room templates --------------------------------------------------------------------------------------------


EMPTY_CELL = pack_cell(EMPTY)
WALL_CELL = pack_cell(WALL, COLORS.index("grey"))


def room_templates(room: RoomPlan) -> list[int]:
    """The room table, row by row: sizes by width, then height."""
    (low_width, high_width), (low_height, high_height) = room.width, room.height
    return [
        word
        for width in range(low_width, high_width + 1)
        for height in range(low_height, high_height + 1)
        for word in _template(room, width, height)
    ]


def _template(room: RoomPlan, width: int, height: int) -> list[int]:
    columns, rows = room.canvas
    cells = [[EMPTY_CELL] * columns for _ in range(rows)]
    solid = [(1 << columns) - 1] * rows
    floor, opaque = [0] * rows, [0] * rows
    for x, y in product(range(width), range(height)):
        if x in (0, width - 1) or y in (0, height - 1):
            cells[y][x] = WALL_CELL
            opaque[y] |= 1 << x
        else:
            solid[y] &= ~(1 << x)
            floor[y] |= 1 << x
    for kind, region, _span in room.build:
        for x, y in interior_cells(region, (width, height)):
            _build(kind, x, y, cells, solid, floor, opaque)
    columns_too = [sum((row >> x & 1) << y for y, row in enumerate(opaque)) for x in range(columns)]
    return [*(cell for row in cells for cell in row), WALL_CELL, *solid, *floor, *opaque, *columns_too]


def _build(
    kind: ObjectType,
    x: int,
    y: int,
    cells: list[list[int]],
    solid: list[int],
    floor: list[int],
    opaque: list[int],
) -> None:
    shown = kind.shown.get(kind.initial, (kind.initial, 0))
    cells[y][x] = pack_cell(kind.code, kind.color, *shown)
    floor[y] &= ~(1 << x)
    for rows, here in (
        (solid, kind.initial not in kind.walkable),
        (opaque, kind.initial not in kind.transparent),
    ):
        rows[y] = rows[y] | 1 << x if here else rows[y] & ~(1 << x)


# -- the verifier: no program makes the engine leave its arrays or run for ever; nothing runs that is not proven


class InvalidProgramError(AssertionError):
    """A program that is not proven safe. Its author is the compiler, so it is our mistake and not an author's."""

    def __init__(self, message: str) -> None:
        super().__init__(f"internal: the program is refused: {message}")


_ENTRIES = [word for word in Header if word.name.endswith("_PC")]


@dataclass(frozen=True)
class _Loop:
    """A loop: the address of its END_EACH, which temporaries it writes, and what was known before it."""

    end: int
    written: frozenset[int] = field(compare=False)
    before: PathFacts = field(compare=False)


@dataclass
class _Path:
    """What is known before an instruction, and the loop it lies in."""

    known: PathFacts
    loop: _Loop | None


class _Code:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.code = program.code.tolist()
        self.ranges = bounds_of(program)
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
        self.written_by_default = named | {int(Register.CHANGED)}
        self.of_agent = _of_agent(program)
        self.is_agents = False

    def check(self) -> None:
        """Raise InvalidProgramError unless every block that a table names is safe from its start to its HALTs."""
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
        yield from ((pc, Header.LINE_AT) for pc in self.program.seat_table[:, SeatColumn.SAYS].tolist())
        of_frames = self.program.table(Header.FRAME_AT)[:, [FrameColumn.PERCEIVE, FrameColumn.DEFERRED]]
        yield from ((pc, Header.FRAME_AT) for pc in of_frames.ravel().tolist())

    def _block(self, start: int, entry: Header) -> None:
        pending: dict[int, _Path] = {
            start: _Path(PathFacts(self.ranges, has_room=entry != Header.RESET_PC), None)
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

    def _next(self, pc: int, path: _Path, entry: Header) -> Iterator[tuple[int, PathFacts, _Loop | None]]:
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
        if op == Op.REWARD and (entry != Header.RULES_PC or loop is not None):
            raise InvalidProgramError(f"at {pc}: REWARD where code may run more than once a step")
        before = known.copy()
        writable = self.writable.get(entry, self.written_by_default)
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

    def _enter_loop(self, pc: int, outer: _Loop | None, known: PathFacts, before: PathFacts) -> _Loop:
        """Temporaries written inside may hold anything at the start of the next round."""
        length = self.code[pc][3]
        end = pc + 1 + length
        if outer is not None or length < 1 or end >= len(self.code) or self.code[end][0] != Op.END_EACH:
            raise InvalidProgramError(f"at {pc}: a loop without its own end, or inside another")
        inside = {
            temporary
            for instruction in self.code[pc + 1 : end]
            for temporary in written_temporaries(*instruction)
        }
        for temporary in inside & known.temporaries.keys():
            known.temporaries[temporary] = ANYTHING
        own = written_temporaries(*self.code[pc])
        return _Loop(end, frozenset(inside.union(own)), before)


def _of_agent(program: Program) -> frozenset[int]:
    """Addresses of the code that chooses what the agent does, if it follows a frame."""
    if not program.header(Header.FLAGS) & Flag.AGENT_FRAME or not program.header(Header.FRAMES):
        return frozenset()
    frame = program.table(Header.FRAME_AT)[0].tolist()
    first, count = frame[FrameColumn.ROWS], frame[FrameColumn.STATES]
    return frozenset(program.table(Header.STATE_AT)[first : first + count].ravel().tolist())


# -- what the verifier asks of the tables --------------------------------------------------------------------


def verify(program: Program) -> None:
    """Raise InvalidProgramError unless the program is proven safe."""
    _header(program)
    _entities(program)
    _looks(program)
    _frames(program)
    _lines(program)
    _inside(program, Header.ACTION_AT, program.header(Header.PRIMITIVES) + 1, 0, 7)
    _seats(program)
    pairs = program.header(Header.TEMPLATES) * program.header(Header.NOUNS)
    _inside(program, Header.CLASS_AT, pairs, 1, program.header(Header.CLASSES) - 1)
    _Code(program).check()


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise InvalidProgramError(message)


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
    more = bool(h(Header.FLAGS) & Flag.SHOWS_CARRYING)
    _require(h(Header.CHANNELS) - more in (4, 6, 8), f"a picture of {h(Header.CHANNELS)} channels")
    _require(0 <= h(Header.SLOPE) <= 1000, f"SLOPE is {h(Header.SLOPE)}")
    for offset in _OFFSETS:
        _require(Header.END <= h(offset) <= len(program.words), f"{offset.name} is {h(offset)}")
    for offset in _OFFSETS:
        size = prod(program.shape(offset)) if offset != Header.TOKEN_AT else 0
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
            *(
                (row[column], row[column] + h(size), f"{name} of seat {seat}")
                for seat, row in enumerate(program.seat_table.tolist(), 1)
                for column, size, name in (
                    (SeatColumn.HEARD, Header.HEARD_SIZE, "lines heard"),
                    (SeatColumn.LOG, Header.LOG_SIZE, "log"),
                )
            ),
        ]
    )
    for (_, end, name), (start, _, following) in pairwise(areas):
        _require(end <= start, f"registers of {name} reach into {following}")
    _require(areas[-1][1] <= h(Header.REGISTERS) < 8192, "registers beyond the end of the row")
    _require(h(Header.INBOX_SIZE) >= 1 + h(Header.FRAMES), "an inbox could overflow")
    named = [name.register for name in program.registers]
    _require(len(set(named)) == len(named), "a register has two names")
    for own in program.registers:
        fits = WHOLE_REGISTER[0] <= own.low <= own.high <= WHOLE_REGISTER[1]
        _require(fits, f"{own.path} holds {own.low}..{own.high}, which no register does")
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
    truths = {name.register for name in program.registers if (name.low, name.high) == (0, 1)}
    _require(len(program.entities) == h(Header.ENTITIES), "entities without names")
    for number, entity in enumerate(program.entities):
        row = program.table(Header.ENTITY_AT)[number].tolist()
        first = row[EntityColumn.TYPE]
        statuses = max(1, len(entity.states))
        _require(first >= 0 and first + statuses <= len(types), f"the type of {entity} is out of range")
        kind, manners, view, pushed_by = (
            row[column]
            for column in (
                EntityColumn.KIND,
                EntityColumn.MANNERS,
                EntityColumn.VIEW,
                EntityColumn.PUSHED_BY,
            )
        )
        _require(0 <= kind < 256, f"the status code of {entity} does not fit into the picture")
        _require(manners in range(4), f"{entity} has the manners {manners}")
        _require(0 < view <= 2 * MAX_SIDE, f"{entity} sees {view} cells far")
        if entity.role == "object":
            _require(pushed_by in range(4), f"{entity} is pushed by {pushed_by}")
        else:
            known = pushed_by == 0 or pushed_by in truths
            _require(known, f"{entity} accepts what register {pushed_by} says")
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


def _looks(program: Program) -> None:
    """Every look is in a register that holds one of its words."""
    table, ranges = program.look_table, {name.register: (name.low, name.high) for name in program.registers}
    _require(table.shape == (program.header(Header.ENTITIES), len(program.looks)), "looks without words")
    for (name, words), registers in zip(program.looks, table.T.tolist(), strict=True):
        known = all(ranges.get(register) == (0, len(words) - 1) for register in registers if register)
        _require(known and len(words) < NO_GESTURE, f"a register of the look `{name}` holds something else")


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


def _seats(program: Program) -> None:
    """Every seat is that of a member of its own, with registers that hold what the engine writes there."""
    h = program.header
    if not h(Header.FLAGS) & Flag.SEATS:
        return
    table, pairs = program.seat_table, h(Header.TEMPLATES) * h(Header.NOUNS)
    start = Header.END + 1 + table.size
    _require(0 < len(table) < MOST_SEATS, f"{len(table)} seats besides the agent's")
    _require(start + h(Header.LINES) <= h(Header.CODE_AT), "the seat table reaches into the code")
    said = program.pairs_said
    _require(bool(((said >= 0) & (said <= pairs)).all()), "a line says what the grammar cannot")
    members = table[:, SeatColumn.ENTITY].tolist()
    _require(
        members == sorted(set(members)) and members[0] > 0 and members[-1] <= h(Header.NPCS),
        f"seats of {members}",
    )
    _require(0 < h(Header.AGENT_SAYS) <= h(Header.LINES) + 1 - pairs, "what the agent says is no line")
    ranges = {name.register: (name.low, name.high) for name in program.registers}
    wanted = {
        SeatRegister.TAKEN: (0, 1),
        SeatRegister.ACTION: (0, int(Body.NONE)),
        SeatRegister.SHARE: (0, 100),
    }
    wanted[SeatRegister.UTTERANCE] = (0, pairs)
    for row in table.tolist():
        first = row[SeatColumn.FIRST]
        _require(first > 0 and first + SeatRegister.COUNT <= h(Header.REGISTERS), "a seat without registers")
        for which, interval in wanted.items():
            fits = ranges.get(first + which) == interval
            _require(fits, f"register {first + which} does not hold the {which.name} of a seat")
        free = {*range(first, first + SeatRegister.COUNT)} - {
            first + which for which in (*wanted, SeatRegister.BONUS)
        }
        _require(free.isdisjoint(ranges), "a named register lies in a seat")


def _lines(program: Program) -> None:
    h = program.header
    tokens_end = h(Header.SITE_AT)
    _require(len(program.lines) == h(Header.LINES), "lines without texts")
    _require(len(program.vocabulary) <= MOST_WORDS, "more words than tokens tell apart")
    _require(h(Header.TOKENS) >= 8, "no room for a history")
    for number, (first, count, heard_as, noun) in enumerate(program.table(Header.LINE_AT).tolist()):
        _require(1 <= count <= h(Header.TOKENS), f"line {number} does not fit into the history")
        inside = first >= 0 and h(Header.TOKEN_AT) + first + count <= tokens_end
        _require(inside, f"words of line {number} are out of range")
        _require(
            count * (h(Header.LOG_SIZE) + 1) > h(Header.TOKENS),
            f"the log cannot hold line {number} often enough",
        )
        _require(
            1 <= heard_as % SECRET < h(Header.CLASSES) and heard_as < 2 * SECRET,
            f"line {number} has no utterance class",
        )
        _require(-1 <= noun < h(Header.NOUNS), f"line {number} has a noun that does not exist")
        tokens = program.words[h(Header.TOKEN_AT) + first : h(Header.TOKEN_AT) + first + count]
        known = bool(((tokens >= 1) & (tokens < len(program.vocabulary))).all())
        _require(known, f"line {number} has a word outside the vocabulary")
