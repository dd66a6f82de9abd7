"""Plays a scenario at random and counts every episode, long or short, once."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.factory import make_vec
from socialai_dsl.episodes.play import AGENT, EpisodesInARow, Rooms, play
from socialai_dsl.episodes.policies import Observation
from socialai_dsl.episodes.results import Results

_TOGETHER: Final = 1000


@dataclass(frozen=True)
class Sample:
    """Counts of a number of episodes.

    Attributes:
        episodes: how many were counted.
        successes: how many of them succeeded.
        mean_length, sd_length: of their lengths in steps.
        mean_reward: sum of the rewards of an episode, on average.
    """

    episodes: int
    successes: int
    mean_length: float
    sd_length: float
    mean_reward: float

    @property
    def success_rate(self) -> float:
        """Share of successes."""
        return self.successes / self.episodes

    @property
    def success_se(self) -> float:
        """Binomial standard error of the share."""
        return math.sqrt(self.success_rate * (1 - self.success_rate) / self.episodes)


def play_at_random(scenario: str, episodes: int, seed: int) -> Sample:
    """Play with the uniform random policy: every part of the action is drawn alone, so it speaks half of the time.

    Args:
        scenario: a path or a name.
        episodes: how many at least; rounded up to a multiple of the number of environments.
        seed: of the environments and of the policy.
    """
    count = min(_TOGETHER, episodes)
    each = -(-episodes // count)
    envs: Any = make_vec(scenario, num_envs=count, copy=False, autoreset_mode="Disabled")
    results = Results(envs.outcomes, count * each)
    try:
        rooms = Rooms(envs, [results])
        play(rooms, {AGENT: _OneStream(rooms.action_sizes, seed)}, EpisodesInARow(seed, each))
    finally:
        envs.close()
    result = results.result()
    spread = float(result.lengths.std(ddof=1)) if result.episodes > 1 else 0.0
    return Sample(result.episodes, int(result.success.sum()), result.mean_length, spread, result.mean_return)


class _OneStream:
    """`RandomPolicy` with one stream for all rooms, which is faster by far for a thousand of them."""

    def __init__(self, sizes: tuple[int, ...], seed: int) -> None:
        self._sizes, self._generator = np.array(sizes), np.random.default_rng(seed)

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> NDArray[np.int64]:
        """See `Policy.act`."""
        return self._generator.integers(0, self._sizes, (len(observation["tokens"]), len(self._sizes)))
