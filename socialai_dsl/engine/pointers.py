"""Rows of arrays as bare pointers: one machine word each, where an array is seven and a count of references.

What is read through a pointer is an int64 (a uint64 where the array holds such), what is written is cut to the array's
type. So every helper is compiled for one kind of number. In plain Python pointers become `GuardedArray`, which finds
every access outside its row.
"""

import operator
from collections.abc import Sequence
from typing import Any, Final, Generic, TypeVar

import numpy as np
from numba import config, from_dtype, types
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable
from numpy.typing import NDArray

from socialai_dsl.engine.jit import inline
from socialai_dsl.widths import REGISTER, TOKEN

_Scalar = TypeVar("_Scalar", bound=np.generic)


def make_book(arrays: Sequence[NDArray[Any]]) -> Any:
    """The arrays as the engine takes them: int64, address and bytes of a row of each in turn.

    The arrays must live, and stay where they are, as long as the book is used.
    """
    if config.DISABLE_JIT:
        return list(arrays)
    assert all(array.flags.c_contiguous for array in arrays), "internal: arrays of a book are contiguous"
    return np.array(
        [number for array in arrays for number in (array.ctypes.data, array.strides[0])], np.int64
    )


def replace_in(book: Any, which: int, array: NDArray[Any]) -> None:
    """Put an array where one of the same type and width was."""
    assert array.flags.c_contiguous, "internal: arrays of a book are contiguous"
    if isinstance(book, list):
        book[which] = array
    else:
        book[2 * which] = array.ctypes.data


class GuardedArray(Generic[_Scalar]):
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


def _pointers_to(kind: type[np.generic]) -> Any:
    """The function `(book, which, row)` that gives a pointer to a row of an array of this type."""
    dtype = from_dtype(np.dtype(kind))

    @intrinsic
    def to_pointer(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return Pointer(dtype)(types.int64), generate

    def pointer(book: Any, which: int, row: int) -> Any:
        return to_pointer(book[2 * which] + row * book[2 * which + 1])

    return inline(pointer)


def _guarded(kind: type[np.generic]) -> Any:
    """The same in plain Python, where numbers are also read as what the caller takes them for."""

    def pointer(book: Any, which: int, row: int) -> GuardedArray[Any]:
        array = book[which].view(kind)
        return GuardedArray(array[int(row) :] if array.ndim == 1 else array[int(row)])

    return pointer


_KINDS: Final = (np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.float64)
bytes_of, int16_of, uint16_of, int32_of, uint32_of, int64_of, uint64_of, float64_of = (
    _guarded(kind) if config.DISABLE_JIT else _pointers_to(kind) for kind in _KINDS
)
"""`int16_of(book, which, row)` and so on: a pointer to a row of an array of two dimensions, or into one of one."""

registers_of = {"int16": int16_of, "int32": int32_of, "int64": int64_of}[REGISTER]
tokens_of = {"int16": int16_of, "int32": int32_of}[TOKEN]


@intrinsic
def _to_first(context: Any, array: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(array)(context, builder, arguments[0]).data

    return Pointer(types.int64)(array), generate


def _itself(book: Any) -> Any:
    return book


bare = _itself if config.DISABLE_JIT else _to_first
"""A book as a pointer: handing on the array would count its references, in every step of every row."""

_INDEX: Final = (types.Integer, types.IntEnumMember)


@type_callable(operator.getitem)
def _type_of_read(context: Any) -> Any:
    def typer(array: Any, index: Any) -> Any:
        return array.read if isinstance(array, Pointer) and isinstance(index, _INDEX) else None

    return typer


@type_callable(operator.setitem)
def _type_of_write(context: Any) -> Any:
    def typer(array: Any, index: Any, value: Any) -> Any:
        return types.none if isinstance(array, Pointer) and isinstance(index, _INDEX) else None

    return typer


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    index = context.cast(builder, arguments[1], signature.args[1], types.intp)
    return builder.gep(arguments[0], [index])


@lower_builtin(operator.getitem, Pointer, types.Integer)
@lower_builtin(operator.getitem, Pointer, types.IntEnumMember)
def _load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    return context.cast(
        builder, builder.load(_place(context, builder, signature, arguments)), kind.dtype, kind.read
    )


@lower_builtin(operator.setitem, Pointer, types.Integer, types.Any)
@lower_builtin(operator.setitem, Pointer, types.IntEnumMember, types.Any)
def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    number = context.cast(builder, arguments[2], signature.args[2], signature.args[0].dtype)
    builder.store(number, _place(context, builder, signature, arguments))
    return context.get_dummy_value()
