"""Guard cells around the arrays of every batch: a write before the first or after the last number is found."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from socialai_dsl.engine import batch

GUARD = 4096
PATTERN = 0xA5


class _Guarded(NamedTuple):
    name: str
    memory: NDArray[np.uint8]
    last: int


class Guards:
    """Lets batches that are made from now on lie between guard cells.

    A single environment has arrays of one row, so that there the cells around a row are watched too.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._all: list[_Guarded] = []
        for name in ("empty_state", "empty_ports", "Tables"):
            made = getattr(batch, name)
            monkeypatch.setattr(batch, name, lambda *args, _made=made: self._between_guards(_made(*args)))

    def broken(self) -> list[str]:
        """Names of the arrays next to which something was written."""
        return [
            guarded.name
            for guarded in self._all
            if (guarded.memory[:GUARD] != PATTERN).any() or (guarded.memory[guarded.last :] != PATTERN).any()
        ]

    def _between_guards(self, arrays: Any) -> Any:
        return arrays._replace(**{name: self._moved(name, array) for name, array in arrays._asdict().items()})

    def _moved(self, name: str, array: NDArray[Any]) -> NDArray[Any]:
        memory = np.full(array.nbytes + 2 * GUARD, PATTERN, np.uint8)
        last = GUARD + array.nbytes
        moved = memory[GUARD:last].view(array.dtype).reshape(array.shape)
        moved[...] = array
        self._all.append(_Guarded(name, memory, last))
        return moved
