"""Seats other than the agent's: where their registers are, and who sits there."""

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import Link, Row
from socialai_dsl.program import Flag, Header, SeatColumn, SeatRegister


@inline
def seats_played(row: Row) -> int:
    """How many seats the callers of the batch play, the agent's included; the others follow from 1 on."""
    return row.program[row.program[Header.SIZE] + Link.SEATS]


@inline
def seat_word(row: Row, seat: int, name: int) -> int:
    """One word of the seat table, for a seat from 1 on."""
    return row.program[Header.END + 1 + SeatColumn.COLUMNS * (seat - 1) + name]


@inline
def seat_register(row: Row, seat: int, name: int) -> int:
    """The number of a `SeatRegister` of a seat."""
    return seat_word(row, seat, SeatColumn.FIRST) + name


@inline
def seat_value(row: Row, seat: int, name: int) -> int:
    """What is in a `SeatRegister` of a seat."""
    return row.registers[seat_register(row, seat, name)]


@inline
def taken_seat_of(row: Row, npc: int) -> int:
    """The seat of a member of the cast if a player sits there; else 0."""
    if row.program[Header.FLAGS] & Flag.SEATS:
        for seat in range(1, seats_played(row)):
            if seat_word(row, seat, SeatColumn.ENTITY) == npc:
                return seat if seat_value(row, seat, SeatRegister.TAKEN) != 0 else 0
    return 0
