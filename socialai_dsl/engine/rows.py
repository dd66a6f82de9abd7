"""Opens one row of a batch: the pointers that the engine's functions work with."""

from typing import Any

import numpy as np

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.pointers import int32_of, int64_of, registers_of, tokens_of, uint32_of, uint64_of
from socialai_dsl.engine.state import ZERO, ArrayId, Key, Link, Row
from socialai_dsl.program import Header


@inline
def open_row(book: Any, layout: int, row: int) -> Row:
    """One environment, with the pins of a layout."""
    key = uint64_of(book, ArrayId.KEYS, row)
    program = int32_of(book, ArrayId.WORDS, np.int64(key[Key.PROGRAM]))
    return Row(
        program,
        registers_of(book, ArrayId.REGISTERS, row),
        uint32_of(book, ArrayId.BOARDS, row),
        key,
        tokens_of(book, ArrayId.TOKENS, row),
        int64_of(book, ArrayId.COUNTERS, program[program[Header.SIZE] + Link.COUNTERS]),
        registers_of(book, ArrayId.PINS, layout),
        int64_of(book, ArrayId.SCRATCH, ZERO),
        uint32_of(book, ArrayId.SETS, ZERO),
    )


@inline
def copy(target: Any, source: Any, count: int) -> None:
    """Copy some numbers from where one pointer points to where another does."""
    for i in range(count):
        target[i] = source[i]
