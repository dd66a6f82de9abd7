"""Counting and finding bits of words."""

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import ZERO

_WORD = 0xFFFFFFFF


@inline
def count_bits(word: int) -> int:
    """How many of the lower 32 bits are set; written so that LLVM makes one instruction of it."""
    word &= _WORD
    count = ZERO
    while word != 0:
        word &= word - 1
        count += 1
    return count


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
