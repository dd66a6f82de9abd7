"""A picture gathered from a board: by permutations of vectors where the processor has them and the board is small.

A board of at most 64 cells lies in four vectors of sixteen, one of at most 128 in eight, and an instruction picks
sixteen cells of two of them at once. One cell after the other, stores alone take twice as long.
"""

from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.vectors import HALF, LANES, WORD, WORDS, get, in_all, put
from socialai_dsl.engine.views import CELLS, MEDIUM_CANVAS, OWN_LOOK, OWN_PLACE, SMALL_CANVAS

_BLOCKS: Final = range(0, CELLS - 1, LANES)
"""First cells of the vectors of a picture. One cell is left over, the last."""

_HALVES: Final = ir.VectorType(HALF, 2 * LANES)
"""The same vector in halves of words."""


def _each(value: int) -> Any:
    return ir.Constant(WORDS, [value] * LANES)


def _picked(builder: Any, vectors: list[Any], cells: Any) -> Any:
    """The words that numbers of cells name in vectors, whose number is a power of two."""
    kind = ir.FunctionType(WORDS, [WORDS] * 3)
    pick = cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.avx512.vpermi2var.d.512")
    seen = [
        builder.call(pick, [low, cells, high]) for low, high in zip(vectors[::2], vectors[1::2], strict=True)
    ]
    size = 2 * LANES
    while len(seen) > 1:
        is_high = builder.icmp_unsigned("!=", builder.and_(cells, _each(size)), _each(0))
        seen = [builder.select(is_high, high, low) for low, high in zip(seen[::2], seen[1::2], strict=True)]
        size *= 2
    return seen[0]


def _permuter(canvas: int) -> Any:
    """The intrinsic for boards of at most so many cells, which have a word more at least."""

    @intrinsic
    def permute(context: Any, image: Any, board: Any, views: Any, start: Any, lit: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            image, board, views, start, lit = arguments
            index = start.type
            vectors = [get(builder, board, index(first), WORDS) for first in range(0, canvas, LANES)]
            beyond = in_all(builder, get(builder, board, index(canvas), WORD), WORDS)

            def named(first: int, kind: Any) -> Any:
                """The numbers of the cells that some of the picture show."""
                return get(builder, views, builder.add(start, index(first)), kind)

            def lit_from(first: int, kind: Any) -> Any:
                return builder.trunc(builder.lshr(lit, lit.type(first)), kind)

            for first in _BLOCKS:
                cells = builder.zext(named(first, ir.VectorType(HALF, LANES)), WORDS)
                seen = _picked(builder, vectors, cells)
                seen = builder.select(builder.icmp_unsigned(">=", cells, _each(canvas)), beyond, seen)
                bits = ir.VectorType(ir.IntType(1), LANES)
                shown = builder.bitcast(lit_from(first, ir.IntType(LANES)), bits)
                seen = builder.select(shown, seen, _each(0))
                if first <= OWN_PLACE < first + LANES:
                    seen = builder.insert_element(seen, WORD(OWN_LOOK), WORD(OWN_PLACE - first))
                put(builder, seen, image, index(first))
            last = CELLS - 1
            seen = get(builder, board, builder.zext(named(last, HALF), index), WORD)
            seen = builder.select(lit_from(last, ir.IntType(1)), seen, WORD(0))
            put(builder, seen, image, index(last))
            return context.get_dummy_value()

        return signature(types.none, image, board, views, types.intp, types.uint64), generate

    return permute


permute_small, permute_medium = (_permuter(canvas) for canvas in (SMALL_CANVAS, MEDIUM_CANVAS))
"""`permute_small(image, board, views, start, lit)`: let the picture's cells be those of a board that has at most
`SMALL_CANVAS` cells. The table of views names them from `start` on. What is not lit (bit 7 i + j for image[i, j]) reads
0, the agent's own place `OWN_LOOK`. `permute_medium` is for boards of at most `MEDIUM_CANVAS` cells.
"""


@intrinsic
def spread_out(context: Any, picture: Any, image: Any) -> Any:
    """Write a picture's cells, uint32, into one of three uint16 for each; all bits of the third are set."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        picture, image = arguments
        index = context.get_value_type(types.intp)
        parts = [divmod(lane, 3) for lane in range(3 * LANES)]
        order = [2 * LANES if part == 2 else 2 * cell + part for cell, part in parts]
        all_set = ir.Constant(_HALVES, [0xFFFF] * 2 * LANES)
        for first in _BLOCKS:
            words = get(builder, image, index(first), _HALVES)
            for start, end in ((0, 2 * LANES), (2 * LANES, 3 * LANES)):
                chosen = ir.Constant(ir.VectorType(WORD, end - start), order[start:end])
                cells = builder.shuffle_vector(words, all_set, chosen)
                put(builder, cells, picture, index(3 * first + start))
        last = 3 * (CELLS - 1)
        put(builder, get(builder, image, index(CELLS - 1), WORD), picture, index(last))
        put(builder, HALF(0xFFFF), picture, index(last + 2))
        return context.get_dummy_value()

    return signature(types.none, picture, image), generate
