"""A picture gathered from a board: by permutations of vectors where the processor has them and the board is small.

A board of at most 64 cells lies in four vectors of sixteen, and an instruction picks sixteen cells of two of them at
once. One cell after the other, stores alone take twice as long.
"""

from typing import Any, Final

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.codegen import get_host_cpu_features
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.views import CELLS, SMALL_CANVAS

_LANES: Final = 16


def _has_permutations() -> bool:
    """Whether compiled code may use vectors of sixteen words."""
    features = config.CPU_FEATURES
    if features is None:
        features = get_host_cpu_features() if config.CPU_NAME is None else ""
    return not config.DISABLE_JIT and "+avx512f" in features


PERMUTES: Final = _has_permutations()
"""Whether `permute` can be called."""


@intrinsic
def _permute(context: Any, image: Any, board: Any, views: Any, start: Any) -> Any:
    words, numbers = ir.VectorType(ir.IntType(32), _LANES), ir.VectorType(ir.IntType(16), _LANES)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        image, board, views, start = arguments

        def load(pointer: Any, index: Any, kind: Any, align: int) -> Any:
            place = builder.bitcast(builder.gep(pointer, [index]), kind.as_pointer())
            value = builder.load(place, typ=kind)
            value.align = align
            return value

        def number(value: int) -> Any:
            return ir.Constant(words, [value] * _LANES)

        kind = ir.FunctionType(words, [words, words, words])
        pick = cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.avx512.vpermi2var.d.512")
        lines = [load(board, start.type(_LANES * k), words, 4) for k in range(SMALL_CANVAS // _LANES)]
        beyond = builder.load(builder.gep(board, [start.type(SMALL_CANVAS)]))
        nothing = ir.Constant(words, ir.Undefined)
        beyond = builder.insert_element(nothing, beyond, ir.Constant(ir.IntType(32), 0))
        beyond = builder.shuffle_vector(beyond, nothing, number(0))
        for first in range(0, CELLS - 1, _LANES):
            cells = builder.zext(load(views, builder.add(start, start.type(first)), numbers, 2), words)
            low, high = (builder.call(pick, [lines[k], cells, lines[k + 1]]) for k in (0, 2))
            seen = builder.select(builder.icmp_unsigned(">=", cells, number(2 * _LANES)), high, low)
            seen = builder.select(builder.icmp_unsigned(">=", cells, number(SMALL_CANVAS)), beyond, seen)
            place = builder.bitcast(builder.gep(image, [start.type(first)]), words.as_pointer())
            builder.store(seen, place).align = 4
        return context.get_dummy_value()

    return signature(types.none, image, board, views, types.intp), generate


@inline
def permute(image: Any, board: Any, views: Any, start: int) -> None:
    """Let the picture's cells be those of the board that the table of views names from `start` on."""
    _permute(image, board, views, start)
    image[CELLS - 1] = board[views[start + CELLS - 1]]
