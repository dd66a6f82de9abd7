"""Arrays in the form that the engine takes them in."""

import ctypes
from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from socialai_dsl.engine.settings import is_interpreted


def make_book(arrays: Sequence[NDArray[Any]]) -> Any:
    """The arrays as compiled code takes them: int64, address and bytes of a row of each in turn.

    The arrays must live, and stay where they are, as long as the book is used.
    """
    if is_interpreted():
        return list(arrays)
    assert all(array.flags.c_contiguous for array in arrays), "internal: arrays of a book are contiguous"
    numbers = [number for array in arrays for number in (array.ctypes.data, array.strides[0])]
    return (ctypes.c_int64 * len(numbers))(*numbers)


def replace_in(book: Any, which: int, array: NDArray[Any]) -> None:
    """Put an array where one of the same type and width was."""
    assert array.flags.c_contiguous, "internal: arrays of a book are contiguous"
    if isinstance(book, list):
        book[which] = array
    else:
        book[2 * which] = _address_of(array)


def _address_of(array: NDArray[Any]) -> int:
    # What NumPy gives takes four times as long, and this happens in every step.
    return ctypes.addressof(ctypes.c_byte.from_buffer(array)) if array.flags.writeable else array.ctypes.data
