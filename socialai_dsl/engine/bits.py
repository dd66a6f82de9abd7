"""Counting and finding bits of words."""

import numpy as np

from socialai_dsl.engine.jit import inline

_WORD = 0xFFFFFFFF
_ODD = 0x55555555
_PAIRS = 0x33333333
_NIBBLES = 0x0F0F0F0F
_BYTES = 0x01010101


@inline
def count_bits(word: int) -> int:
    """How many of the lower 32 bits are set: in pairs, in nibbles, in bytes, then of all bytes together."""
    word &= _WORD
    word -= (word >> 1) & _ODD
    word = (word & _PAIRS) + ((word >> 2) & _PAIRS)
    word = (word + (word >> 4)) & _NIBBLES
    return np.int64((word * _BYTES & _WORD) >> 24)


@inline
def lowest_bit(word: int) -> int:
    """Position of the lowest set bit of a number below 2**32; 32 if none is set."""
    return count_bits((word & -word) - 1)


@inline
def nth_bit(word: int, n: int) -> int:
    """Position of the n-th set bit, counted from 0 and from the lowest; it must exist."""
    for _ in range(n):
        word &= word - 1
    return lowest_bit(word)
