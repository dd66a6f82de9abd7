"""Checks registers from outside: the engine checks no index, so a snapshot must hold possible values only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import (
    Body,
    Flag,
    FrameColumn,
    Header,
    Program,
    Register,
    SeatColumn,
    SeatRegister,
    room_words,
)
from socialai_dsl.program.instructions import Interval
from socialai_dsl.program.program import bounds_of
from socialai_dsl.widths import WHOLE_REGISTER


def first_unsound(program: Program, registers: NDArray[np.int32]) -> str | None:
    """The first problem of the registers, int32 (E, R), of environments that play a program; None without one."""
    low, high = np.array(_ranges(program), np.int64).T
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


def _ranges(program: Program) -> list[Interval]:
    """The range of each register, also of those that no code reads."""
    h = program.header
    ranges = list(bounds_of(program).of_register)
    own = {
        Register.ROOM: (0, _rooms_that_fit(program) - 1),
        Register.OUTCOME: (-1, len(program.outcome_table) - 1),
        Register.PERCENT: (0, 100),
        Register.HEARD: (0, h(Header.HEARD_SIZE)),
        Register.LOGGED: (0, h(Header.LOG_SIZE)),
        Register.OLDEST: (0, max(h(Header.LOG_SIZE) - 1, 0)),
        Register.TOKENS: (0, h(Header.TOKENS)),
        Register.ENDED: (0, 2),
        Register.SAID_LINE: (0, h(Header.LINES)),
        Register.ATTEMPT: (0, 64),
    }
    for register, interval in own.items():
        ranges[register] = interval
    line = (0, max(h(Header.LINES) - 1, 0))
    for first, size in ((h(Header.LOG), h(Header.LOG_SIZE)), (h(Header.HEARD), h(Header.HEARD_SIZE))):
        ranges[first : first + size] = [line] * size
    for row in program.seat_table.tolist():
        for which, interval in _of_seat(program).items():
            ranges[row[SeatColumn.FIRST] + which] = interval
        for first, size in (
            (row[SeatColumn.LOG], h(Header.LOG_SIZE)),
            (row[SeatColumn.HEARD], h(Header.HEARD_SIZE)),
        ):
            ranges[first : first + size] = [line] * size
    inbox = _inbox(program)
    for first in program.table(Header.FRAME_AT)[:, FrameColumn.INBOX].tolist():
        ranges[first : first + len(inbox)] = inbox
    return ranges


def _of_seat(program: Program) -> dict[SeatRegister, Interval]:
    """The ranges of the registers of a seat other than the agent's that have no name."""
    h = program.header
    lines = (0, h(Header.LINES))
    return {
        SeatRegister.LINE: lines,
        SeatRegister.HEARD: (0, h(Header.HEARD_SIZE)),
        SeatRegister.LOGGED: (0, h(Header.LOG_SIZE)),
        SeatRegister.TOKENS: (0, h(Header.TOKENS)),
        SeatRegister.OLDEST: (0, max(h(Header.LOG_SIZE) - 1, 0)),
        SeatRegister.WISH: (0, Body.STOP_POINTING),
        SeatRegister.WISH_LINE: lines,
    }


def _rooms_that_fit(program: Program) -> int:
    """How many room templates the program has space for behind the first."""
    h = program.header
    size = room_words(h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT))
    return min((h(Header.SIZE) - h(Header.ROOM_AT)) // size, WHOLE_REGISTER[1])


def _inbox(program: Program) -> list[Interval]:
    """How many entries an inbox has, then for each its class, or its class, its speaker and its noun."""
    h = program.header
    entry = [(0, h(Header.CLASSES) - 1)]
    if h(Header.FLAGS) & Flag.HEARD_BY:
        entry += [(0, h(Header.ENTITIES) - 1), (-1, h(Header.NOUNS) - 1)]
    return [(0, h(Header.INBOX_SIZE)), *entry * h(Header.INBOX_SIZE)]
