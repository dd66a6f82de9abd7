"""Vectors of sixteen words, for processors that have them: whether this one has, and rows read and written in them."""

from typing import Any, Final

from llvmlite import ir
from numba import config
from numba.core.codegen import get_host_cpu_features

LANES: Final = 16
WORD: Final = ir.IntType(32)
HALF: Final = ir.IntType(16)
WORDS: Final = ir.VectorType(WORD, LANES)


def _has_vectors() -> bool:
    """Whether compiled code may use vectors of sixteen words."""
    features = config.CPU_FEATURES
    if features is None:
        features = get_host_cpu_features() if config.CPU_NAME is None else ""
    return not config.DISABLE_JIT and "+avx512f" in features


WIDE: Final = _has_vectors()
"""Whether functions that take such vectors can be called."""


def place(builder: Any, pointer: Any, index: Any, kind: Any) -> Any:
    """A pointer to a number of a row, as one to something of another kind that begins there."""
    return builder.bitcast(builder.gep(pointer, [index]), kind.as_pointer())


def get(builder: Any, pointer: Any, index: Any, kind: Any) -> Any:
    """Some numbers of a row as one value, which need not lie where a vector would."""
    value = builder.load(place(builder, pointer, index, kind), typ=kind)
    value.align = pointer.type.pointee.width // 8
    return value


def put(builder: Any, value: Any, pointer: Any, index: Any) -> None:
    """Write them."""
    builder.store(value, place(builder, pointer, index, value.type)).align = pointer.type.pointee.width // 8


def in_all(builder: Any, value: Any, kind: Any) -> Any:
    """A vector of one number."""
    nothing = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(nothing, value, WORD(0))
    return builder.shuffle_vector(
        first, nothing, ir.Constant(ir.VectorType(WORD, kind.count), [0] * kind.count)
    )


def counted(kind: Any) -> Any:
    """The vector 0, 1, 2 and so on."""
    return ir.Constant(kind, list(range(kind.count)))
