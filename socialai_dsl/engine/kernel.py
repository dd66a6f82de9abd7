"""The one compiled entry point: steps, resets or scripts the rows of a part of a batch."""

from enum import IntEnum
from typing import Any

import numpy as np

from socialai_dsl.engine import rng
from socialai_dsl.engine.cache import entry
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.picture import CELLS, image_digest, take_picture
from socialai_dsl.engine.pointers import (
    bytes_of,
    float64_of,
    int16_of,
    int32_of,
    int64_of,
    uint16_of,
    uint32_of,
    uint64_of,
)
from socialai_dsl.engine.reset import draw_member, reset_row
from socialai_dsl.engine.script import script_row
from socialai_dsl.engine.state import ZERO, Book, Key, Link, Row, Size
from socialai_dsl.engine.step import TERMINATED, step_row
from socialai_dsl.program import Header, Register

BAD_ACTION = -1
"""Returned instead of stepping if an action is outside its space."""


class Task(IntEnum):
    """What a call of `serve` is to do."""

    STEP_NEXT = 0  # step; an episode that has ended is reset by the next step
    STEP_SAME = 1  # step; an episode that ends is reset at once, its last observation is kept
    STEP_ONLY = 2  # step; resets are the caller's
    RESET = 3  # reset the chosen rows to the episode named by their keys
    SCRIPT = 4  # write what the agent's frame would do into the actions
    CHECK = 5  # only look whether the actions are inside their space
    IDENTIFY = 6  # write digests of the pictures


@inline
def _open_row(book: Any, thread: int, layout: int, row: int) -> Row:
    key = uint64_of(book, Book.KEYS, row)
    program = int32_of(book, Book.WORDS, np.int64(key[Key.PROGRAM]))
    counters = thread * int64_of(book, Book.SIZES, ZERO)[Size.COUNTERS]
    return Row(
        program,
        int16_of(book, Book.REGISTERS, row),
        uint32_of(book, Book.BOARDS, row),
        key,
        int16_of(book, Book.TOKENS, row),
        uint32_of(book, Book.IMAGE, row),
        int64_of(book, Book.ACTIONS, row),
        int64_of(book, Book.COUNTERS, counters + program[program[Header.SIZE] + Link.COUNTERS]),
        int16_of(book, Book.PINS, layout),
        int64_of(book, Book.SCRATCH, thread),
        uint32_of(book, Book.SETS, thread),
        uint16_of(book, Book.VIEWS, ZERO),
    )


@inline
def _copy(target: Any, source: Any, count: int) -> None:
    for i in range(count):
        target[i] = source[i]


@outline
def _keep_final(book: Any, row: int) -> None:
    stay_outline()
    length = int64_of(book, Book.SIZES, ZERO)[Size.TOKENS]
    _copy(uint32_of(book, Book.FINAL_IMAGE, row), uint32_of(book, Book.IMAGE, row), np.int64(CELLS))
    _copy(int16_of(book, Book.FINAL_TOKENS, row), int16_of(book, Book.TOKENS, row), length)


@inline
def _outcome_of_batch(row: Row) -> int:
    """The batch's number of how the episode ended."""
    link = row.program[Header.SIZE]
    spaces = (
        row.program[link + Link.ACTIONS] + row.program[link + Link.TEMPLATES] + row.program[link + Link.NOUNS]
    )
    return row.program[link + Link.END + spaces + row.registers[Register.OUTCOME]]


@inline
def _reset(book: Any, thread: int, layout: int, row: int) -> None:
    """Start the episode that the row's key names."""
    key = uint64_of(book, Book.KEYS, row)
    key[Key.KEY] = rng.episode_key(key[Key.SEED], key[Key.INDEX], key[Key.EPISODE])
    first = np.int64(key[Key.POOL] & np.uint64(0xFFFFFFFF))
    count = np.int64(key[Key.POOL] >> np.uint64(32))
    if count > 1:
        pinned = int16_of(book, Book.PINS, layout)[int64_of(book, Book.SIZES, ZERO)[Size.REGISTERS]]
        first += draw_member(key[Key.KEY], count, pinned)
    key[Key.PROGRAM] = np.uint64(int64_of(book, Book.CHOICES, ZERO)[first])
    opened = _open_row(book, thread, layout, row)
    reset_row(opened, layout != 0)
    take_picture(opened, opened.program[Header.SIZE])


@inline
def _step(book: Any, thread: int, row: int) -> int:
    """Step one row and report on it; 1 if its episode ended."""
    opened = _open_row(book, thread, ZERO, row)
    link = opened.program[Header.SIZE]
    int32_of(book, Book.PLAYED, ZERO)[row] = opened.program[link + Link.NUMBER]
    float64_of(book, Book.REWARD, ZERO)[row] = step_row(opened, link)
    ended = opened.registers[Register.ENDED]
    if ended == 0:
        return 0
    int16_of(book, Book.OUTCOME, ZERO)[row] = _outcome_of_batch(opened)
    if ended == TERMINATED:
        bytes_of(book, Book.TERMINATED, ZERO)[row] = 1
    else:
        bytes_of(book, Book.TRUNCATED, ZERO)[row] = 1
    return 1


@inline
def _report_nothing(book: Any, row: int) -> None:
    float64_of(book, Book.REWARD, ZERO)[row] = 0.0
    int16_of(book, Book.OUTCOME, ZERO)[row] = -1
    bytes_of(book, Book.TERMINATED, ZERO)[row] = 0
    bytes_of(book, Book.TRUNCATED, ZERO)[row] = 0


@inline
def _advance(book: Any, thread: int, task: int, row: int) -> int:
    """Step or reset one row, or both, as the task says; 1 if its episode ended."""
    ended = 0
    layout = ZERO
    if task == Task.RESET:
        if bytes_of(book, Book.CHOSEN, ZERO)[row] == 0:
            return 0
        layout = int32_of(book, Book.LAYOUT, ZERO)[row]
    else:
        _report_nothing(book, row)
        over = int16_of(book, Book.REGISTERS, row)[Register.ENDED] != 0
        if not over:
            ended = _step(book, thread, row)
            if ended == 0 or task != Task.STEP_SAME:
                return ended
            _keep_final(book, row)
        elif task != Task.STEP_NEXT:
            return 0
        uint64_of(book, Book.KEYS, row)[Key.EPISODE] += np.uint64(1)
    _reset(book, thread, layout, row)
    return ended


@inline
def _actions_fit(book: Any, first: int, last: int) -> bool:
    program = int32_of(book, Book.WORDS, np.int64(uint64_of(book, Book.KEYS, first)[Key.PROGRAM]))
    link = program[Header.SIZE]
    primitives = program[link + Link.ACTIONS]
    templates = program[link + Link.TEMPLATES]
    nouns = program[link + Link.NOUNS]
    wrong = False
    for row in range(first, last):
        action = int64_of(book, Book.ACTIONS, row)
        wrong |= (action[0] < 0) | (action[0] >= primitives)
        wrong |= (action[1] < 0) | (action[1] > 1)
        wrong |= (action[2] < 0) | (action[2] >= templates)
        wrong |= (action[3] < 0) | (action[3] >= nouns)
    return not wrong


@outline
def _script(book: Any, thread: int, row: int) -> None:
    """Write the scripted action of one row. It is played, and then everything is as it was."""
    stay_outline()
    opened = _open_row(book, thread, ZERO, row)
    sizes = int64_of(book, Book.SIZES, ZERO)
    registers = int16_of(book, Book.SPARE_REGISTERS, thread)
    board = uint32_of(book, Book.SPARE_BOARDS, thread)
    counters = int64_of(book, Book.SPARE_COUNTERS, thread)
    count = opened.program[Header.COUNTERS]
    _copy(registers, opened.registers, sizes[Size.REGISTERS])
    _copy(board, opened.board, sizes[Size.BOARD])
    _copy(counters, opened.counters, count)
    script_row(opened, opened.program[Header.SIZE])
    _copy(opened.registers, registers, sizes[Size.REGISTERS])
    _copy(opened.board, board, sizes[Size.BOARD])
    _copy(opened.counters, counters, count)


@entry
def serve(book: Any, task: int, thread: int, first: int, last: int) -> int:
    """Do a `Task` for the rows first to last - 1 with the scratch space of a thread.

    Args:
        book: the arrays of `Book` (`pointers.make_book`).
        task: a `Task`.
        thread: number of the thread.
        first: the first row.
        last: the row after the last.

    Returns:
        How many episodes ended, or BAD_ACTION (then nothing was done).
    """
    ended = 0
    if task <= Task.RESET:
        if task != Task.RESET and not _actions_fit(book, first, last):
            return BAD_ACTION
        for row in range(first, last):
            ended += _advance(book, thread, task, row)
    elif task == Task.CHECK:
        return 0 if _actions_fit(book, first, last) else BAD_ACTION
    elif task == Task.SCRIPT:
        for row in range(first, last):
            _script(book, thread, row)
    else:
        for row in range(first, last):
            image = uint32_of(book, Book.IMAGE, row)
            uint64_of(book, Book.IMAGE_IDS, ZERO)[row] = image_digest(image)
    return ended
