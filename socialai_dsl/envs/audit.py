"""Checks registers from outside: the engine checks no index, so a snapshot must hold possible values only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import (
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    Body,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    Program,
    Register,
    room_words,
)

Bounds = NDArray[np.int16]


def first_unsound(program: Program, registers: NDArray[np.int16]) -> str | None:
    """The first problem of the registers, int16 (E, R), of environments that play a program; None without one."""
    low, high = _bounds(program)
    own = registers[:, : len(low)]
    wrong = np.argwhere((own < low) | (own > high))
    if len(wrong):
        row, register = wrong[0]
        return (
            f"register {register} of row {row}: got {own[row, register]}, "
            f"expected a number from {low[register]} to {high[register]}"
        )
    heights = program.header(Header.HEIGHTS)
    across = own[:, Register.WIDTH].astype(int) - program.header(Header.MIN_WIDTH)
    down = own[:, Register.HEIGHT].astype(int) - program.header(Header.MIN_HEIGHT)
    other_room = np.flatnonzero(own[:, Register.ROOM] != across * heights + down)
    return f"row {other_room[0]}: the size of the room does not fit it" if len(other_room) else None


def _bounds(program: Program) -> tuple[Bounds, Bounds]:
    """Least and greatest value of each register."""
    count = program.header(Header.REGISTERS)
    low = np.full(count, np.iinfo(np.int16).min, np.int16)
    high = np.full(count, np.iinfo(np.int16).max, np.int16)
    for first, size, least, most in (*_common(program), *_entities(program), *_speech(program)):
        low[first : first + size], high[first : first + size] = least, most
    for name in program.registers:
        low[name.register], high[name.register] = name.low, name.high
    for first, size, least, most in _frames(program):
        low[first : first + size], high[first : first + size] = least, most
    return low, high


Range = tuple[int, int, int, int]
"""First register, how many, least, greatest value."""


def _common(program: Program) -> list[Range]:
    h = program.header
    lines = h(Header.LINES)
    greatest = {
        Register.T: (0, h(Header.HORIZON)),
        Register.WIDTH: (h(Header.MIN_WIDTH), h(Header.CANVAS_WIDTH)),
        Register.HEIGHT: (h(Header.MIN_HEIGHT), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1),
        Register.ROOM: (0, _rooms_that_fit(program) - 1),
        Register.ACTION: (0, int(Body.NONE)),
        Register.CLASS: (0, h(Header.CLASSES) - 1),
        Register.TEMPLATE: (-1, h(Header.TEMPLATES) - 1),
        Register.NOUN: (-1, h(Header.NOUNS) - 1),
        Register.OUTCOME: (-1, len(program.outcome_table) - 1),
        Register.PERCENT: (0, 100),
        Register.HEARD: (0, h(Header.HEARD_SIZE)),
        Register.LOGGED: (0, h(Header.LOG_SIZE)),
        Register.OLDEST: (0, max(h(Header.LOG_SIZE) - 1, 0)),
        Register.TOKENS: (0, h(Header.TOKENS)),
        Register.ENDED: (0, 2),
        Register.POKED: (-1, h(Header.ENTITIES) - 1),
        Register.SAID_LINE: (0, lines),
        Register.LAST_TURN: (-1, int(Body.STOP_POINTING)),
        Register.UTTERANCE: (0, h(Header.TEMPLATES) * h(Header.NOUNS)),
        Register.CHANGED: (0, 1),
        Register.ACCEPTED: (0, 1),
        Register.ATTEMPT: (0, 64),
    }
    return [(register, 1, *bounds) for register, bounds in greatest.items()]


def _rooms_that_fit(program: Program) -> int:
    """How many room templates the program has space for behind the first."""
    h = program.header
    size = room_words(h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT))
    return min((h(Header.SIZE) - h(Header.ROOM_AT)) // size, np.iinfo(np.int16).max)


def _entities(program: Program) -> list[Range]:
    ranges: list[Range] = []
    kinds = program.table(Header.ENTITY_AT)[:, EntityColumn.KIND].tolist()
    for number, entity in enumerate(program.entities):
        # The status of an NPC is its code in the picture, that of the agent is 0.
        greatest_status = len(entity.states) - 1 if entity.states else kinds[number]
        greatest = {
            Field.X: (-1, program.header(Header.CANVAS_WIDTH) - 1),
            Field.Y: (-1, program.header(Header.CANVAS_HEIGHT) - 1),
            Field.DIR: (0, 3),
            Field.COLOR: (0, 5),
            Field.STATUS: (0, greatest_status),
            Field.GONE: (0, 1),
            Field.POKED: (0, 1),
            Field.LAST: (0, int(Body.STOP_POINTING)),
            # Of an object who carries it, of an NPC perhaps a cell.
            Field.POINTING: (
                0,
                1 + program.header(Header.NPCS)
                if entity.role == "object"
                else CELL + 32 * program.header(Header.CANVAS_HEIGHT) - 1,
            ),
            Field.INSIDE: (0, program.header(Header.ENTITIES) - 1),
        }
        base = FIRST_ENTITY + ENTITY_FIELDS * number
        ranges += [(base + name, 1, *bounds) for name, bounds in greatest.items()]
    return ranges


def _speech(program: Program) -> list[Range]:
    h = program.header
    last_line = max(h(Header.LINES) - 1, 0)
    return [
        (h(Header.LOG), h(Header.LOG_SIZE), 0, last_line),
        (h(Header.HEARD), h(Header.HEARD_SIZE), 0, last_line),
    ]


def _frames(program: Program) -> list[Range]:
    h = program.header
    ranges: list[Range] = []
    for row in program.table(Header.FRAME_AT).tolist():
        ranges += [
            (row[FrameColumn.STATE], 1, 0, row[FrameColumn.STATES] - 1),
            (row[FrameColumn.CLOCK], 1, 0, h(Header.HORIZON)),
            (row[FrameColumn.INBOX], 1, 0, h(Header.INBOX_SIZE)),
            *_entries(program, row[FrameColumn.INBOX] + 1),
        ]
    return ranges


def _entries(program: Program, first: int) -> list[Range]:
    """What an inbox may hold: classes, or for each entry a class, a speaker and a noun."""
    h = program.header
    size, last_class = h(Header.INBOX_SIZE), h(Header.CLASSES) - 1
    if not h(Header.FLAGS) & Flag.HEARD_BY:
        return [(first, size, 0, last_class)]
    bounds = ((0, last_class), (0, h(Header.ENTITIES) - 1), (-1, h(Header.NOUNS) - 1))
    return [
        (first + 3 * entry + part, 1, *bounds[part]) for entry in range(size) for part in range(len(bounds))
    ]
