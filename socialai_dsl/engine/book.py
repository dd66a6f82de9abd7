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


def replace_in(book: Any, which: int, array: NDArray[Any]) -> Any:
    """Put an array where one of the same type and width was; what `put_back` takes to undo it."""
    assert array.flags.c_contiguous, "internal: arrays of a book are contiguous"
    place, entry = (which, array) if isinstance(book, list) else (2 * which, _address_of(array))
    before, book[place] = book[place], entry
    return place, before


def _address_of(array: NDArray[Any]) -> int:
    # What NumPy gives takes four times as long, and this happens in every step.
    return ctypes.addressof(ctypes.c_byte.from_buffer(array)) if array.flags.writeable else array.ctypes.data


def put_back(book: Any, replaced: Any) -> None:
    """Undo a `replace_in`."""
    place, before = replaced
    book[place] = before
