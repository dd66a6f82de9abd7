"""Checks one instruction against its entry in the instruction table, and keeps the ranges of what it writes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from socialai_dsl.program import (
    BOARDS,
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    Body,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
    constant_of,
    room_words,
)
from socialai_dsl.program.instructions import (
    ANYTHING,
    TABLE,
    Bounds,
    Instruction,
    Interval,
    Kind,
    Operand,
    hull,
)
from socialai_dsl.widths import WHOLE_REGISTER


class PathFacts:
    """What is known on a path: ranges of temporaries, boards that are filled (what is absent was never written), and
    whether the room has its size.
    """

    def __init__(self, ranges: Bounds, has_room: bool) -> None:
        self.ranges = ranges
        self.has_room = has_room
        self.temporaries: dict[int, Interval] = {}
        self.boards: set[int] = set()

    def copy(self) -> PathFacts:
        """The same, to be changed by itself."""
        known = PathFacts(self.ranges, self.has_room)
        known.temporaries, known.boards = dict(self.temporaries), set(self.boards)
        return known

    def value(self, operand: int) -> Interval | None:
        """The range of an operand; None if it is nothing that can be read."""
        if (known := constant_of(operand)) is not None:
            return known, known
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

    def joined(self, other: PathFacts | None) -> PathFacts:
        """The knowledge where two paths meet."""
        known = self.copy()
        if other is not None:
            both = self.temporaries.keys() & other.temporaries.keys()
            known.temporaries = {k: hull(self.temporaries[k], other.temporaries[k]) for k in both}
            known.boards &= other.boards
            known.has_room &= other.has_room
        return known

    def after_loop(self, written: Iterable[int], before: PathFacts) -> PathFacts:
        """The knowledge behind a loop that ran any number of times, including none.

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


# -- one instruction -----------------------------------------------------------------------------------------


_SETTABLE: Final = (Field.DIR, Field.COLOR, Field.POKED, Field.LAST, Field.POINTING, Field.INSIDE)
_FREE: Final = frozenset((Kind.UNUSED, Kind.SKIP, Kind.TARGET))
"""Operands that need no look: nothing, what the code's shape proves, and what is checked when it is written."""


def problem_of(
    instruction: tuple[int, int, int, int],
    program: Program,
    known: PathFacts,
    writable: frozenset[int],
    is_agents: bool = False,
) -> str | None:
    """The problem of an instruction, given `known`, or None; then `known` includes its writes.

    `is_agents`: it belongs to the frame of the agent, who can do less than NPCs.
    """
    op, *words = instruction
    return _Check(TABLE[Op(op)], words, program, known, writable, is_agents).problem()


def written_temporaries(op: int, a: int, b: int, c: int) -> range:
    """Indices of the temporaries that an instruction writes, should its operands name temporaries.

    An op that is in no table is refused when it is reached.
    """
    written = TABLE[Op(op)].written((a, b, c)) if op in TABLE else range(0)
    if not TEMPORARY <= written.start < TEMPORARY + TEMPORARIES:
        return range(0)
    return range(written.start - TEMPORARY, written.stop - TEMPORARY)


@dataclass
class _Check:
    """Whether one instruction is safe, given what is known before it."""

    entry: Instruction
    words: list[int]
    program: Program
    known: PathFacts
    writable: frozenset[int]
    is_agents: bool

    def h(self, word: Header) -> int:
        """One word of the program's header."""
        return self.program.header(word)

    def problem(self) -> str | None:
        """The problem, or None."""
        for operand, word in zip(self.entry.operands, self.words, strict=True):
            if problem := self._operand(operand, word):
                return problem
        own = _OWN_CHECKS.get(self.entry.op)
        return (own(self) if own is not None else None) or self._fill() or self._write()

    # --- operands ---

    def _operand(self, operand: Operand, word: int) -> str | None:
        kind = operand.kind
        if kind in _FREE:
            return None
        check = _KINDS.get(kind)
        assert check is not None, f"internal: operands of kind {kind.name} are not checked"
        return check(self, operand, word)

    def _value(self, operand: Operand, word: int) -> str | None:
        return self.within(word, operand.low, self._greatest(operand))

    def within(self, word: int, low: int = ANYTHING[0], high: int = ANYTHING[1]) -> str | None:
        """Whether a value can be read and is in a range."""
        interval = self.known.value(word)
        if interval is None:
            return f"operand {word} is nothing that can be read here"
        if interval[0] < low or interval[1] > high:
            return f"operand {word} is {interval[0]}..{interval[1]}, not within {low}..{high}"
        return None

    def _entity(self, _: Operand, word: int) -> str | None:
        return self.within(word, 0, self.h(Header.ENTITIES) - 1)

    def _place(self, _: Operand, word: int) -> str | None:
        """An entity, or a cell or none; never something that may be either an entity or a cell."""
        interval = self.known.value(word)
        if interval is not None and interval[0] >= CELL - 1:
            return self.within(word, CELL - 1, self.known.ranges.last_cell)
        return self._entity(_, word)

    def _updated(self, operand: Operand, word: int) -> str | None:
        return self._temporaries(operand, word) or self._value(operand, word)

    def _temporaries(self, operand: Operand, word: int) -> str | None:
        """Temporaries one behind the other."""
        count = len(self.entry.results) if operand.kind is Kind.TEMPORARIES else operand.count
        return self.literal(word, TEMPORARY, TEMPORARY + TEMPORARIES - count)

    def _coordinates(self, operand: Operand, word: int) -> str | None:
        values = (self.within(word + k, operand.low, operand.high) for k in range(operand.count))
        return self._temporaries(operand, word) or next(filter(None, values), None)

    def _board(self, operand: Operand, word: int) -> str | None:
        if problem := self.literal(word, 0, BOARDS - 1):
            return problem
        filled = operand.kind is Kind.FILLED or word in self.known.boards
        return None if filled else f"board {word} was never filled"

    def _site(self, operand: Operand, word: int) -> str | None:
        row = word & 65535 if operand.meaning == "packed" else word
        return self.literal(row, 0, self.h(Header.SITES) - 1)

    def _inbox(self, _: Operand, word: int) -> str | None:
        size = inbox_registers(self.program)
        inboxes = range(self.h(Header.INBOX), self.h(Header.INBOX) + self.h(Header.FRAMES) * size)
        return None if word in inboxes[::size] else f"{word} is not the first register of an inbox"

    def _register(self, _: Operand, word: int) -> str | None:
        return self.literal(word, 0, self.h(Header.REGISTERS) - 1)

    def _literal(self, operand: Operand, word: int) -> str | None:
        return self.literal(word, operand.low, self._greatest(operand))

    def _greatest(self, operand: Operand) -> int:
        """The greatest number that an operand may be: of what the program lists, the last."""
        match operand.meaning:
            case "frame":
                return self.h(Header.FRAMES) - 1
            case "line":
                return self.h(Header.LINES) - 1
            case "outcome":
                return len(self.program.outcome_table) - 3
            case "rule":
                return len(self.program.rules) - 1
            case "utterance class":
                return self.h(Header.CLASSES) - 1
        return operand.high

    @staticmethod
    def literal(value: int, low: int, high: int) -> str | None:
        """Whether a literal word is in a range."""
        return None if low <= value <= high else f"{value} is not within {low}..{high}"

    def interval(self, word: int) -> Interval:
        """The range of an operand that can be read."""
        interval = self.known.value(word)
        assert interval is not None, "internal: an operand is used before it is checked"
        return interval

    # --- what it writes ---

    def _fill(self) -> str | None:
        for operand, word in zip(self.entry.operands, self.words, strict=True):
            if operand.kind is Kind.FILLED:
                self.known.boards.add(word)
        return None

    def _write(self) -> str | None:
        position = self.entry.writes
        if position is None:
            return None
        target = self.words[position]
        if target < TEMPORARY and target not in self.writable:
            return f"writes to {target}, which is neither a temporary nor a register for it to write"
        operands = [
            self.interval(word) if k in self.entry.reads and operand.kind is not Kind.INBOX else (word, word)
            for k, (operand, word) in enumerate(zip(self.entry.operands, self.words, strict=True))
        ]
        results = [rule(self.known.ranges, operands) for rule in self.entry.results]
        writes = (self.known.write(target + k, result) for k, result in enumerate(results))
        return next(filter(None, writes), None)

    # --- what single instructions ask besides ---

    def _nearest(self) -> str | None:
        first, last = self.words[2] >> 8, self.words[2] & 255
        return self.literal(last, 0, self.h(Header.ENTITIES) - 1) or self.literal(first, 0, last)

    def _draw_other(self) -> str | None:
        return self.literal(self.words[2] >> 24, 2, 127)

    def _heard(self) -> str | None:
        if not self.h(Header.FLAGS) & Flag.HEARD_BY:
            return "nobody notes who said what"
        return self.literal(self.words[2], 0, self.h(Header.CLASS_SETS) - 1)

    def _store_at(self) -> str | None:
        if problem := self._row():
            return problem
        low, high = self.interval(self.words[2])
        for register in range(self.words[1] + low, self.words[1] + high + 1):
            if register not in self.writable:
                return f"may write to register {register}, which is not for it to write"
            if problem := self.known.write(register, self.interval(self.words[0])):
                return problem
        return None

    def _row(self) -> str | None:
        """Whether all that may be meant are registers of the row."""
        low, high = self.interval(self.words[2])
        last = self.h(Header.REGISTERS) - 1
        return self.literal(self.words[1] + low, 0, last) or self.literal(self.words[1] + high, 0, last)

    def _set_field(self) -> str | None:
        a, which, c = self.words
        if which not in _SETTABLE:
            return f"field {which} is not to be set like this"
        first, last = self.interval(a)
        if which == Field.POINTING and first <= self.h(Header.NPCS) and (problem := self.within(c, 0, 4)):
            return problem
        for entity in range(first, last + 1):
            register = FIRST_ENTITY + ENTITY_FIELDS * entity + which
            if problem := self.known.write(register, self.interval(c)):
                return problem
        return None

    def _become(self) -> str | None:
        first, last = self.interval(self.words[0])
        statuses = min(max(1, len(self.program.entities[entity].states)) for entity in range(first, last + 1))
        return self.within(self.words[1], 0, statuses - 1)

    def _goto(self) -> str | None:
        return self._state(self.words[0], self.words[1])

    def _state(self, frame: int, state: int) -> str | None:
        states = int(self.program.table(Header.FRAME_AT)[frame, FrameColumn.STATES])
        return self.literal(state, 0, states - 1)

    def _answer(self) -> str | None:
        frame, state = self.words[2] >> 8, (self.words[2] & 255) - 1
        if not self.words[2]:
            return None
        return self.literal(frame, 0, self.h(Header.FRAMES) - 1) or self._state(frame, state)

    def _body(self) -> str | None:
        stop = (Body.STOP_POINTING, Body.STOP_POINTING)
        if not self.is_agents and self.known.value(self.words[0]) == stop:
            return None
        return self.within(self.words[0], 0, Body.NONE)

    def _choose(self) -> str | None:
        actions, count, _ = self.words
        if any(actions >> 4 * k & 15 > Body.NONE for k in range(count)):
            return f"{actions} holds what is no action"
        return None

    def _point(self) -> str | None:
        if self.is_agents:
            return "the agent cannot point"
        where, none = self.words[1], CELL - 1
        is_cell = self.interval(where)[0] >= none
        problem = self.within(where, *((none, self.known.ranges.last_cell) if is_cell else (0, 3)))
        return problem or self.within(self.words[0], 1, self.h(Header.NPCS))

    def _put(self) -> str | None:
        x = self.words[1]
        return self.within(x, -1, self.h(Header.CANVAS_WIDTH) - 1) or self.within(
            x + 1, -1, self.h(Header.CANVAS_HEIGHT) - 1
        )

    def _make_room(self) -> str | None:
        h, (width, height, _) = self.h, self.words
        low, high = h(Header.MIN_HEIGHT), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1
        problem = self.within(width, h(Header.MIN_WIDTH), h(Header.CANVAS_WIDTH))
        if problem := problem or self.within(height, low, high):
            return problem
        size = room_words(h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT))
        templates = (self.interval(width)[1] - h(Header.MIN_WIDTH) + 1) * h(Header.HEIGHTS)
        self.known.has_room = True
        fits = h(Header.ROOM_AT) + templates * size <= len(self.program.words)
        return None if fits else "a room without a template"

    def _draw_room(self) -> str | None:
        return None if self.known.has_room else "there is no room yet"


_KINDS: Final[dict[Kind, Callable[[_Check, Operand, int], str | None]]] = {
    Kind.VALUE: _Check._value,
    Kind.ENTITY: _Check._entity,
    Kind.PLACE: _Check._place,
    Kind.UPDATED: _Check._updated,
    Kind.TEMPORARIES: _Check._temporaries,
    Kind.COORDINATES: _Check._coordinates,
    Kind.BOARD: _Check._board,
    Kind.FILLED: _Check._board,
    Kind.CHANGED: _Check._board,
    Kind.SITE: _Check._site,
    Kind.INBOX: _Check._inbox,
    Kind.REGISTER: _Check._register,
    Kind.LITERAL: _Check._literal,
}

_OWN_CHECKS: Final[dict[Op, Callable[[_Check], str | None]]] = {
    Op.NEAREST: _Check._nearest,
    Op.DRAW_OTHER: _Check._draw_other,
    Op.HEARD_FROM: _Check._heard,
    Op.HEARD_NOUN: _Check._heard,
    Op.READ_AT: _Check._row,
    Op.STORE_AT: _Check._store_at,
    Op.SET_FIELD: _Check._set_field,
    Op.BECOME: _Check._become,
    Op.GOTO: _Check._goto,
    Op.ANSWER: _Check._answer,
    Op.BODY: _Check._body,
    Op.CHOOSE: _Check._choose,
    Op.POINT: _Check._point,
    Op.PUT: _Check._put,
    Op.MAKE_ROOM: _Check._make_room,
    Op.DRAW_ROOM: _Check._draw_room,
}
"""What the kinds of an instruction's operands do not say."""
