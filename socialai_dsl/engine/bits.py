"""Counting and finding bits of words."""

import numpy as np

from socialai_dsl.engine.jit import inline

_FIVES = np.int64(0x55555555)
_THREES = np.int64(0x33333333)
_NIBBLES = np.int64(0x0F0F0F0F)


@inline
def count_bits(word: int) -> int:
    """How many of the lower 32 bits are set."""
    word = word - ((word >> 1) & _FIVES)
    word = (word & _THREES) + ((word >> 2) & _THREES)
    word = (word + (word >> 4)) & _NIBBLES
    return (word + (word >> 8) + (word >> 16) + (word >> 24)) & 63


@inline
def lowest_bit(word: int) -> int:
    """Position of the lowest set bit of a number below 2**32; 32 if none is set."""
    return count_bits(((word & -word) - 1) & 0xFFFFFFFF)


@inline
def nth_bit(word: int, n: int) -> int:
    """Position of the n-th set bit, counted from 0 and from the lowest; it must exist."""
    for _ in range(n):
        word &= word - 1
    return lowest_bit(word)
