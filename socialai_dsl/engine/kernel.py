"""The compiled entry point: steps or resets the rows of a batch."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.calls import BAD_ACTION, NO_ROOM, TERMINATED, Task
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.picture import take_pictures
from socialai_dsl.engine.pointers import (
    bare,
    bytes_of,
    float64_of,
    int32_of,
    int64_of,
    registers_of,
    tokens_of,
    uint16_of,
    uint32_of,
    uint64_of,
)
from socialai_dsl.engine.reset import draw_member, reset_row
from socialai_dsl.engine.rows import copy, open_row
from socialai_dsl.engine.state import ZERO, ArrayId, Key, Link, Row, Size
from socialai_dsl.engine.step import pay_seats, step_row
from socialai_dsl.engine.views import CELLS
from socialai_dsl.program import Header, Register
from socialai_dsl.widths import UNPINNED


@outline
def _keep_final(book: Any, row: int) -> None:
    stay_outline()
    sizes = int64_of(book, ArrayId.SIZES, ZERO)
    copy(tokens_of(book, ArrayId.FINAL_TOKENS, row), tokens_of(book, ArrayId.TOKENS, row), sizes[Size.TOKENS])
    for player in range(row * sizes[Size.SEATS], (row + 1) * sizes[Size.SEATS]):
        cells = uint32_of(book, ArrayId.IMAGE, player)
        copy(uint32_of(book, ArrayId.FINAL_IMAGE, player), cells, np.int64(CELLS))
        extra = uint16_of(book, ArrayId.EXTRA, player)
        copy(uint16_of(book, ArrayId.FINAL_EXTRA, player), extra, sizes[Size.EXTRA])


@inline
def _pool_size(key: NDArray[np.uint64]) -> int:
    """How many programs a row may play."""
    return np.int64((key[Key.POOL] >> np.uint64(32)) & np.uint64(0x7FFFFFFF))


@inline
def _plays_acts(key: NDArray[np.uint64]) -> bool:
    """Whether a row plays its programs one after another."""
    return key[Key.POOL] >> np.uint64(63) != np.uint64(0)


@inline
def _is_success(row: Row, seat: int) -> bool:
    """Whether the program ended with a success of a seat."""
    table = row.program[row.program[Header.SIZE] + Link.SUCCESS_AT]
    return (row.program[table + row.registers[Register.OUTCOME]] >> seat) & 1 != 0


@outline
def _open_act(book: Any, opened: Row) -> int:
    """After an act has ended let the row's key and program be those of the next; the step of its start.

    0 if there is none, or no time for it: then the episode has ended.
    """
    stay_outline()
    key = opened.key
    act = np.int64(key[Key.ACT]) + 1
    t = opened.registers[Register.T]
    if opened.registers[Register.ENDED] != TERMINATED or not 0 < act < _pool_size(key):
        return ZERO
    if not _is_success(opened, ZERO) or t >= opened.program[Header.HORIZON]:
        key[Key.SPOILED] = np.uint64(1)
    if t >= opened.program[Header.HORIZON]:
        return ZERO
    first = np.int64(key[Key.POOL] & np.uint64(0xFFFFFFFF))
    key[Key.ACT] = np.uint64(act)
    key[Key.KEY] = rng.act_key(rng.episode_key(key[Key.SEED], key[Key.INDEX], key[Key.EPISODE]), act)
    key[Key.PROGRAM] = np.uint64(int64_of(book, ArrayId.CHOICES, ZERO)[first + act])
    return t


@inline
def _open_episode(book: Any, layout: int, row: int) -> None:
    """Let the row's key and program be those of the episode that it names."""
    key = uint64_of(book, ArrayId.KEYS, row)
    key[Key.KEY] = rng.episode_key(key[Key.SEED], key[Key.INDEX], key[Key.EPISODE])
    first = np.int64(key[Key.POOL] & np.uint64(0xFFFFFFFF))
    count = _pool_size(key)
    if count > 1:
        pinned = registers_of(book, ArrayId.PINS, layout)[int64_of(book, ArrayId.SIZES, ZERO)[Size.REGISTERS]]
        if _plays_acts(key):
            act = ZERO if pinned == UNPINNED else pinned
            key[Key.ACT] = np.uint64(act)
            key[Key.SPOILED] = np.uint64(0)
            key[Key.KEY] = rng.act_key(key[Key.KEY], act)
            first += act
        elif pinned != UNPINNED:
            first += pinned
        else:
            first += draw_member(key[Key.KEY], int64_of(book, ArrayId.WEIGHTS, first), count)
    key[Key.PROGRAM] = np.uint64(int64_of(book, ArrayId.CHOICES, ZERO)[first])


@inline
def _report_nothing(book: Any, row: int, seats: int) -> None:
    registers_of(book, ArrayId.OUTCOME, ZERO)[row] = -1
    bytes_of(book, ArrayId.TERMINATED, ZERO)[row] = 0
    bytes_of(book, ArrayId.TRUNCATED, ZERO)[row] = 0
    for player in range(row * seats, (row + 1) * seats):
        float64_of(book, ArrayId.REWARD, ZERO)[player] = 0.0
        bytes_of(book, ArrayId.SUCCESS, ZERO)[player] = 0
    bytes_of(book, ArrayId.ENDED, ZERO)[row] = 0


@inline
def _report_end(book: Any, row: int, opened: Row, seats: int) -> None:
    table = opened.program[opened.program[Header.SIZE] + Link.ENDING_AT]
    registers_of(book, ArrayId.OUTCOME, ZERO)[row] = opened.program[
        table + opened.registers[Register.OUTCOME]
    ]
    for seat in range(seats):
        success = _is_success(opened, seat) and opened.key[Key.SPOILED] == np.uint64(0)
        bytes_of(book, ArrayId.SUCCESS, ZERO)[row * seats + seat] = np.int64(success)
    bytes_of(book, ArrayId.ENDED, ZERO)[row] = 1
    if opened.registers[Register.ENDED] == TERMINATED:
        bytes_of(book, ArrayId.TERMINATED, ZERO)[row] = 1
    else:
        bytes_of(book, ArrayId.TRUNCATED, ZERO)[row] = 1


@inline
def _actions_fit(book: Any, rows: int) -> bool:
    """Whether all actions are inside the action space."""
    program = int32_of(book, ArrayId.WORDS, np.int64(uint64_of(book, ArrayId.KEYS, ZERO)[Key.PROGRAM]))
    link = program[Header.SIZE]
    primitives = np.uint64(program[link + Link.ACTIONS])
    templates = np.uint64(program[link + Link.TEMPLATES])
    slots = program[link + Link.SLOTS]
    sizes = program[link + Link.SIZE_AT]
    actions = uint64_of(book, ArrayId.FLAT_ACTIONS, ZERO)
    wrong = False
    for i in range(0, (3 + slots) * rows, 3 + slots):
        # What is negative is large unsigned.
        wrong |= (actions[i] >= primitives) | (actions[i + 1] >= np.uint64(2)) | (actions[i + 2] >= templates)
        for slot in range(slots):
            wrong |= actions[i + 3 + slot] >= np.uint64(program[sizes + slot])
    return not wrong


def serve(book: Any, task: int, rows: int) -> int:
    """Do a `Task` for all rows.

    Args:
        book: the arrays of `ArrayId` (`pointers.make_book`).
        task: a `Task`.
        rows: how many there are.

    Returns:
        How many episodes ended, plus NO_ROOM for each row without a room, or BAD_ACTION (then nothing was done).
    """
    arrays = bare(book)
    seats = int64_of(arrays, ArrayId.SIZES, ZERO)[Size.SEATS]
    ended = 0
    if task != Task.RESET and not _actions_fit(arrays, rows * seats):
        return BAD_ACTION
    for row in range(rows):
        layout = ZERO
        t = ZERO
        if task == Task.RESET:
            if bytes_of(arrays, ArrayId.CHOSEN, ZERO)[row] == 0:
                continue
            layout = int32_of(arrays, ArrayId.LAYOUT, ZERO)[row]
        else:
            _report_nothing(arrays, row, seats)
            if registers_of(arrays, ArrayId.REGISTERS, row)[Register.ENDED] == 0:
                opened = open_row(arrays, ZERO, row)
                reward = step_row(opened, opened.program[Header.SIZE], arrays, row * seats)
                if reward != 0.0 and _plays_acts(opened.key):
                    reward /= np.float64(_pool_size(opened.key))
                float64_of(arrays, ArrayId.REWARD, ZERO)[row * seats] = reward
                if seats > 1:
                    pay_seats(opened, arrays, row * seats)
                if opened.registers[Register.ENDED] == 0:
                    continue
                if _plays_acts(opened.key):
                    t = _open_act(arrays, opened)
                if t == 0:
                    ended += 1
                    _report_end(arrays, row, opened, seats)
                    if task != Task.STEP_SAME:
                        continue
                    _keep_final(arrays, row)
            elif task != Task.STEP_NEXT:
                continue
            if t == 0:
                uint64_of(arrays, ArrayId.KEYS, row)[Key.EPISODE] += np.uint64(1)
        if t == 0:
            _open_episode(arrays, layout, row)
        fresh = open_row(arrays, layout, row)
        if not reset_row(fresh, layout != 0, t):
            bytes_of(arrays, ArrayId.REFUSED, ZERO)[row] = 1
            ended += NO_ROOM
        take_pictures(fresh, fresh.program[Header.SIZE], arrays, row * seats)
    return ended
