"""Queries of rows without a step: the script's next action, digests of pictures.

These are compiled when they are first asked for.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.picture import image_digest
from socialai_dsl.engine.pointers import int64_of, registers_of, uint16_of, uint32_of, uint64_of
from socialai_dsl.engine.rows import copy, open_row
from socialai_dsl.engine.speech import inbox_class
from socialai_dsl.engine.state import STILL, ZERO, ArrayId, Link, Row, Size, Trait
from socialai_dsl.engine.step import be_silent, begin
from socialai_dsl.engine.turns import (
    act,
    compute_statuses,
    conclude,
    follow_links,
    go_by_itself,
    move_agent,
    notice,
    perceive,
    settle,
    state_table,
)
from socialai_dsl.program import Body, Flag, FrameColumn, Header, Register


@inline
def _play(row: Row, link: int, action: NDArray[np.int64]) -> None:
    """Write the action of the agent's frame, int64 (3 + slots,); the row is played on and must be a copy.

    Without a frame the agent stands still and is silent.
    """
    program = row.program
    body = STILL
    line = 0
    begin(row)
    be_silent(row)
    row.registers[Register.ACTION] = Body.NONE
    if program[Header.FLAGS] & Flag.AGENT_FRAME:
        frame = program[Header.FRAME_AT]
        heard = inbox_class(row, program[frame + FrameColumn.INBOX])
        perceive(row, frame, program[Header.FLAGS])
        chosen = notice(row, program[state_table(row, frame) + 1 + heard])
        body = row.registers[Register.LAST_TURN] if chosen else act(row, frame)
        row.registers[Register.ACTION] = body
        move_agent(row, body)
        if program[Header.FLAGS] & Trait.GOES_BY_ITSELF:
            changed = follow_links(row)
            compute_statuses(row, go_by_itself(row) or changed)
        else:
            settle(row)
        conclude(row, frame, state_table(row, frame), heard, chosen, program[Header.FLAGS])
        line = row.registers[Register.SAID_LINE]
    action[1] = 0
    action[2] = 0
    for slot in range(program[link + Link.SLOTS]):
        action[3 + slot] = 0
    action[0] = _index_of(program, link + Link.END, program[link + Link.ACTIONS], body)
    _encode_line(row, link, line, action)


@outline
def _encode_line(row: Row, link: int, line: int, action: NDArray[np.int64]) -> None:
    stay_outline()
    program = row.program
    pair = line - program[Header.AGENT_SAYS]
    nouns = program[Header.NOUNS]
    if line == 0 or program[Header.AGENT_SAYS] == 0 or not 0 <= pair < program[Header.TEMPLATES] * nouns:
        return
    table = program[link + Link.TEMPLATE_AT]
    template = _index_of(program, table, program[link + Link.TEMPLATES], pair // nouns)
    if template >= 0 and _encode_words(row, link, template, pair % nouns, action):
        action[1] = 1
        action[2] = template


@outline
def _encode_words(row: Row, link: int, template: int, filling: int, action: NDArray[np.int64]) -> bool:
    """Write the words in the slots of a template; whether the batch has them all."""
    stay_outline()
    program = row.program
    slots = program[link + Link.SLOTS]
    sizes = program[link + Link.SIZE_AT]
    words = program[link + Link.WORD_AT]
    strides = program[link + Link.STRIDE_AT] + template * (1 + slots)
    filling -= program[strides]
    sayable = True
    for slot in range(slots):
        size = program[sizes + slot]
        stride = program[strides + 1 + slot]
        if stride != 0:
            word = _index_of(program, words, size, filling // stride)
            sayable &= word >= 0
            filling %= stride
            action[3 + slot] = max(word, ZERO)
        words += size
    return sayable


@outline
def _index_of(program: NDArray[np.int32], table: int, size: int, wanted: int) -> int:
    """First index of a value in a table; the last index if it is not there and -1 means nothing."""
    stay_outline()
    for i in range(size):
        if program[table + i] == wanted:
            return i
    return -1


@inline
def _script_row(book: Any, row: int) -> None:
    """Write the scripted action of one row. It is played, and then everything is as it was."""
    opened = open_row(book, ZERO, row)
    sizes = int64_of(book, ArrayId.SIZES, ZERO)
    registers = registers_of(book, ArrayId.SPARE_REGISTERS, ZERO)
    board = uint32_of(book, ArrayId.SPARE_BOARDS, ZERO)
    counters = int64_of(book, ArrayId.SPARE_COUNTERS, ZERO)
    count = opened.program[Header.COUNTERS]
    copy(registers, opened.registers, sizes[Size.REGISTERS])
    copy(board, opened.board, sizes[Size.BOARD])
    copy(counters, opened.counters, count)
    _play(opened, opened.program[Header.SIZE], int64_of(book, ArrayId.ACTIONS, row * sizes[Size.SEATS]))
    copy(opened.registers, registers, sizes[Size.REGISTERS])
    copy(opened.board, board, sizes[Size.BOARD])
    copy(opened.counters, counters, count)


def script(book: Any, rows: int) -> int:
    """Write what the agents' frames would do now into the actions of all rows."""
    for row in range(rows):
        _script_row(book, row)
    return 0


def identify(book: Any, rows: int) -> int:
    """Write digests of the pictures of all rows."""
    gestures = int64_of(book, ArrayId.SIZES, ZERO)[Size.EXTRA]
    for row in range(rows):
        uint64_of(book, ArrayId.IMAGE_IDS, ZERO)[row] = image_digest(
            uint32_of(book, ArrayId.IMAGE, row), uint16_of(book, ArrayId.EXTRA, row), gestures
        )
    return 0
