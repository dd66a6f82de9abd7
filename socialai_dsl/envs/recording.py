"""This module remembers how an episode began and what was done, so that its last step can be played again."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.table import Table


@dataclass(frozen=True, slots=True)
class Start:
    """A moment of an environment: registers, int16 (R,), board, uint32 (C,), key, uint64 (Key.WORDS,)."""

    registers: NDArray[np.int16]
    board: NDArray[np.uint32]
    key: NDArray[np.uint64]


@dataclass
class Recording:
    """What happened since a moment: that moment, and the actions, int64 (4,) as bytes each."""

    start: Start
    actions: list[bytes] = field(default_factory=list)

    @classmethod
    def of(cls, table: Table, row: int) -> Recording:
        """From now on."""
        state = table.state
        return cls(Start(state.registers[row].copy(), state.boards[row].copy(), state.keys[row].copy()))
