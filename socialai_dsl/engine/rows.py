"""Opens one row of a batch: the pointers that the engine's functions work with."""

from typing import Any

import numpy as np

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.pointers import int32_of, int64_of, registers_of, tokens_of, uint32_of, uint64_of
from socialai_dsl.engine.state import ZERO, Book, Key, Link, Row
from socialai_dsl.program import Header


@inline
def open_row(book: Any, layout: int, row: int) -> Row:
    """One environment, with the pins of a layout."""
    key = uint64_of(book, Book.KEYS, row)
    program = int32_of(book, Book.WORDS, np.int64(key[Key.PROGRAM]))
    return Row(
        program,
        registers_of(book, Book.REGISTERS, row),
        uint32_of(book, Book.BOARDS, row),
        key,
        tokens_of(book, Book.TOKENS, row),
        int64_of(book, Book.COUNTERS, program[program[Header.SIZE] + Link.COUNTERS]),
        registers_of(book, Book.PINS, layout),
        int64_of(book, Book.SCRATCH, ZERO),
        uint32_of(book, Book.SETS, ZERO),
    )


@inline
def copy(target: Any, source: Any, count: int) -> None:
    """Copy some numbers from where one pointer points to where another does."""
    for i in range(count):
        target[i] = source[i]
