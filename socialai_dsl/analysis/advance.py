"""Steps and resets of many environments, and compilations, that keep to the time of an analysis."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.effort import keep_time
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.engine.calls import BAD_ACTION, TERMINATED, RoomError, Task
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Program, Register

_FIRST: Final = 16
"""How many rows are done before it is known how long one takes."""

_PORTION: Final = 0.2
"""Seconds that the rows may take which are done without a look at the clock."""


def advance(table: Table) -> None:
    """Step all rows whose episodes go on, with the actions in the ports.

    Raises:
        ValueError: an action is outside of the space.
        OutOfTimeError: the clock that limits it is over (`Clock.limiting`).
    """
    ended = table.state.registers[:, Register.ENDED]
    going = np.flatnonzero(ended == 0)

    def step(rows: NDArray[np.intp]) -> None:
        others = going[ended[going] == 0] if len(rows) < len(going) else going[:0]
        ended[others] = TERMINATED
        ended[rows] = 0
        if table.batch.step(Task.STEP_ONLY) == BAD_ACTION:
            raise table.refusal(table.batch.ports.actions)
        others = np.setdiff1d(others, rows, assume_unique=True)
        ended[others] = 0

    _in_portions(going, step)


def begin(table: Table, seed: Any, options: Mapping[str, Any] | None) -> None:
    """`Table.reset` of all rows. Raises OutOfTimeError as `advance` does."""

    def reset(rows: NDArray[np.intp]) -> None:
        mask = np.zeros(table.rows, np.bool_)
        mask[rows] = True
        table.reset(seed, {**(options or {}), "reset_mask": mask})

    _in_portions(np.arange(table.rows), reset)


def begin_those_possible(table: Table, seed: int) -> None:
    """`begin` for rooms of which some cannot be drawn as the scenario's `require` asks; these have ended."""

    def reset(rows: NDArray[np.intp]) -> None:
        mask = np.zeros(table.rows, np.bool_)
        mask[rows] = True
        try:
            table.reset(seed, {"reset_mask": mask})
        except RoomError as error:
            table.state.registers[error.rows, Register.ENDED] = TERMINATED

    _in_portions(np.arange(table.rows), reset)


def _in_portions(rows: NDArray[np.intp], do: Callable[[NDArray[np.intp]], None]) -> None:
    size = _FIRST
    while len(rows):
        keep_time()
        began = time.perf_counter()
        do(rows[:size])
        each = (time.perf_counter() - began) / min(size, len(rows))
        rows, size = rows[size:], max(1, int(_PORTION / max(each, 1e-9)))


def compiled(loaded: LoadedScenario) -> Program:
    """`compile_loaded`, if there is time. Raises OutOfTimeError as `advance` does."""
    keep_time()
    return compile_loaded(loaded)
