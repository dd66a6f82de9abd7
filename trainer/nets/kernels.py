"""This module says how the loops of networks over arrays are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

import numpy as np
from numba import config, njit
from numpy.typing import NDArray

AVAILABLE: Final = not config.DISABLE_JIT
"""Whether loops are compiled; as Python they would take minutes."""

U16 = NDArray[np.uint16]
U32 = NDArray[np.uint32]
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile a function that Python calls."""
    # Threads of a crew run these side by side. A sum may be rounded once less, by a fused multiplication.
    return cast(_Function, njit(nogil=True, error_model="numpy", fastmath={"contract"}, cache=True)(function))


def inlined(function: _Function) -> _Function:
    """Compile a function into those that call it."""
    return cast(_Function, njit(inline="always", error_model="numpy")(function))
