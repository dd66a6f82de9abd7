"""Rows of arrays as bare pointers: one machine word each, where an array is seven and a count of references.

What is read through a pointer is an int64 (a uint64 where the array holds such), what is written is cut to the array's
type. So every helper is compiled for one kind of number, and the engine ten times as fast as with arrays. With
`NUMBA_DISABLE_JIT=1` the same functions run as plain Python, and pointers become `Guarded`, which finds every access
outside its row.
"""

import operator
from typing import Any, Final, Generic, TypeVar

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.numpy_support import as_dtype
from numpy.typing import NDArray

_Scalar = TypeVar("_Scalar", bound=np.generic)


class Guarded(Generic[_Scalar]):
    """An array that refuses negative and too large indices."""

    def __init__(self, array: NDArray[_Scalar]) -> None:
        self._array = array

    def __getitem__(self, index: int) -> Any:
        value = self._array[self._checked(index)]
        return value if value.dtype in (np.uint64, np.float64) else np.int64(value)

    def __setitem__(self, index: int, value: int) -> None:
        self._array[self._checked(index)] = np.asarray(value).astype(self._array.dtype)

    def _checked(self, index: int) -> int:
        if not 0 <= index < len(self._array):
            raise IndexError(f"index {index} is outside a row of {len(self._array)}")
        return index


class Pointer(types.Type):  # type: ignore[misc]
    """Numba's type of a pointer to numbers."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        self.read = dtype if dtype in (types.uint64, types.float64) else types.int64
        super().__init__(name=f"Pointer({dtype})")


@register_model(Pointer)
class _PointerModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Pointer) -> None:
        super().__init__(manager, kind, manager.lookup(kind.dtype).get_data_type().as_pointer())


def _pointers_to(dtype: Any) -> Any:
    """The function `(book, which, row)` that gives a pointer to a row of an array of this type."""

    @intrinsic
    def pointer(context: Any, book: Any, which: Any, row: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            entries = arguments[0]
            first = builder.shl(arguments[1], arguments[1].type(1))
            address = builder.load(builder.gep(entries, [first]))
            stride = builder.load(builder.gep(entries, [builder.add(first, first.type(1))]))
            place = builder.add(address, builder.mul(stride, arguments[2]))
            return builder.inttoptr(place, context.get_value_type(dtype).as_pointer())

        return signature(Pointer(dtype), book, types.intp, types.intp), generate

    return pointer


def _guarded(dtype: Any) -> Any:
    """The same in plain Python, where numbers are also read as what the caller takes them for."""

    def pointer(book: Any, which: int, row: int) -> Guarded[Any]:
        array = book[which].view(as_dtype(dtype))
        return Guarded(array[int(row) :] if array.ndim == 1 else array[int(row)])

    return pointer


_TYPES: Final = (
    *(types.uint8, types.int16, types.uint16, types.int32),
    *(types.uint32, types.int64, types.uint64, types.float64),
)
bytes_of, int16_of, uint16_of, int32_of, uint32_of, int64_of, uint64_of, float64_of = (
    _guarded(kind) if config.DISABLE_JIT else _pointers_to(kind) for kind in _TYPES
)
"""`int16_of(book, which, row)` and so on: a pointer to a row of an array of two dimensions, or into one of one."""


@infer_global(operator.getitem)
class _Get(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        array, index = args
        if isinstance(array, Pointer) and isinstance(index, types.Integer | types.IntEnumMember):
            return signature(array.read, array, types.intp)
        return None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        array, index, _ = args
        if isinstance(array, Pointer) and isinstance(index, types.Integer | types.IntEnumMember):
            return signature(types.none, array, types.intp, array.read)
        return None


@lower_builtin(operator.getitem, Pointer, types.Integer)
def _load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    number = builder.load(builder.gep(arguments[0], [arguments[1]]))
    return context.cast(builder, number, kind.dtype, kind.read)


@lower_builtin(operator.setitem, Pointer, types.Integer, types.Number)
def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    number = context.cast(builder, arguments[2], kind.read, kind.dtype)
    builder.store(number, builder.gep(arguments[0], [arguments[1]]))
    return context.get_dummy_value()


def _fetch_nothing(row: Any, index: int) -> None:
    """Plain Python has nothing to fetch."""


@intrinsic
def _fetch(context: Any, row: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        byte = ir.IntType(8).as_pointer()
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        place = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), byte)
        builder.call(fetch, [place, *(ir.Constant(number, n) for n in (1, 3, 1))])
        return context.get_dummy_value()

    return signature(types.none, row, types.intp), generate


fetch = _fetch_nothing if config.DISABLE_JIT else _fetch
"""`fetch(row, index)`: let the memory there come near while other work goes on; it is about to be written."""


_BLOCK: Final = 32
"""Numbers of 16 bits in a line of the cache."""


def _move_one_by_one(row: Any, shift: int, count: int) -> None:
    for i in range(count):
        row[i] = row[shift + i]


@intrinsic
def _move_down(context: Any, row: Any, shift: Any, count: Any) -> Any:
    assert row.dtype == types.int16, "internal: blocks are of int16"

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row, shift, count = arguments
        number, size = ir.IntType(16), count.type

        def load(index: Any, kind: Any) -> Any:
            place = builder.gep(row, [builder.add(index, shift)])
            value = builder.load(builder.bitcast(place, kind.as_pointer()), typ=kind)
            value.align = 2
            return value

        def store(value: Any, index: Any) -> None:
            place = builder.bitcast(builder.gep(row, [index]), value.type.as_pointer())
            builder.store(value, place).align = 2

        with builder.if_else(builder.icmp_signed(">=", count, size(_BLOCK))) as (long, short):
            with long:
                block = ir.VectorType(number, _BLOCK)
                last = builder.sub(count, size(_BLOCK))
                tail = load(last, block)  # before what it holds is overwritten
                with cgutils.for_range_slice(builder, size(0), last, size(_BLOCK)) as (index, _):
                    store(load(index, block), index)
                store(tail, last)
            with short, cgutils.for_range(builder, count) as loop:
                store(load(loop.index, number), loop.index)
        return context.get_dummy_value()

    return signature(types.none, row, types.intp, types.intp), generate


move_down = _move_one_by_one if config.DISABLE_JIT else _move_down
"""`move_down(row, shift, count)`: let the first `count` numbers of int16 be those that lie `shift` behind them.

That is `memmove`, which a loop would become, for rows so short that calling it takes as long as what it does.
"""


def _copy_one_by_one(target: Any, source: Any, count: int) -> None:
    for i in range(count):
        target[i] = source[i]


@intrinsic
def _copy_many(context: Any, target: Any, source: Any, count: Any) -> Any:
    assert target.dtype == source.dtype, "internal: numbers are copied as they are"

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        byte, size, flag = ir.IntType(8).as_pointer(), arguments[2].type, ir.IntType(1)
        kind = ir.FunctionType(ir.VoidType(), [byte, byte, size, flag])
        move = cgutils.get_or_insert_function(builder.module, kind, "llvm.memmove.p0.p0.i64")
        target, source = (builder.bitcast(pointer, byte) for pointer in arguments[:2])
        width = context.get_abi_sizeof(context.get_value_type(signature.args[0].dtype))
        builder.call(move, [target, source, builder.mul(arguments[2], size(width)), flag(0)])
        return context.get_dummy_value()

    return signature(types.none, target, source, types.intp), generate


copy_many = _copy_one_by_one if config.DISABLE_JIT else _copy_many
"""`copy_many(target, source, count)`: the C library's way, several times as fast as a loop where much is far away."""

ROW_TYPES: Final = tuple(
    Pointer(kind)
    for kind in (
        *(types.int32, types.int16, types.uint32, types.uint64, types.int16, types.uint32),
        *(types.int64, types.int64, types.int16, types.int64, types.uint32, types.uint16),
    )
)
"""Numba's types of the fields of a `state.Row`."""
