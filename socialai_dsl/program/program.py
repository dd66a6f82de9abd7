"""A compiled scenario: its words, the scenario's names for them, and its listing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from socialai_dsl.program.format import (
    CELL,
    CHANNELS,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    GESTURES,
    LOOKS,
    TEMPORARY,
    Body,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    LineColumn,
    Register,
    SeatColumn,
    TypeColumn,
    constant_of,
)
from socialai_dsl.program.instructions import TABLE, Bounds, Interval, Kind, Op
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import ACTIONS, NOUN, Sentences
from socialai_dsl.widths import WHOLE_REGISTER

_AS_WRITTEN = frozenset((Kind.LITERAL, Kind.SITE, Kind.BOARD, Kind.FILLED, Kind.CHANGED))
"""Operands whose word is shown as it is."""

_ENTRIES = ("reset", "require", "before", "links", "settle", "rules", "tick")


@dataclass(frozen=True, slots=True)
class EntityName:
    """How the scenario calls an entity. `key` is the cast member's or object's name, `index` its place in a group."""

    key: str
    index: int | None
    role: str  # agent, npc or object
    type: str  # object type, or the NPC's kind
    states: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self.key if self.index is None else f"{self.key}[{self.index}]"


@dataclass(frozen=True, slots=True)
class RegisterName:
    """How the scenario calls a register of its own, and what its numbers mean.

    Attributes:
        path: address in a layout: `let.exit`, `wizard.frame`, `wizard.clock`, `wizard.name`, `jill.goal`,
            `teacher.one_of`, `switches[0].initial`; an element of a sequence or memory is `let.dance[0].move` and
            `let.dance[0].utterance`; how many a memory holds is `memory.attempt.filled`; that of one of a group is
            `ann.trust(bob)`.
        register: its number.
        values: word of each value from `low` on; empty for plain numbers.
        low, high: range of its values.
        kind: what its values are: int, bool, color, direction, action, entity (by number), text, noun, status,
            utterance (0 silence, else 1 + template * fillings + filling), cell (CELL + 32 * y + x).
        fleeting: whether it tells nothing between steps: it is written in every step before it is read, follows
            from the others, or only saves work.
        nothing: the value that stands for nothing, where the register may hold nothing; it is within low..high.
    """

    path: str
    register: int
    values: tuple[str, ...] = ()
    low: int = 0
    high: int = 0
    kind: str = "int"
    fleeting: bool = False
    nothing: int | None = None

    @property
    def least(self) -> int:
        """The least of the values that are something."""
        return self.low if self.nothing is None else self.nothing + 1


@dataclass(frozen=True, slots=True)
class Outcome:
    """One way an episode ends: `name` is the outcome's id, else `success@46` (line of the file).

    `seats`: whose success it is, by number; None: that of all.
    """

    name: str
    success: bool
    span: Span | None = None
    seats: tuple[int, ...] | None = None


def room_words(width: int, height: int) -> int:
    """Words of one room template on a canvas: its cells, one cell off the canvas, rows and columns of bits.

    For each line which cells are solid, then which are floor, then which are opaque; for each column which are opaque.
    """
    return width * height + 1 + 3 * height + width


@dataclass(frozen=True, eq=False)
class Program:
    """A compiled scenario: integers for the engine, names for people.

    Attributes:
        words: int32 (Header.SIZE,), laid out as `socialai_dsl.program` says; never changed.
        name: canonical name of the scenario with its variants.
        actions: words of the body actions, by index.
        sentences: what the agent can say.
        entities: the agent, the NPCs and the objects, by number.
        registers: the registers of the scenario itself.
        lines: text of each line that can be heard, by number.
        line_speakers: who says each of them, the number of an entity.
        outcome_table: the ways an episode can end, by index; the last two are `deadly` and `timeout`.
        rules: name of each counted rule.
        vocabulary: word of each token id; 0 pads, 1 is unknown.
        source_map: one span (or None) for each instruction.
        labels: heading of the block that starts at a pc.
        looks: name and words of each look that the image shows.
        names_shown: whether a line begins with the name of who says it.
        tones: words of the look that is heard before a line, in brackets.
        session: how many episodes in a row share some of what is drawn.
    """

    words: npt.NDArray[np.int32]
    name: str
    actions: tuple[str, ...]
    sentences: Sentences
    entities: tuple[EntityName, ...]
    registers: tuple[RegisterName, ...]
    lines: tuple[str, ...]
    line_speakers: tuple[int, ...]
    outcome_table: tuple[Outcome, ...]
    rules: tuple[str, ...]
    vocabulary: tuple[str, ...]
    source_map: Sequence[Span | None] = field(repr=False)
    labels: Mapping[int, str] = field(repr=False)
    looks: tuple[tuple[str, tuple[str, ...]], ...] = ()
    names_shown: bool = True
    tones: tuple[str, ...] = ()
    session: int = 1

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: nothing changes it."""
        return self

    def header(self, word: Header) -> int:
        """One word of the header."""
        return int(self.words[word])

    @property
    def templates(self) -> tuple[str, ...]:
        """The templates of what can be said."""
        return self.sentences.templates

    @property
    def nouns(self) -> tuple[str, ...]:
        """What `<noun>` can be; of a grammar with `slots` the words of each, one slot after the other."""
        return tuple(word for slot in self.sentences.slots for word in slot.words)

    @cached_property
    def outcomes(self) -> list[str]:
        """Names of the ways an episode can end, by index."""
        return [outcome.name for outcome in self.outcome_table]

    @cached_property
    def sha256(self) -> str:
        """Digest of everything that decides what an environment does and shows."""
        digest = sha256(self.words.tobytes())
        for texts in (self.actions, self.templates, self.nouns, self.lines, self.outcomes, self.vocabulary):
            digest.update("\x1f".join(texts).encode())
            digest.update(b"\x1e")
        for slot in self.sentences.slots:
            if slot.name != NOUN:
                digest.update("\x1f".join((slot.name, *slot.words)).encode())
        for name, words in self.looks:
            digest.update("\x1f".join((name, *words)).encode())
        for outcome in self.outcome_table:
            if outcome.seats is not None:
                digest.update(f"{outcome.name} {outcome.seats}".encode())
        return digest.hexdigest()

    @property
    def seat_table(self) -> npt.NDArray[np.int32]:
        """The seats but the agent's, int32 (seats, SeatColumn.COLUMNS)."""
        count = int(self.words[Header.END]) if self.header(Header.FLAGS) & Flag.SEATS else 0
        start, columns = Header.END + 1, int(SeatColumn.COLUMNS)
        return self.words[start : start + count * columns].reshape(count, columns)

    @property
    def seats(self) -> tuple[EntityName, ...]:
        """The members of the cast that have a seat, the agent first."""
        return (self.entities[0], *(self.entities[row[SeatColumn.ENTITY]] for row in self.seat_table))

    @property
    def pairs_said(self) -> npt.NDArray[np.int32]:
        """For each line 1 + the pair of the grammar that says the same, else 0; where there are several seats."""
        start = Header.END + 1 + self.seat_table.size
        return self.words[start : start + self.header(Header.LINES)]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels of its image."""
        carrying = bool(self.header(Header.FLAGS) & Flag.SHOWS_CARRYING)
        gestures = GESTURES[: self.header(Header.CHANNELS) - carrying - len(LOOKS)]
        shown = {*LOOKS, *gestures, *(["carrying"] if carrying else [])}
        return (*(name for name in CHANNELS if name in shown), *(name for name, _ in self.looks))

    @property
    def look_table(self) -> npt.NDArray[np.int32]:
        """The register of each look of each entity, 0 where it has none, int32 (entities, looks)."""
        h = self.header
        start = h(Header.CLASS_SET_AT) + h(Header.CLASS_SETS) * h(Header.CLASS_SET_WORDS)
        return self.words[start:].reshape(h(Header.ENTITIES), len(self.looks))

    @property
    def code(self) -> npt.NDArray[np.int32]:
        """The instructions, int32 (I, 4)."""
        return self.table(Header.CODE_AT)

    def shape(self, table: Header) -> tuple[int, int]:
        """Rows and columns of the table that a word of the header is the offset of, such as `Header.FRAME_AT`."""
        h = self.header
        width, height = h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT)
        return {
            Header.CODE_AT: (h(Header.INSTRUCTIONS), 4),
            Header.ACTION_AT: (h(Header.PRIMITIVES) + 1, 1),
            Header.CLASS_AT: (h(Header.TEMPLATES), h(Header.NOUNS)),
            Header.ENTITY_AT: (h(Header.ENTITIES), int(EntityColumn.COLUMNS)),
            Header.TYPE_AT: (h(Header.TYPE_ROWS), int(TypeColumn.COLUMNS)),
            Header.ROOM_AT: (h(Header.HEIGHTS), room_words(width, height)),
            Header.FRAME_AT: (h(Header.FRAMES), int(FrameColumn.COLUMNS)),
            Header.STATE_AT: (h(Header.STATES), 1 + 2 * (h(Header.CLASSES) + 1)),
            Header.OUTCOME_AT: (h(Header.CLASSES), len(ACTIONS)),
            Header.LINE_AT: (h(Header.LINES), int(LineColumn.COLUMNS)),
            Header.SITE_AT: (h(Header.SITES), 2),
            Header.CLASS_SET_AT: (h(Header.CLASS_SETS), h(Header.CLASS_SET_WORDS)),
        }[table]

    def table(self, table: Header) -> npt.NDArray[np.int32]:
        """A table as a view of the words, int32 (rows, columns); see `EntityColumn` and its kin for the columns."""
        start, (rows, columns) = self.header(table), self.shape(table)
        return self.words[start : start + rows * columns].reshape(rows, columns)

    def listing(self) -> str:
        """The program as text: sizes, one instruction a line with file:line and a heading for each block, tables."""
        return "\n".join([*_head(self), "", *_code(self), "", *_tables(self)]) + "\n"


# -- the range of every register: writes are proven to keep it, and a snapshot must lie within it ---------------


def bounds_of(program: Program) -> Bounds:
    """Bounds that follow from the header, the entities and the names of the program's own registers."""
    h = program.header
    ranges = [WHOLE_REGISTER] * h(Header.REGISTERS)
    for register, interval in _common(program).items():
        ranges[register] = interval
    for entity in range(h(Header.ENTITIES)):
        for which, interval in _fields(program, entity).items():
            ranges[FIRST_ENTITY + ENTITY_FIELDS * entity + which] = interval
    for name in program.registers:
        ranges[name.register] = name.low, name.high
    return Bounds(
        tuple(ranges), h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT), h(Header.NPCS), h(Header.NOUNS)
    )


def _common(program: Program) -> dict[Register, Interval]:
    """Of the registers that code may read."""
    h = program.header
    return {
        Register.T: (0, h(Header.HORIZON)),
        Register.WIDTH: (h(Header.MIN_WIDTH), h(Header.CANVAS_WIDTH)),
        Register.HEIGHT: (h(Header.MIN_HEIGHT), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1),
        Register.ACTION: (0, Body.NONE),
        Register.LAST_TURN: (-1, Body.STOP_POINTING),
        Register.CLASS: (0, h(Header.CLASSES) - 1),
        Register.TEMPLATE: (-1, h(Header.TEMPLATES) - 1),
        Register.NOUN: (-1, h(Header.NOUNS) - 1),
        Register.UTTERANCE: (0, h(Header.TEMPLATES) * h(Header.NOUNS)),
        Register.CHANGED: (0, 1),
        Register.ACCEPTED: (0, 1),
        Register.POKED: (-1, h(Header.ENTITIES) - 1),
    }


def _fields(program: Program, number: int) -> dict[Field, Interval]:
    h, entity = program.header, program.entities[number]
    is_object = entity.role == "object"
    kind = int(program.table(Header.ENTITY_AT)[number, EntityColumn.KIND])
    return {
        Field.X: (-1, h(Header.CANVAS_WIDTH) - 1),
        Field.Y: (-1, h(Header.CANVAS_HEIGHT) - 1),
        Field.DIR: (0, 3),
        Field.COLOR: (0, 5),
        # The status of an NPC is its code in the picture, that of the agent is 0.
        Field.STATUS: (0, max(1, len(entity.states)) - 1 if is_object else kind),
        Field.GONE: (0, 1),
        Field.POKED: (0, 1),
        Field.LAST: (0, Body.STOP_POINTING),
        # Of an object who carries it, of an NPC perhaps a cell.
        Field.POINTING: (0, 1 + h(Header.NPCS) if is_object else CELL + 32 * h(Header.CANVAS_HEIGHT) - 1),
        Field.INSIDE: (0, h(Header.ENTITIES) - 1),
    }


# -- as text ----------------------------------------------------------------------------------------------------


def _head(program: Program) -> list[str]:
    h = program.header
    return [
        f"program {program.name}",
        f"  {h(Header.SIZE)} words, {h(Header.REGISTERS)} registers, {h(Header.INSTRUCTIONS)} instructions, "
        f"{h(Header.CLASSES)} utterance classes, {h(Header.LINES)} lines, history of {h(Header.TOKENS)} tokens",
        f"  canvas {h(Header.CANVAS_WIDTH)}x{h(Header.CANVAS_HEIGHT)}, horizon {h(Header.HORIZON)}",
        "  " + ", ".join(f"{name} at {pc}" for name in _ENTRIES if (pc := h(Header[f"{name.upper()}_PC"]))),
    ]


def _code(program: Program) -> list[str]:
    names = _Names(program)
    rows = []
    for pc, ((op, *operands), span) in enumerate(zip(program.code.tolist(), program.source_map, strict=True)):
        if pc in program.labels:
            rows += ["", f"{program.labels[pc]}:"]
        text = f"{pc:5d}  {Op(op).name:<16}{names.operands(Op(op), pc, operands)}"
        place = f"{span.file.rsplit('/', 1)[-1]}:{span.line}" if span else ""
        rows.append(f"{text:<66}  {place}".rstrip())
    return rows


def _tables(program: Program) -> list[str]:
    return [
        "frames:",
        *_frames(program),
        "lines:",
        *(f"{number:5d}  {text}" for number, text in enumerate(program.lines)),
        "outcomes:",
        *(f"{number:5d}  {name}" for number, name in enumerate(program.outcomes)),
        "vocabulary:",
        "       " + " ".join(program.vocabulary),
    ]


def _frames(program: Program) -> list[str]:
    """Each state with the addresses of its activity, its `first` and its `then`, by class of utterance heard."""
    classes = program.header(Header.CLASSES) + 1
    states = program.table(Header.STATE_AT).tolist()
    rows = []
    for frame in program.table(Header.FRAME_AT).tolist():
        entity, first = frame[FrameColumn.ENTITY], frame[FrameColumn.ROWS]
        shared = {"perceive": FrameColumn.PERCEIVE, "deferred": FrameColumn.DEFERRED}
        rows += [
            f"       {program.entities[entity]}: {name} {frame[column]}"
            for name, column in shared.items()
            if frame[column]
        ]
        register = next(n for n in program.registers if n.register == frame[FrameColumn.STATE])
        for k in range(frame[FrameColumn.STATES]):
            activity, *rest = states[first + k]
            rows.append(
                f"       {program.entities[entity]}.{register.values[k]}: do {activity}, "
                f"first {rest[:classes]}, then {rest[classes:]}"
            )
    return rows


class _Names:
    """Operands in the scenario's own words."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.registers = {int(register): register.name.lower() for register in Register}
        for number, entity in enumerate(program.entities):
            for which in Field:
                self.registers[FIRST_ENTITY + ENTITY_FIELDS * number + which] = (
                    f"{entity}.{which.name.lower()}"
                )
        self.registers |= {name.register: name.path for name in program.registers}

    def operands(self, op: Op, pc: int, words: list[int]) -> str:
        """The operands of one instruction; skips as the address they lead to."""
        entry = TABLE[op]
        shown = [
            self._operand(op, position, word, words[1])
            for position, word in enumerate(words)
            if entry.operands[position].kind not in (Kind.UNUSED, Kind.SKIP)
        ]
        if entry.skips:
            shown.append(f"-> {pc + 1 + words[2]}")
        return ", ".join(shown)

    def _operand(self, op: Op, position: int, word: int, count: int) -> str:
        operand = TABLE[op].operands[position]
        match operand.meaning:
            case "rule":
                return self.program.rules[word]
            case "outcome":
                return self.program.outcomes[word]
            case "goal":
                # Frame and state, as a GOTO shows them.
                return f"{word >> 8}, {(word & 255) - 1}" if word else "0"
            case "field":
                return Field(word).name.lower()
            case "first and last entity":
                return f"{self._place(word >> 8)}..{self._place(word & 255)}"
            case "packed":
                return f"{word >> 16 & 255}..{(word >> 16 & 255) + (word >> 24) - 1}, {word & 65535}"
            case "actions":
                return "|".join(ACTIONS[word >> 4 * k & 15] for k in range(count))
        if operand.kind in _AS_WRITTEN:
            return str(word)
        if (value := constant_of(word)) is not None:
            is_place = operand.kind in (Kind.ENTITY, Kind.PLACE)
            return self._place(value) if is_place else f"#{value}"
        if word >= TEMPORARY:
            return f"%{word - TEMPORARY}"
        return self.registers.get(word, f"r{word}")

    def _place(self, number: int) -> str:
        """An entity by its name, a cell by its coordinates."""
        if number < CELL:
            return str(self.program.entities[number])
        return f"({(number - CELL) % 32}, {(number - CELL) // 32})"
