"""This module compiles loops over the channels of a cell into vector instructions, with bfloat16 numbers in memory.

Left to itself LLVM chooses vectors a quarter as wide for them, and rounds to bfloat16 with half a dozen instructions
where the processor may have one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, cast

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.codegen import get_host_cpu_features
from numba.core.typing.templates import signature
from numba.extending import intrinsic


def _features() -> str:
    """What compiled code may use of the processor, as LLVM names it."""
    if config.CPU_FEATURES is not None:
        return str(config.CPU_FEATURES)
    return str(get_host_cpu_features()) if config.CPU_NAME is None else ""


FEATURES: Final = _features()
ROUNDS: Final = "+avx512bf16" in FEATURES
"""Whether the processor rounds to bfloat16 by itself."""

LANES: Final = 128
"""Channels that a loop is over: images must have as many, or a multiple."""

WIDTH: Final = 16
"""Float32 numbers in a vector."""

_INT = ir.VectorType(ir.IntType(32), WIDTH)
_SHORT = ir.VectorType(ir.IntType(16), WIDTH)
SINGLE = ir.VectorType(ir.FloatType(), WIDTH)


class BFloat(ir.types.Type):  # type: ignore[misc]
    """The number type, which llvmlite does not name."""

    def _to_string(self) -> str:
        return "bfloat"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, BFloat)

    def __hash__(self) -> int:
        return hash(BFloat)


class Memory:
    """An array that vectors are read from and written to: float32, or uint16 with the bits of bfloat16 numbers."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self._builder = builder
        self._start = context.make_array(kind)(context, builder, value).data
        self.is_single = kind.dtype == types.float32

    def address(self, index: Any) -> Any:
        """The address of an element."""
        return self._builder.gep(self._start, [index])


def load(builder: Any, address: Any, kind: Any) -> Any:
    """Emit a load of a kind of value, which may lie anywhere."""
    value = builder.load(builder.bitcast(address, kind.as_pointer()), typ=kind)
    value.align = 2
    return value


def store(builder: Any, value: Any, address: Any) -> None:
    """Emit a store of a value, which may lie anywhere."""
    builder.store(value, builder.bitcast(address, value.type.as_pointer())).align = 2


def repeated(builder: Any, value: Any) -> Any:
    """Emit a vector of one value."""
    nothing = ir.Constant(ir.VectorType(value.type, WIDTH), ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(_INT, [0] * WIDTH))


def rounded(builder: Any, number: Any) -> Any:
    """Emit the rounding of a vector of float32 to bfloat16, to even between two; NaN and infinity stay what they are.

    Where the processor does it, numbers too small for a full mantissa become 0.
    """
    if ROUNDS:
        return builder.bitcast(builder.fptrunc(number, ir.VectorType(BFloat(), WIDTH)), _SHORT)
    bits = builder.bitcast(number, _INT)
    odd = builder.and_(builder.lshr(bits, _all(16)), _all(1))
    up = builder.add(builder.add(bits, _all(0x7FFF)), odd)
    chosen = builder.select(builder.fcmp_ordered("==", number, number), up, _all(0x7FC00000))
    return builder.trunc(builder.lshr(chosen, _all(16)), _SHORT)


def _all(number: int) -> Any:
    return ir.Constant(_INT, [number] * WIDTH)


class Lanes:
    """Emits the operations of one vector of a loop. An index is that of the loop's first element in an array."""

    def __init__(self, builder: Any, first: int) -> None:
        self._builder = builder
        self._first = first

    def get(self, memory: Memory, index: Any) -> Any:
        """What an array holds, as float32."""
        address = self._address(memory, index)
        if memory.is_single:
            return load(self._builder, address, SINGLE)
        wide = self._builder.zext(load(self._builder, address, _SHORT), _INT)
        return self._builder.bitcast(self._builder.shl(wide, _all(16)), SINGLE)

    def put(self, memory: Memory, index: Any, value: Any) -> None:
        """Store in an array, rounded if it is one of bfloat16."""
        value = value if memory.is_single else rounded(self._builder, value)
        store(self._builder, value, self._address(memory, index))

    def put_pairs(self, memory: Memory, index: Any, even: Any, odd: Any) -> None:
        """Store two vectors as bfloat16 in an array of uint32, those of a lane together."""
        low, high = (self._builder.zext(rounded(self._builder, part), _INT) for part in (even, odd))
        pair = self._builder.or_(low, self._builder.shl(high, _all(16)))
        store(self._builder, pair, self._address(memory, index))

    def weighted(self, *terms: Any) -> Any:
        """The sum of vectors times numbers, given one after the other: `a, u, b, v` for a * u + b * v."""
        total = self._builder.fmul(terms[0], repeated(self._builder, terms[1]))
        kind = ir.FunctionType(SINGLE, [SINGLE] * 3)
        fused = cgutils.get_or_insert_function(self._builder.module, kind, f"llvm.fmuladd.v{WIDTH}f32")
        for vector, number in zip(terms[2::2], terms[3::2], strict=True):
            total = self._builder.call(fused, [vector, repeated(self._builder, number), total])
        return total

    def plus(self, one: Any, other: Any) -> Any:
        """A sum."""
        return self._builder.fadd(one, other)

    def at_least(self, value: Any, bound: Any) -> Any:
        """The larger of a vector and a number; NaN stays."""
        lowest = repeated(self._builder, bound)
        return self._builder.select(self._builder.fcmp_ordered("<", value, lowest), lowest, value)

    def where_positive(self, value: Any, other: Any) -> Any:
        """A vector where another is positive or NaN, else 0."""
        nothing = ir.Constant(SINGLE, None)
        return self._builder.select(self._builder.fcmp_unordered(">", other, nothing), value, nothing)

    def _address(self, memory: Memory, index: Any) -> Any:
        return memory.address(self._builder.add(index, ir.Constant(ir.IntType(64), self._first)))


def over_lanes(emit: Callable[..., None]) -> Callable[..., None]:
    """Of a function that emits one vector make one that compiled code calls, which does all `LANES`.

    It takes arrays, indices as integers and numbers as floats, and emits with `Memory` and LLVM's values of them.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def called(context: Any, *given: Any) -> Any:
        kinds = [_taken(kind) for kind in given]

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            values = [
                Memory(context, builder, kind, value) if isinstance(kind, types.Array) else value
                for kind, value in zip(kinds, cgutils.unpack_tuple(builder, arguments[0]), strict=True)
            ]
            for first in range(0, LANES, WIDTH):
                emit(Lanes(builder, first), *values)
            return context.get_dummy_value()

        return signature(types.none, types.StarArgTuple.from_types(kinds)), generate

    return cast(Callable[..., None], called)


def _taken(kind: Any) -> Any:
    """The type that an argument is converted to."""
    if isinstance(kind, types.Array):
        return kind
    return types.float32 if isinstance(kind, types.Float) else types.int64
