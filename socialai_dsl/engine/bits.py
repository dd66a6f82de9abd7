"""Counting and finding bits of words."""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.jit import inline

_WORD = 0xFFFFFFFF
_END = np.int64(1 << 32)


def _instruction(emit: Callable[[Any, Any], Any]) -> Any:
    """One of the processor's instructions, where it has it; written with shifts and masks it takes a dozen."""

    @intrinsic
    def called(context: Any, word: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return emit(builder, arguments[0])

        return signature(types.int64, types.int64), generate

    return called


def _zeros_below(word: int) -> int:
    return (word & -word).bit_length() - 1


if config.DISABLE_JIT:
    _ones, _zeros = int.bit_count, _zeros_below
else:
    _ones = _instruction(lambda builder, word: builder.ctpop(word))
    _zeros = _instruction(lambda builder, word: builder.cttz(word, ir.IntType(1)(1)))


@inline
def count_bits(word: int) -> int:
    """How many of the lower 32 bits are set."""
    return np.int64(_ones(int(word & _WORD)))


@inline
def lowest_bit(word: int) -> int:
    """Position of the lowest set bit of a number below 2**32; 32 if none is set."""
    return np.int64(_zeros(int(word | _END)))


@inline
def nth_bit(word: int, n: int) -> int:
    """Position of the n-th set bit, counted from 0 and from the lowest; it must exist."""
    for _ in range(n):
        word &= word - 1
    return lowest_bit(word)
