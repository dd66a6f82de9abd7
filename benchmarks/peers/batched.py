"""Batches of envpool, on one thread, with a call from Python for each step of the batch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

ACTIONS = 64


def envpool(name: str) -> Callable[[int], Callable[[int], None]]:
    """MiniGrid rewritten in C++; an ended episode is reset by the next step."""

    def start(count: int) -> Callable[[int], None]:
        import envpool

        envs = envpool.make_gymnasium(f"MiniGrid-{name}-v0", num_envs=count, num_threads=1, seed=1)
        choices = int(envs.action_space.n)
        actions = np.random.default_rng(1).integers(0, choices, (ACTIONS, count)).astype(np.int32)
        envs.reset()

        def run(steps: int) -> None:
            step = envs.step
            for i in range(steps):
                step(actions[i % ACTIONS])

        return run

    return start
