"""Plays the test episodes of a scenario with any policy, without PyTorch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

Int64 = NDArray[np.int64]
Observation = Mapping[str, NDArray[Any]]
"""`image`, uint8 (E, H, W, C), and `tokens`, int16 (E, L)."""

# The two-sided 95 % quantile of the normal distribution.
_Z = 1.959963984540054
# Streams that no numbered episode begins lie in a domain of keys of their own.
_UNNUMBERED = 1 << 63


class Policy(Protocol):
    """The interface of a player of E environments. It needs no base class: two methods are enough."""

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Forget the past of environments in which a new episode begins.

        Args:
            mask: bool (E,), true for those environments.
            episodes: int64 (E,), the number of each environment's episode. The policy's random numbers in an episode
                then depend on that number alone.
        """

    def act(self, observation: Observation) -> Int64:
        """Choose actions, int64 (E, heads), given `image`, uint8 (E, H, W, C), and `tokens`, int16 (E, L)."""


class RandomPolicy:
    """Chance: every part of the action is drawn uniformly, so it speaks in half of the steps.

    Args:
        action_sizes: the number of choices of each part, `envs.single_action_space.nvec`.
        seed: of the draws, 0 to 2**63 - 1.
    """

    def __init__(self, action_sizes: tuple[int, ...], seed: int = 0) -> None:
        self._sizes = np.array(action_sizes)
        self._streams = Streams(seed)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        self._streams.begin(mask, episodes)

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        drawn = self._streams.uniform(len(observation["tokens"]), len(self._sizes))
        chosen: Int64 = (drawn * self._sizes).astype(np.int64)
        return chosen


class ScriptedPolicy:
    """The scenario's own script for the agent.

    Args:
        envs: the vector environment that is played, of a scenario whose agent follows a frame.
    """

    def __init__(self, envs: Any) -> None:
        self._envs = envs

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget; the script's state is the environments'."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        return np.array(self._envs.scripted_actions(), np.int64)


class Streams:
    """One stream of random numbers for each of E environments.

    A stream depends on the seed and on the number of the episode, not on how many environments are played together.
    Where episodes have no numbers, it depends on the seed and the environment's index.

    Args:
        seed: 0 to 2**63 - 1.

    Raises:
        ValueError: the seed is out of range.
    """

    def __init__(self, seed: int) -> None:
        if not 0 <= seed < _UNNUMBERED:
            raise ValueError(f"seed: got {seed}, expected a whole number from 0 to 2**63 - 1")
        self._seed = seed
        self._streams: list[np.random.Generator] = []

    def begin(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Note that episodes begin where `mask`, bool (E,), with these numbers, int64 (E,), if they have any."""
        self._require(len(mask))
        if episodes is None:
            return
        for place in np.flatnonzero(mask).tolist():
            self._streams[place] = _stream(self._seed, int(episodes[place]))

    def uniform(self, count: int, width: int) -> NDArray[np.float64]:
        """The next numbers of each stream, from 0 up to but not including 1, float64 (E, width)."""
        self._require(count)
        return np.stack([stream.random(width) for stream in self._streams])

    def gumbel(self, count: int, width: int) -> NDArray[np.float32]:
        """The next standard Gumbel numbers of each stream, float32 (E, width)."""
        self._require(count)
        return np.stack([stream.gumbel(size=width) for stream in self._streams]).astype(np.float32)

    def _require(self, count: int) -> None:
        """Make the streams of `count` environments, if there are others or none."""
        if len(self._streams) != count:
            self._streams = [_stream(self._seed | _UNNUMBERED, place) for place in range(count)]


def _stream(seed: int, number: int) -> np.random.Generator:
    """Philox, whose streams of different keys are independent (Salmon et al. 2011)."""
    return np.random.Generator(np.random.Philox(key=np.array([seed, number], np.uint64)))


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % confidence interval of a success rate (Wilson 1927, the score interval without correction).

    Unlike rate ± 2 standard errors it stays within 0 and 1, and it has a width where all trials had one result.

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
    """The result of a policy on test episodes 0 to N - 1.

    Attributes:
        success: bool (N,), whether each episode ended in success.
        outcome: int64 (N,), how each ended, as an index into `names`.
        lengths: int64 (N,), in steps.
        returns: float64 (N,), the undiscounted sum of rewards.
        names: the scenario's outcomes.
        rules: mean number of times that each rule of the scenario fired in an episode.
    """

    success: NDArray[np.bool_]
    outcome: NDArray[np.int64]
    lengths: NDArray[np.int64]
    returns: NDArray[np.float64]
    names: tuple[str, ...]
    rules: Mapping[str, float] = field(default_factory=dict)

    @property
    def episodes(self) -> int:
        """N, the number of episodes, each played once."""
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
        """The 95 % confidence interval of `success_rate` by `wilson_interval`."""
        return wilson_interval(int(self.success.sum()), self.episodes)

    @property
    def mean_length(self) -> float:
        """Mean length of an episode in steps."""
        return float(self.lengths.mean())

    @property
    def mean_return(self) -> float:
        """Mean undiscounted return of an episode."""
        return float(self.returns.mean())

    @property
    def outcomes(self) -> dict[str, float]:
        """Share of the episodes that ended in each of the scenario's outcomes."""
        return {name: float((self.outcome == index).mean()) for index, name in enumerate(self.names)}


def evaluate(policy: Policy, envs: Any, episodes: int = 500) -> EvalResult:
    """Play test episodes 0 to `episodes - 1`, each exactly once.

    An environment whose episode has ended plays the next one that is left. The rooms are the same for every policy, and
    the policy is told the number of each episode, so the result does not depend on the number of environments.

    Args:
        policy: the player; whether it samples, and with which seed, is its own affair.
        envs: a vector environment with `autoreset_mode="Disabled"`, which plays and counts the test episodes alone.
        episodes: N, at least the number of environments; the common test set has 500.

    Raises:
        ValueError: `episodes` is less than 1 or than the number of environments, or these reset themselves.
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
