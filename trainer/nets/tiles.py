"""This module multiplies tiles of bfloat16 matrices with the processor's own dot products, sums in float32.

A library chooses its way for each shape anew and copies the right matrix into the order it likes before each product;
for the few images of a step that takes longer than the product. Here the right matrix is kept in that order: numbers
of two rows that are one above the other, a pair, lie together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, cast

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from trainer.nets.kernels import AVAILABLE
from trainer.nets.lanes import (
    FEATURES,
    ROUNDS,
    SINGLE,
    WIDTH,
    BFloat,
    Memory,
    load,
    repeated,
    rounded,
    store,
)

NATIVE: Final = AVAILABLE and ROUNDS and "+amx-bf16" not in FEATURES
"""Whether the processor has these dot products, and nothing faster that a library would use."""

ROWS: Final = 3
PANEL: Final = 128
"""Rows and columns of a tile of `multiply`: its sums fill the registers."""

ADDED_ROWS: Final = 4
ADDED_COLUMNS: Final = 64
"""Rows and columns of a tile of `multiply_add`; both divide the channels that images have."""

_WORD = ir.IntType(64)
_PAIRS = ir.VectorType(BFloat(), 2 * WIDTH)


def _tile(rows: int, columns: int) -> Callable[..., None]:
    """A function that multiplies a tile of this size, to be compiled into those that call it.

    It is given arrays of which it takes elements by number, the numbers of a pair one after the other if elements are
    uint16, together if they are uint32:

        left, at_left, row, step: pair p of row r of the left matrix is at `at_left + r * row + p * step`.
        right, at_right, right_step: pair p of the first column of the right matrix is at `at_right + p * right_step`,
            those of other columns follow it.
        target, at_target, target_row: row r of the product begins at `at_target + r * target_row`. It is added to
            float32 numbers, and written over bfloat16.
        pairs: how many there are, at least one.
    """
    vectors = columns // WIDTH

    @intrinsic  # type: ignore[untyped-decorator]
    def multiply(
        context: Any,
        left: Any,
        at_left: Any,
        row: Any,
        step: Any,
        right: Any,
        at_right: Any,
        right_step: Any,
        target: Any,
        at_target: Any,
        target_row: Any,
        pairs: Any,
    ) -> Any:
        number = types.int64
        takes = [left, number, number, number, right, number, number, target, number, number, number]

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            (
                of_left,
                at_left,
                row,
                step,
                of_right,
                at_right,
                right_step,
                made,
                at_target,
                target_row,
                pairs,
            ) = (
                Memory(context, builder, kind, value) if isinstance(kind, types.Array) else value
                for kind, value in zip(takes, arguments, strict=True)
            )
            sums = _sums(
                builder, (of_left, at_left, row, step), (of_right, at_right, right_step), pairs, rows, vectors
            )
            for r, line in enumerate(sums):
                for v, total in enumerate(line):
                    column = builder.add(at_target, _word(WIDTH * v))
                    address = made.address(builder.add(column, builder.mul(target_row, _word(r))))
                    if made.is_single:
                        store(builder, builder.fadd(load(builder, address, SINGLE), total), address)
                    else:
                        store(builder, rounded(builder, total), address)
            return context.get_dummy_value()

        return signature(types.none, *takes), generate

    return cast(Callable[..., None], multiply)


def _sums(builder: Any, left: Any, right: Any, pairs: Any, rows: int, vectors: int) -> list[list[Any]]:
    """Emit the loop over pairs; the sums of each row and vector, which stay in registers until its end."""
    (of_left, at_left, row, step), (of_right, at_right, right_step) = left, right
    before = builder.block
    loop, end = builder.append_basic_block("pairs"), builder.append_basic_block("sums")
    starts = [of_left.address(builder.add(at_left, builder.mul(row, _word(r)))) for r in range(rows)]
    starts.append(of_right.address(at_right))
    builder.branch(loop)

    builder.position_at_end(loop)
    count, addresses = builder.phi(_WORD), [builder.phi(start.type) for start in starts]
    sums = [[builder.phi(SINGLE) for _ in range(vectors)] for _ in range(rows)]
    dot = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(SINGLE, [SINGLE, _PAIRS, _PAIRS]), "llvm.x86.avx512bf16.dpbf16ps.512"
    )
    # One vector of the right matrix at a time: beside the sums there is hardly a register left.
    pair_of_row = [_pair(builder, address) for address in addresses[:-1]]
    made: list[list[Any]] = [[] for _ in range(rows)]
    panel = builder.bitcast(addresses[-1], _PAIRS.as_pointer())
    for v in range(vectors):
        column = load(builder, builder.gep(panel, [_word(v)]), _PAIRS)
        for pair, line, new in zip(pair_of_row, sums, made, strict=True):
            new.append(builder.call(dot, [line[v], pair, column]))
    following = builder.add(count, _word(1))
    after = [*(builder.gep(address, [step]) for address in addresses[:-1])]
    after.append(builder.gep(addresses[-1], [right_step]))
    builder.cbranch(builder.icmp_signed("<", following, pairs), loop, end)

    values = [count, *addresses, *(total for line in sums for total in line)]
    first = [_word(0), *starts, *[ir.Constant(SINGLE, None)] * (rows * vectors)]
    again = [following, *after, *(total for line in made for total in line)]
    for value, one, other in zip(values, first, again, strict=True):
        value.add_incoming(one, before)
        value.add_incoming(other, loop)
    builder.position_at_end(end)
    return made


def _pair(builder: Any, address: Any) -> Any:
    """Emit a vector of the pair at an address."""
    return builder.bitcast(repeated(builder, load(builder, address, ir.IntType(32))), _PAIRS)


def _word(number: int) -> Any:
    return ir.Constant(_WORD, number)


multiply = _tile(ROWS, PANEL)
"""Multiply a tile of `ROWS` x `PANEL`; see `_tile`."""

multiply_add = _tile(ADDED_ROWS, ADDED_COLUMNS)
"""Multiply a tile of `ADDED_ROWS` x `ADDED_COLUMNS`; see `_tile`."""
