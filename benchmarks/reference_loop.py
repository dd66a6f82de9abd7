"""The yardstick of `make bench`: a fixed loop whose speed says how fast this machine is."""

import time

import numpy as np

from socialai_dsl.engine.jit import compiled

ITERATIONS = 20_000_000


@compiled
def reference_loop(iterations: int) -> np.int64:
    """Mix a 64-bit number, look up and change a table of 64 KiB, branch: what an interpreter's step is made of."""
    table = np.zeros(16384, np.uint32)
    number = np.uint64(0x9E3779B97F4A7C15)
    total = np.int64(0)
    for i in range(iterations):
        number ^= number << np.uint64(13)
        number ^= number >> np.uint64(7)
        number ^= number << np.uint64(17)
        place = np.int64(number & np.uint64(16383))
        table[place] += np.uint32(i)
        if table[place] & np.uint32(1):
            total += np.int64(table[(place * 7) & 16383] & np.uint32(255))
    return total


def reference_speed(repetitions: int) -> float:
    """Iterations per CPU second, the median of some repetitions."""
    reference_loop(1)
    speeds = []
    for _ in range(repetitions):
        start = time.process_time()
        reference_loop(ITERATIONS)
        speeds.append(ITERATIONS / (time.process_time() - start))
    return float(np.median(speeds))
