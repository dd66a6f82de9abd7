"""A large function that is compiled alone, once, and called through its address.

Numba links whatever a function calls into it and optimises the whole anew, for every function on the way up. The
interpreter is called from a dozen places, so it is kept out of that: callers see a symbol only.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import llvmlite.binding
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.ccallback import CFunc
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.cache import CodeCache, cache_folder

_Function = TypeVar("_Function", bound=Callable[..., None])


class Separate:
    """A function of some pointers and a number that returns nothing.

    Args:
        symbol: name that the process knows it by.
        function: takes the pointers one by one, then the number.
        pointers: Numba types of the pointers.
    """

    def __init__(self, symbol: str, function: Callable[..., None], pointers: tuple[Any, ...]) -> None:
        self._symbol = symbol
        self._function = function
        self._pointers = pointers
        self._ready = False

    def prepare(self) -> None:
        """Compile it, or load it from the cache, so that whoever calls it can be compiled or loaded."""
        if self._ready or config.DISABLE_JIT:
            return
        kind = types.void(*self._pointers, types.int64)
        options = {"error_model": "numpy", "_nrt": False}
        compiled: Any = CFunc(self._function, (kind.args, kind.return_type), {}, options)
        if cache_folder() is not None:
            compiled._cache = CodeCache(self._function)
        compiled.compile()
        llvmlite.binding.add_symbol(self._symbol, compiled.address)
        self._ready = True

    def caller(self, like: _Function) -> _Function:
        """What compiled code calls: the pointers as one tuple, then the number, as in `like`."""
        if config.DISABLE_JIT:
            return cast(_Function, lambda pointers, number: self._function(*pointers, number))

        @intrinsic
        def call(context: Any, pointers: Any, number: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                values = [*cgutils.unpack_tuple(builder, arguments[0]), arguments[1]]
                kind = ir.FunctionType(ir.VoidType(), [value.type for value in values])
                builder.call(cgutils.get_or_insert_function(builder.module, kind, self._symbol), values)
                return context.get_dummy_value()

            return signature(types.none, pointers, types.int64), generate

        return cast(_Function, call)
