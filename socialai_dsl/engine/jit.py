"""Compilation of the engine's functions by Numba, into few entry points that Python calls.

With `NUMBA_DISABLE_JIT=1` all of them run as plain Python instead. None of them allocates memory.
"""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from threading import RLock
from typing import Any, Final, TypeVar, cast

import numpy as np
from numba import config, njit, types
from numba.extending import intrinsic

from socialai_dsl.engine.cache import cache_folder

_Function = TypeVar("_Function", bound=Callable[..., object])

_OPTIONS: Final[dict[str, bool | str]] = {"nogil": True, "error_model": "numpy"}
_HELPER: Final[dict[str, bool | str]] = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def is_interpreted() -> bool:
    """Whether the engine runs as plain Python."""
    return bool(config.DISABLE_JIT)


def inline(function: _Function) -> _Function:
    """Compile a helper into each of its callers."""
    return cast(_Function, njit(**_HELPER, forceinline=True)(function))


def merged(function: _Function) -> _Function:
    """Write a function out in its callers before anything is compiled: for what leads to the interpreter."""
    return cast(_Function, njit(**_HELPER, inline="always")(function))


def outline(function: _Function) -> _Function:
    """Compile a function that is called: it runs rarely, or is large."""
    return cast(_Function, njit(**_HELPER, forceinline=False)(function))


def compiled(function: _Function) -> _Function:
    """Compile a function that Python calls and that may allocate."""
    return cast(_Function, njit(**_OPTIONS)(function))


_LOADING: Final = RLock()
_loaded: dict[Callable[..., int], Callable[..., int]] = {}


def load(function: Callable[..., int]) -> Callable[..., int]:
    """A function of a book (`pointers.make_book`) and numbers as Python calls it: from the disk, or compiled and kept.

    In plain Python it is the function itself, with numbers that wrap around as those of compiled code do.
    """
    if is_interpreted():
        return np.errstate(over="ignore")(function)
    with _LOADING:
        if function not in _loaded:
            _loaded[function] = _compiled_or_kept(function)
        return _loaded[function]


def _compiled_or_kept(function: Callable[..., int]) -> Callable[..., int]:
    kinds = (types.int64[::1], *[types.int64] * (function.__code__.co_argcount - 1))
    folder = cache_folder()
    if folder is not None:
        dispatcher = _kept_in(folder, function)
        if not list(folder.rglob(f"*.{function.__name__}-*.nbi")):
            _announce(function, "once for this machine")
        try:
            dispatcher.compile(kinds)
        except Exception:  # a full disk, or damaged files, which Numba reports in many ways
            shutil.rmtree(folder, ignore_errors=True)
        if dispatcher.signatures:
            return cast(Callable[..., int], dispatcher)
    _announce(function, "for this process, as the disk keeps nothing")
    dispatcher = njit(**_OPTIONS)(function)
    dispatcher.compile(kinds)
    return cast(Callable[..., int], dispatcher)


def _kept_in(folder: Path, function: Callable[..., int]) -> Any:
    """The function with Numba's cache in a folder, which is named by a setting that is read when it is decorated."""
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        return njit(**_OPTIONS, cache=True)(function)
    finally:
        config.CACHE_DIR = before


def _announce(function: Callable[..., int], how_often: str) -> None:
    if function.__name__ == "serve":  # the others take a moment only
        print(f"socialai: compiling the engine, {how_often}: 20 to 70 seconds", file=sys.stderr, flush=True)


@intrinsic
def _stay_outline(context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


def _do_nothing() -> None:
    """Plain Python has nothing to keep apart."""


stay_outline = _do_nothing if config.DISABLE_JIT else _stay_outline
"""Called first in a function, keeps it from being merged into its callers."""
