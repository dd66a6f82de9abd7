"""Sizes of a peer's rollouts, and the parts of PPO that the peers' loops share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


@dataclass(frozen=True)
class Settings:
    """Sizes of a trainer's rollouts and updates.

    Attributes:
        num_envs: environments stepped together.
        horizon: steps of each in a rollout.
        minibatches: gradient steps in an epoch.
        words: length histories are padded to; 0 pads to the longest history of the batch.
        epochs: passes over a rollout.
    """

    num_envs: int
    horizon: int
    minibatches: int
    words: int
    epochs: int = 4


def padded(tokens: NDArray[np.int16], words: int) -> NDArray[np.int16]:
    """The newest `words` words of 0-padded histories (E, L), as (E, words)."""
    first = np.maximum(np.count_nonzero(tokens, axis=1) - words, 0)
    columns = first[:, None] + np.arange(words)
    wide = np.pad(tokens, ((0, 0), (0, max(words - tokens.shape[1], 0))))
    return np.take_along_axis(wide, columns, 1)


def observe(observation: dict[str, NDArray[Any]], words: int) -> tuple[Tensor, Tensor]:
    """Images, uint8 (E, H, W, C), and histories, int64 (E, S), as tensors of their own."""
    tokens = observation["tokens"]
    longest = int(np.count_nonzero(tokens, axis=1).max(initial=1))
    kept = padded(tokens, words or max(longest, 1))
    return torch.tensor(observation["image"]), torch.from_numpy(kept.astype(np.int64))


def advantages(rewards: Tensor, values: Tensor, ends: Tensor, last: Tensor, gae_lambda: float) -> Tensor:
    """Generalised advantage estimates (T, E) with a discount of .99; an episode's end, time-outs too, is terminal."""
    result, running = torch.empty_like(rewards), torch.zeros_like(last)
    following = torch.cat((values[1:], last[None]))
    for t in reversed(range(len(rewards))):
        goes_on = 1 - ends[t]
        running = (
            rewards[t] + 0.99 * goes_on * following[t] - values[t] + 0.99 * gae_lambda * goes_on * running
        )
        result[t] = running
    return result
