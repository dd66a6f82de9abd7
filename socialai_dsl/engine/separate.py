"""A function that is compiled alone, and known to the process by a symbol.

Numba links whatever a function calls into it and optimises the whole anew, for every function on the way up. The
interpreter is called from a dozen places, so it is kept out of that: callers see a symbol only. What Python calls is
compiled the same way, so that its machine code can be loaded without Numba (`machine`).
"""

import gc
from collections.abc import Callable
from typing import Any, TypeVar, cast

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.pointers import Pointer

_Function = TypeVar("_Function", bound=Callable[..., None])

_WORD = ir.IntType(64)
BOOK = Pointer(types.int64)
"""Numba's type of the book of a batch (`book.make_book`)."""


class Separate:
    """A function with a symbol of its own, or in plain Python just the function.

    Args:
        symbol: name that the process knows it by.
        function: takes pointers and numbers.
        takes: their Numba types.
        gives: Numba type of what it returns.
        packed: whether it is given the address of its arguments, one int64 each, instead of them.
    """

    def __init__(
        self,
        symbol: str,
        function: Callable[..., Any],
        takes: tuple[Any, ...],
        gives: Any,
        packed: bool = False,
    ) -> None:
        self.function = function
        self._symbol = symbol
        self._takes = takes
        self._gives = gives
        self._packed = packed

    def object_code(self) -> bytes:
        """Compile it. Whatever it calls by a symbol must be loaded before its code is."""
        # The compiler makes millions of objects that live to its end: looking for garbage is a tenth of its time.
        collecting = gc.isenabled()
        gc.disable()
        try:
            dispatcher: Any = inline(self.function)  # into its entry
            dispatcher.compile(self._takes)
            compiled = dispatcher.overloads[self._takes]
            return cast(bytes, compiled.library.object_code(self._symbol, self._entry(compiled)))
        finally:
            if collecting:
                gc.enable()

    def _entry(self, compiled: Any) -> ir.Module:
        """A module with a function as C has them, which calls the one that Numba made."""
        context = compiled.target_context
        module = context.create_module(self._symbol)
        kind = context.call_conv.get_function_type(self._gives, self._takes)
        callee = ir.Function(module, kind, compiled.fndesc.llvm_func_name)
        takes = [context.get_value_type(kind) for kind in self._takes]
        given = [_WORD.as_pointer()] if self._packed else takes
        gives = ir.VoidType() if self._gives == types.none else context.get_value_type(self._gives)
        entry = ir.Function(module, ir.FunctionType(gives, given), self._symbol)
        builder = ir.IRBuilder(entry.append_basic_block())
        arguments = _unpacked(builder, entry.args[0], takes) if self._packed else entry.args
        _, result = context.call_conv.call_function(builder, callee, self._gives, self._takes, arguments)
        if self._gives == types.none:
            builder.ret_void()
        else:
            builder.ret(result)
        return module

    def caller(self, like: _Function) -> _Function:
        """What compiled code calls: the pointers as one tuple, then the number, as in `like`."""
        if config.DISABLE_JIT:
            return cast(_Function, lambda pointers, number: self.function(*pointers, number))

        @intrinsic
        def call(context: Any, pointers: Any, number: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                values = [*cgutils.unpack_tuple(builder, arguments[0]), arguments[1]]
                kind = ir.FunctionType(ir.VoidType(), [value.type for value in values])
                builder.call(cgutils.get_or_insert_function(builder.module, kind, self._symbol), values)
                return context.get_dummy_value()

            return signature(types.none, pointers, types.int64), generate

        return cast(_Function, call)


def _unpacked(builder: ir.IRBuilder, packed: Any, kinds: list[Any]) -> list[Any]:
    words = [builder.load(builder.gep(packed, [ir.Constant(_WORD, i)])) for i in range(len(kinds))]
    return [
        builder.inttoptr(word, kind) if isinstance(kind, ir.PointerType) else word
        for word, kind in zip(words, kinds, strict=True)
    ]


def entry(symbol: str) -> Callable[[Callable[..., int]], Separate]:
    """Of a function of a book and some numbers that gives a number make one that Python can call."""

    def separate(function: Callable[..., int]) -> Separate:
        numbers = function.__code__.co_argcount - 1
        return Separate(symbol, function, (BOOK, *[types.int64] * numbers), types.int64, packed=True)

    return separate
