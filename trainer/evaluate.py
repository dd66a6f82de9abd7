"""This module measures a policy on the fixed test episodes of a scenario."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from trainer.policies import Policy

# The two-sided 95 % quantile of the normal distribution.
_Z = 1.959963984540054


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % confidence interval of a success rate (Wilson 1927, the score interval without correction).

    Unlike rate ± 2 standard errors it stays within 0 and 1 and is of use where nothing, or everything, succeeded.

    Raises:
        ValueError: there was no trial, or there were more successes than trials.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(
            f"got {successes} successes of {trials} trials, expected 0 to `trials` of at least one"
        )
    rate, spread = successes / trials, _Z * _Z / trials
    centre = (rate + spread / 2) / (1 + spread)
    half = math.sqrt(rate * (1 - rate) * spread + spread * spread / 4) / (1 + spread)
    # At the ends the formula gives 0 and 1 but for rounding.
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == trials else centre + half
    return low, high


@dataclass(frozen=True, eq=False)
class EvalResult:
    """How a policy did on test episodes 0 to N - 1.

    Attributes:
        success: bool (N,). outcome: int64 (N,), index into `names`. lengths: int64 (N,), steps.
        returns: float64 (N,), undiscounted.
        names: of the scenario's outcomes.
        rules: how often each of the scenario's rules fired in an episode, on average.
    """

    success: NDArray[np.bool_]
    outcome: NDArray[np.int64]
    lengths: NDArray[np.int64]
    returns: NDArray[np.float64]
    names: tuple[str, ...]
    rules: Mapping[str, float] = field(default_factory=dict)

    @property
    def episodes(self) -> int:
        """How many episodes were played, each once."""
        return len(self.success)

    @property
    def success_rate(self) -> float:
        """Share of the episodes that ended in success."""
        return float(self.success.mean())

    @property
    def success_rate_se(self) -> float:
        """The binomial standard error of `success_rate`."""
        return math.sqrt(self.success_rate * (1 - self.success_rate) / self.episodes)

    @property
    def success_interval(self) -> tuple[float, float]:
        """The 95 % confidence interval of `success_rate`, see `wilson_interval`."""
        return wilson_interval(int(self.success.sum()), self.episodes)

    @property
    def mean_length(self) -> float:
        """Steps."""
        return float(self.lengths.mean())

    @property
    def mean_return(self) -> float:
        """Undiscounted."""
        return float(self.returns.mean())

    @property
    def outcomes(self) -> dict[str, float]:
        """Share of the episodes that ended in each of the scenario's outcomes."""
        return {name: float((self.outcome == index).mean()) for index, name in enumerate(self.names)}


def evaluate(policy: Policy, envs: Any, episodes: int = 500) -> EvalResult:
    """Play test episodes 0 to `episodes - 1`, each exactly once, as many together as there are environments.

    Whoever ends its episode is given the next one. The rooms are the same for every policy, and the policy is told
    the number of each episode, so that what it draws does not depend on how many are played together.

    Args:
        policy: greedy or sampling, and with which seed, is the policy's own affair.
        envs: vector environment without auto-reset (`autoreset_mode="Disabled"`), so that nothing but the test
            episodes is played and counted.
        episodes: how many; the common test set has 500.

    Raises:
        ValueError: `episodes` is not positive, or the environments are more than that, or reset themselves.
    """
    if episodes < 1:
        raise ValueError(f"episodes: got {episodes}, expected at least 1")
    if envs.num_envs > episodes:
        raise ValueError(
            f"envs: got {envs.num_envs} of them for {episodes} episodes, expected at most as many"
        )
    mode = envs.metadata.get("autoreset_mode")
    if mode is not gymnasium.vector.AutoresetMode.DISABLED:
        raise ValueError(f"envs: got the auto-reset mode {mode}, expected Disabled")
    success, outcome = np.zeros(episodes, np.bool_), np.full(episodes, -1)
    lengths, returns = np.zeros(episodes, np.int64), np.zeros(episodes)
    before = envs.counters()["rules"]
    numbers, following = np.arange(envs.num_envs), envs.num_envs
    running = np.ones(envs.num_envs, np.bool_)
    observation, _ = envs.reset(options={"test_episode": numbers.tolist()})
    policy.reset(running.copy(), numbers)
    while running.any():
        observation, reward, terminated, truncated, infos = envs.step(policy.act(observation))
        lengths[numbers[running]] += 1
        returns[numbers[running]] += reward[running]
        ended = running & (terminated | truncated)
        if not ended.any():
            continue
        success[numbers[ended]] = infos["success"][ended]
        outcome[numbers[ended]] = infos["outcome"][ended]
        next_ones = np.flatnonzero(ended)[: episodes - following]
        numbers[next_ones] = np.arange(following, following + len(next_ones))
        following += len(next_ones)
        running &= ~ended
        running[next_ones] = True
        if len(next_ones):
            begin = ended & running
            observation, _ = envs.reset(options={"reset_mask": begin, "test_episode": numbers.tolist()})
            policy.reset(begin, numbers)
    rules = {name: (n - before.get(name, 0)) / episodes for name, n in envs.counters()["rules"].items()}
    return EvalResult(success, outcome, lengths, returns, tuple(envs.program.outcomes), rules)
