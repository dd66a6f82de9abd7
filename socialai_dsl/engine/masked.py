"""As many numbers as there are, read in one vector whose other lanes are left alone."""

from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.vectors import HALF, LANES, WORD, WORDS, counted, in_all, place
from socialai_dsl.program import VIEW

_LINE: Final = (1 << VIEW) - 1


def _load(builder: Any, pointer: Any, index: Any, chosen: Any, otherwise: Any) -> Any:
    """Some numbers of a row; in lanes that are not chosen other ones, and no memory is read there."""
    kind = otherwise.type
    name = f"llvm.masked.load.v{kind.count}i{kind.element.width}.p0"
    function = ir.FunctionType(kind, [kind.as_pointer(), WORD, chosen.type, kind])
    load = cgutils.get_or_insert_function(builder.module, function, name)
    at = place(builder, pointer, index, kind)
    return builder.call(load, [at, WORD(kind.element.width // 8), chosen, otherwise])


def _store(builder: Any, value: Any, pointer: Any, index: Any, chosen: Any) -> None:
    """Write those numbers that are chosen, and leave the others alone."""
    kind = value.type
    name = f"llvm.masked.store.v{kind.count}i{kind.element.width}.p0"
    function = ir.FunctionType(ir.VoidType(), [kind, kind.as_pointer(), WORD, chosen.type])
    store = cgutils.get_or_insert_function(builder.module, function, name)
    at = place(builder, pointer, index, kind)
    builder.call(store, [value, at, WORD(kind.element.width // 8), chosen])


@intrinsic
def opaque_lines(context: Any, board: Any, first: Any, lines: Any, top: Any, beyond: Any, left: Any) -> Any:
    """The cells of a square as large as a view that one cannot look through, a byte for each of its lines.

    Line 0 of the room is number `first` of the board, bit k of a line its cell k, and the square begins at cell `left`
    of line `top`. What is off the canvas is opaque: lines from `lines` on, cells whose bit in `beyond` is set, and
    whatever comes before.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        board, first, lines, top, beyond, left = arguments
        wide = ir.IntType(64)
        bits, words = ir.VectorType(wide, VIEW + 1), ir.VectorType(WORD, VIEW + 1)

        def each(number: Any) -> Any:
            return in_all(builder, number, bits)

        numbers = builder.add(each(top), counted(bits))
        inside = builder.icmp_unsigned("<", numbers, each(lines))
        inside = builder.and_(inside, ir.Constant(inside.type, [1] * VIEW + [0]))
        opaque = ir.Constant(words, [-1] * (VIEW + 1))
        cells = builder.zext(_load(builder, board, builder.add(first, top), inside, opaque), bits)
        cells = builder.shl(builder.or_(cells, each(beyond)), each(wide(VIEW)))
        cells = builder.or_(cells, each(wide(_LINE)))
        cells = builder.lshr(cells, each(builder.add(left, wide(VIEW))))
        cells = builder.and_(cells, ir.Constant(bits, [_LINE] * VIEW + [0]))
        return builder.bitcast(builder.trunc(cells, ir.VectorType(ir.IntType(8), VIEW + 1)), wide)

    return signature(types.uint64, board, *(types.intp,) * 5), generate


@intrinsic
def put_short(context: Any, tokens: Any, start: Any, room: Any, program: Any, first: Any, count: Any) -> Any:
    """Let the numbers of a row from `start` on be `count` of the program's from `first` on and then zeros, 16 in all.

    What lies `room` numbers behind the start, or further, is left alone.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        tokens, start, room, program, first, count = arguments
        halves = ir.VectorType(HALF, LANES)

        def lanes_below(number: Any) -> Any:
            return builder.icmp_signed(
                "<", counted(WORDS), in_all(builder, builder.trunc(number, WORD), WORDS)
            )

        nothing = ir.Constant(WORDS, [0] * LANES)
        line = builder.trunc(_load(builder, program, first, lanes_below(count), nothing), halves)
        _store(builder, line, tokens, start, lanes_below(room))
        return context.get_dummy_value()

    return signature(types.none, tokens, types.intp, types.intp, program, types.intp, types.intp), generate
