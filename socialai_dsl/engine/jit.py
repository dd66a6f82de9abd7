"""How the engine's functions are compiled: integers as they are, nothing reordered, no interpreter lock.

`inline` is for helpers, which are merged into their callers. `outline` is for what runs rarely or is large: it begins
with `stay_outline()`, without which LLVM merges it into each of its callers all the same. The interpreter itself is
compiled apart (`separate`), and so are the entry points called from Python. None of them allocates memory.
"""

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

from numba import config, njit, types
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.merged import Merged

_Function = TypeVar("_Function", bound=Callable[..., object])


_OPTIONS: Final[dict[str, bool | str]] = {
    "nogil": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "no_rewrites": True,
}


def inline(function: _Function) -> _Function:
    """Compile a helper into each of its callers."""
    return cast(_Function, njit(**_OPTIONS, forceinline=True, pipeline_class=Merged)(function))


def outline(function: _Function) -> _Function:
    """Compile a function that is called."""
    return cast(_Function, njit(**_OPTIONS, forceinline=False, pipeline_class=Merged)(function))


def compiled(function: _Function) -> _Function:
    """Compile a function that Python calls and that may allocate."""
    return cast(_Function, njit(nogil=True, error_model="numpy")(function))


@intrinsic
def _stay_outline(context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return signature(types.none), generate


def _do_nothing() -> None:
    """Plain Python has nothing to keep apart."""


stay_outline = _do_nothing if config.DISABLE_JIT else _stay_outline
"""Called first in a function, keeps it from being merged into its callers."""
