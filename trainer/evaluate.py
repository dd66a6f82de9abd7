"""This module measures a policy on the fixed test episodes of a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainer.policies import Policy
from trainer.rollout import ended_info


@dataclass(frozen=True)
class EvalResult:
    """How a policy did.

    Attributes:
        episodes: episodes played, each once.
        success_rate: share that ended in success. success_rate_se: its binomial standard error.
        mean_length: steps. mean_return: undiscounted.
        outcomes: share of episodes that ended in each of the scenario's outcomes.
        success: bool (episodes,), lengths: int64 (episodes,), returns: float64 (episodes,), by test episode.
    """

    episodes: int
    success_rate: float
    success_rate_se: float
    mean_length: float
    mean_return: float
    outcomes: dict[str, float]
    success: NDArray[np.bool_]
    lengths: NDArray[np.int64]
    returns: NDArray[np.float64]


def evaluate(policy: Policy, envs: Any, episodes: int = 500) -> EvalResult:
    """Play test episodes 0 to `episodes - 1`, each exactly once, as many together as there are environments.

    Args:
        policy: greedy or sampling, and with which seed, is the policy's own affair.
        envs: vector environment with same-step auto-reset.
        episodes: how many; the common test set has 500.

    Raises:
        ValueError: `episodes` is not positive.
    """
    if episodes < 1:
        raise ValueError(f"episodes: got {episodes}, expected at least 1")
    names = list(envs.program.outcomes)
    success, outcome = np.zeros(episodes, np.bool_), np.full(episodes, -1)
    lengths, returns = np.zeros(episodes, np.int64), np.zeros(episodes)
    for first in range(0, episodes, envs.num_envs):
        _play_wave(policy, envs, np.arange(first, first + envs.num_envs), success, outcome, lengths, returns)
    rate = float(success.mean())
    return EvalResult(
        episodes,
        rate,
        float(np.sqrt(rate * (1 - rate) / episodes)),
        float(lengths.mean()),
        float(returns.mean()),
        {name: float((outcome == index).mean()) for index, name in enumerate(names)},
        success,
        lengths,
        returns,
    )


def _play_wave(
    policy: Policy,
    envs: Any,
    numbers: NDArray[np.int64],
    success: NDArray[np.bool_],
    outcome: NDArray[np.int64],
    lengths: NDArray[np.int64],
    returns: NDArray[np.float64],
) -> None:
    """Play one episode per environment; numbers beyond the last episode are played as 0 and not counted."""
    running = numbers < len(success)
    observation, _ = envs.reset(options={"test_episode": np.where(running, numbers, 0).tolist()})
    policy.reset(np.ones(len(numbers), np.bool_))
    while running.any():
        observation, reward, terminated, truncated, infos = envs.step(policy.act(observation))
        ended = terminated | truncated
        lengths[numbers[running]] += 1
        returns[numbers[running]] += reward[running]
        if ended.any():
            now = running & ended
            success[numbers[now]] = ended_info(infos, "success", ended & False)[now]
            outcome[numbers[now]] = ended_info(infos, "outcome", np.full(len(ended), -1))[now]
            running &= ~ended
            policy.reset(ended)
