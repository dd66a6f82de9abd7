"""Single environments of other projects: one call from Python for each step, resets included."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

ACTIONS = 64


def minigrid(name: str) -> Callable[[int], Callable[[int], None]]:
    """MiniGrid through Gymnasium; its own encoding of the picture, no wrapper."""

    def start(_: int) -> Callable[[int], None]:
        import gymnasium
        import minigrid  # noqa: F401 - makes its ids known

        env = gymnasium.make(f"MiniGrid-{name}-v0")
        env.action_space.seed(1)
        env.reset(seed=1)
        return _player(env, [env.action_space.sample() for _ in range(ACTIONS)], ended=(2, 3))

    return start


def griddly(_: int) -> Callable[[int], None]:
    """Griddly's own MiniGrid with one moving creature, observed as a vector of bits for each cell."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import griddly
        from griddly import GymWrapper, gd

        games = Path(griddly.__file__).parent / "resources" / "games"
        observed = gd.ObserverType.VECTOR
        game = games / "Single-Player" / "Mini-Grid" / "minigrid-doggo.yaml"
        env = GymWrapper(str(game), player_observer_type=observed, global_observer_type=observed)
        env.reset()
        env.action_space.seed(1)
        return _player(env, [env.action_space.sample() for _ in range(ACTIONS)], ended=(2,))


def _player(env: Any, actions: list[Any], ended: tuple[int, ...]) -> Callable[[int], None]:
    """Plays steps; `ended` are the places of what says that an episode has ended."""

    def run(steps: int) -> None:
        step, reset = env.step, env.reset
        for i in range(steps):
            result = step(actions[i % ACTIONS])
            if any(result[place] for place in ended):
                reset()

    return run
