"""Plays a scenario at random and counts every episode, long or short, once."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import socialai_dsl

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

    Every environment plays the same number of episodes and exactly these are counted. To count the first episodes
    that end anywhere would count too many short ones.

    Args:
        scenario: a path or a name.
        episodes: how many at least; rounded up to a multiple of the number of environments.
        seed: of the environments and of the policy.
    """
    count = min(_TOGETHER, episodes)
    envs: Any = socialai_dsl.make_vec(scenario, num_envs=count, copy=False, autoreset_mode="SameStep")
    generator = np.random.default_rng(seed)
    sizes = np.asarray(envs.single_action_space.nvec)
    tally = _Tally(count, -(-episodes // count))
    try:
        envs.reset(seed=seed)
        while not tally.complete:
            _, reward, terminated, truncated, infos = envs.step(
                generator.integers(0, sizes, (count, len(sizes)))
            )
            ended = terminated | truncated
            tally.note(reward, ended, infos["success"] if ended.any() else ended)
    finally:
        envs.close()
    return tally.sample()


class _Tally:
    """Counts the first `each` episodes of each of E environments."""

    def __init__(self, environments: int, each: int) -> None:
        self._each = each
        self._played = np.zeros(environments, np.int64)
        self._length = np.zeros(environments, np.int64)
        self._return = np.zeros(environments)
        self._lengths, self._squares, self._successes, self._rewards = 0, 0, 0, 0.0

    @property
    def complete(self) -> bool:
        """Whether every environment has played its episodes."""
        return bool((self._played >= self._each).all())

    def note(self, reward: NDArray[np.float64], ended: NDArray[np.bool_], success: NDArray[np.bool_]) -> None:
        """Note one step of all environments, arrays (E,)."""
        self._length += 1
        self._return += reward
        if not ended.any():
            return
        counted = ended & (self._played < self._each)
        lengths = self._length[counted]
        self._lengths += int(lengths.sum())
        self._squares += int((lengths * lengths).sum())
        self._successes += int(success[counted].sum())
        self._rewards += float(self._return[counted].sum())
        self._played[ended] += 1
        self._length[ended], self._return[ended] = 0, 0.0

    def sample(self) -> Sample:
        """The counts."""
        episodes = self._each * len(self._played)
        mean = self._lengths / episodes
        variance = (self._squares - episodes * mean * mean) / max(episodes - 1, 1)
        return Sample(
            episodes, self._successes, mean, math.sqrt(max(variance, 0.0)), self._rewards / episodes
        )
