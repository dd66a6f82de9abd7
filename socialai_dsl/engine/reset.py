"""The start of an episode: a room is drawn or taken from a layout, and furnished."""

import numpy as np
from numpy.typing import NDArray

from socialai_dsl import draws
from socialai_dsl.engine import rng
from socialai_dsl.engine.boards import draw_all
from socialai_dsl.engine.entities import column, field, set_field
from socialai_dsl.engine.jit import inline, merged
from socialai_dsl.engine.places import occupy
from socialai_dsl.engine.seats import seat_register, seats_played
from socialai_dsl.engine.sets import clear
from socialai_dsl.engine.speech import clear_tokens, remember
from socialai_dsl.engine.state import ATTEMPTS, OCCUPIED, ONE, RESETTING, ZERO, Key, Row
from socialai_dsl.engine.turns import settle
from socialai_dsl.engine.vm import run
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    Body,
    EntityColumn,
    Field,
    Header,
    Register,
    SeatRegister,
)
from socialai_dsl.widths import UNPINNED

MEMBER_SITE = np.int64(draws.site("member"))
"""Where a suite draws the program of an episode."""


@inline
def draw_member(key: np.uint64, weights: NDArray[np.int64], count: int) -> int:
    """Which program of its pool an environment plays in this episode; `weights` are those of the pool, added up."""
    drawn = rng.below(rng.draw(key, MEMBER_SITE, ZERO, ZERO), weights[count - 1])
    low = ZERO
    high = count - 1
    while low < high:
        middle = (low + high) >> 1
        if drawn < weights[middle]:
            high = middle
        else:
            low = middle + 1
    return low


@merged
def reset_row(row: Row, pinned: bool, t: int) -> bool:
    """Start an episode, or an act of one at step `t`; the row's key and program are set already.

    Whether its room is as required. If not it is the last of `ATTEMPTS` rooms, complete as any other.
    """
    key = row.key[Key.KEY]
    required = row.program[Header.REQUIRE_PC]
    if pinned and row.pins[Register.T] > 0:
        required = ZERO  # a moment of an episode, whose room was accepted when it began
    for attempt in range(ATTEMPTS):
        row.key[Key.KEY] = rng.attempt_key(key, attempt)
        _draw_room(row, pinned, t)
        row.registers[Register.ATTEMPT] = attempt
        if required != 0:
            run(row, required)
        if required == 0 or row.registers[Register.ACCEPTED] != 0:
            row.key[Key.KEY] = key
            return np.bool_(True)
    row.registers[Register.ATTEMPT] = ATTEMPTS
    row.key[Key.KEY] = key
    return np.bool_(False)


@merged
def _draw_room(row: Row, pinned: bool, t: int) -> None:
    _blank(row)
    if pinned:
        _pin_early(row)
    run(row, row.program[Header.RESET_PC])
    row.registers[Register.ENDED] = 0
    row.registers[Register.T] = t
    if pinned:
        _pin_late(row)
    draw_all(row)
    row.registers[Register.CHANGED] = 1
    settle(row)
    row.registers[Register.ACCEPTED] = 0


@inline
def _blank(row: Row) -> None:
    registers = row.registers
    clear_tokens(row)
    for i in range(row.program[Header.REGISTERS]):
        registers[i] = 0
    for entity in range(row.program[Header.ENTITIES]):
        base = FIRST_ENTITY + ENTITY_FIELDS * entity
        registers[base + Field.X] = -1
        registers[base + Field.Y] = -1
        registers[base + Field.LAST] = Body.NONE
    for npc in range(1, row.program[Header.NPCS] + 1):
        set_field(row, npc, Field.STATUS, column(row, npc, EntityColumn.KIND))
    registers[Register.OUTCOME] = -1
    registers[Register.TEMPLATE] = -1
    registers[Register.NOUN] = -1
    registers[Register.POKED] = -1
    registers[Register.ACTION] = Body.NONE
    registers[Register.LAST_TURN] = Body.NONE
    registers[Register.ENDED] = RESETTING
    for seat in range(1, seats_played(row)):
        registers[seat_register(row, seat, np.int64(SeatRegister.WISH))] = Body.NONE
    clear(row, OCCUPIED)


@inline
def _pin(row: Row, first: int) -> None:
    """Write what a layout gives for the registers from `first` on, other than what was heard."""
    log = row.program[Header.LOG]
    end = log + row.program[Header.LOG_SIZE]
    for i in range(first, row.program[Header.REGISTERS]):
        told = log <= i < end or i == Register.LOGGED or i == Register.OLDEST or i == Register.TOKENS
        if row.pins[i] != UNPINNED and not told:
            row.registers[i] = row.pins[i]


@inline
def _pin_early(row: Row) -> None:
    """Write what draws may depend on: the room, the entities and the program's own registers."""
    for i in range(Register.WIDTH, Register.HEIGHT + 1):
        if row.pins[i] != UNPINNED:
            row.registers[i] = row.pins[i]
    _pin(row, np.int64(FIRST_ENTITY))
    for entity in range(row.program[Header.ENTITIES]):
        if row.pins[FIRST_ENTITY + ENTITY_FIELDS * entity + Field.X] != UNPINNED:
            if field(row, entity, Field.X) < 0:
                set_field(row, entity, Field.GONE, ONE)
            elif field(row, entity, Field.GONE) == 0:
                occupy(row, entity)


@inline
def _pin_late(row: Row) -> None:
    """Write everything a layout gives once more, over what the draws did, and what was heard."""
    _pin(row, ZERO)
    if row.pins[Register.LOGGED] != UNPINNED:
        for i in range(row.pins[Register.LOGGED]):
            remember(row, row.pins[row.program[Header.LOG] + i])
