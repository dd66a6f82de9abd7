"""Operands of instructions: constants, temporaries and registers in one word, and the draws of a site."""

import numpy as np

from socialai_dsl.engine import rng
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import Key, Row
from socialai_dsl.program import CONSTANT, TEMPORARY, Header, Register


@inline
def value(row: Row, operand: int) -> int:
    """The value of an operand."""
    # What is negative is large unsigned: a constant that states itself.
    if np.uint64(operand) >= np.uint64(CONSTANT // 2):
        return operand - (CONSTANT & ~(operand >> 63))
    if operand >= TEMPORARY:
        return row.scratch[operand - TEMPORARY]
    return row.registers[operand]


@inline
def assign(row: Row, operand: int, number: int) -> None:
    """Write a register or temporary."""
    if operand >= TEMPORARY:
        row.scratch[operand - TEMPORARY] = number
    else:
        row.registers[operand] = number


@inline
def draw_at(row: Row, site: int) -> np.uint64:
    """The random bits of a site in this step."""
    place = row.program[Header.SITE_AT] + 2 * site
    number, key = row.program[place + 1], row.key[Key.KEY]
    if number >> 16:
        key = session_key(row, number >> 16)
    return rng.draw(key, row.program[place], row.registers[Register.T], number & 65535)


@inline
def session_key(row: Row, episodes: int) -> np.uint64:
    """The key of draws that stay the same in a session of this many episodes; see `draws`."""
    episode = row.key[Key.EPISODE]
    first = episode - episode % np.uint64(episodes)
    return rng.act_key(
        rng.episode_key(row.key[Key.SEED], row.key[Key.INDEX], first), np.int64(row.key[Key.ACT])
    )


@inline
def draw_below(row: Row, site: int, n: int) -> int:
    """A uniform number below n."""
    return rng.below(draw_at(row, site), n)


@inline
def draw_other(row: Row, packed: int, one: int) -> int:
    """A uniform number of some in a row, but not this one; see `Op.DRAW_OTHER`."""
    number = (packed >> 16 & 255) + draw_below(row, packed & 65535, (packed >> 24) - 1)
    return number + np.int64(number >= one)


@inline
def draw_action(row: Row, packed: int, count: int, site: int) -> int:
    """One of the actions packed into a word, four bits each; see `Op.CHOOSE`."""
    return np.int64((packed >> (4 * draw_below(row, site, count))) & 15)
