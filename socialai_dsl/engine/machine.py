"""The engine's functions that Python calls: machine code from the disk, or compiled and kept for the next process.

Loading it takes LLVM and C's calling convention only. Numba, which takes longer to import than all else, is loaded
where there is something to compile.
"""

import ctypes
from collections.abc import Callable, Iterable
from functools import cache, partial
from importlib import import_module
from threading import RLock
from typing import Any, Final, cast

import llvmlite.binding as llvm

from socialai_dsl.engine.cache import keep, read
from socialai_dsl.engine.helper import Helper
from socialai_dsl.engine.settings import is_interpreted

_INTERPRETER: Final = "interpreter"
_HOMES: Final = {
    _INTERPRETER: "socialai_dsl.engine.vm",
    "serve": "socialai_dsl.engine.kernel",
    "script": "socialai_dsl.engine.queries",
    "identify": "socialai_dsl.engine.queries",
}
"""The module that has the function, a `Separate`, under this name."""

_ENTRY: Final = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)

_LOADING: Final = RLock()
_addresses: dict[str, int] = {}

Call = Callable[[], int]


def prepare_call(name: str, book: Any, *numbers: int) -> Call:
    """A call of `serve`, `script` or `identify` with a book (`book.make_book`) and numbers.

    Its arguments are converted once, here: for a single environment that takes longer than a step. It lets other
    threads run. The book must live as long as the call.
    """
    if is_interpreted():
        return partial(_separate(name).function, book, *numbers)
    address = _load(_INTERPRETER, name)
    arguments = (ctypes.c_int64 * (1 + len(numbers)))(ctypes.addressof(book), *numbers)
    pointer = ctypes.cast(arguments, ctypes.c_void_p)  # it keeps them alive
    return partial(_ENTRY(address), pointer)


def addresses_of(call: Call) -> tuple[int, int]:
    """The address of what a prepared call calls, and that of its arguments, for others to call it from machine code.

    The call must live as long as they do.
    """
    assert isinstance(call, partial), "internal: the engine is run as plain Python, which has no address"
    pointer = call.args[0]
    return ctypes.cast(call.func, ctypes.c_void_p).value or 0, (pointer.value or 0) if pointer else 0


def symbol_of(name: str) -> str:
    """The name that a function of the engine is known by in the whole process."""
    return f"socialai_dsl_{name}"


def load_object(symbol: str, code: bytes) -> int:
    """The address of a function, after its machine code was loaded."""
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return int(engine.get_function_address(symbol))


def load_assembly(text: str, symbols: Iterable[str]) -> list[int]:
    """The addresses of functions that are written in LLVM's assembly."""
    with _LOADING:
        engine = _engine()
        engine.add_module(llvm.parse_assembly(text))
        engine.finalize_object()
        return [int(engine.get_function_address(symbol)) for symbol in symbols]


def provide(name: str) -> bytes:
    """The machine code of a function, from the disk, or compiled and kept there."""
    code = read(name)
    if code is None:
        code = cast(bytes, _separate(name).object_code())
        keep(name, code)
    return code


def _load(*names: str) -> int:
    """Load functions in this order, as each may call those before it; the address of the last."""
    with _LOADING:
        codes = {name: read(name) for name in names if name not in _addresses}
        missing = [name for name, code in codes.items() if code is None]
        helpers = {name: Helper(name) for name in missing[1:]}
        for name in missing:
            if name in helpers:
                helpers[name].wait()
            codes[name] = provide(name)
        for name, code in codes.items():
            _addresses[name] = load_object(symbol_of(name), cast(bytes, code))
            assert _addresses[name] != 0, f"internal: no {name} in its own code"
        return _addresses[names[-1]]


def _separate(name: str) -> Any:
    return getattr(import_module(_HOMES[name]), name)


@cache
def _engine() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
