"""Measures speed: repetitions of about the same length, by CPU time and by the clock."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Speed:
    """Environment steps per second: the median of some repetitions, the slowest and the fastest.

    Attributes:
        cpu, cpu_low, cpu_high: per second of CPU time of the process.
        wall, wall_low, wall_high: per second on the clock.
    """

    cpu: float
    cpu_low: float
    cpu_high: float
    wall: float
    wall_low: float
    wall_high: float


def speed_of(
    run: Callable[[int], object],
    per_step: int,
    repetitions: int,
    seconds: float,
    block: int = 1,
    prepare: Callable[[], object] | None = None,
) -> Speed:
    """How many environment steps something makes per second.

    Args:
        run: called with a number of steps of the whole batch.
        per_step: environments in the batch.
        repetitions: how often it is measured.
        seconds: how long each repetition is to take, about.
        block: the number of steps that `run` is called with is a multiple of this; just this if there is `prepare`.
        prepare: called, outside the time, before every call of `run`.
    """

    def timed(blocks: int) -> tuple[float, float]:
        """CPU and wall seconds of this many blocks."""
        if prepare is None:
            return _timed(run, blocks * block)
        cpu = wall = 0.0
        for _ in range(blocks):
            prepare()
            once = _timed(run, block)
            cpu, wall = cpu + once[0], wall + once[1]
        return cpu, wall

    blocks = 1
    while (wall := timed(blocks)[1]) <= seconds / 4:
        blocks *= 2
    blocks = max(1, round(blocks * seconds / wall))
    done = blocks * block * per_step
    speeds = done / np.maximum([timed(blocks) for _ in range(repetitions)], 1e-9)
    spread = [(float(np.median(s)), float(s.min()), float(s.max())) for s in speeds.T]
    return Speed(*spread[0], *spread[1])


def _timed(run: Callable[[int], object], steps: int) -> tuple[float, float]:
    cpu, wall = time.process_time(), time.perf_counter()
    run(steps)
    return time.process_time() - cpu, time.perf_counter() - wall
