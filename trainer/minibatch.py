"""This module cuts rollouts into minibatches of whole environments with their distinct frames prepared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from trainer.actor import Actor
from trainer.distinct import prefix_tree
from trainer.nets import ActorCritic
from trainer.rollout import Rollout


@dataclass(frozen=True)
class Batch:
    """Frames the loss is taken over, all (N, ...): see `Rollout`; `returns` are the targets of the value."""

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor


@dataclass(frozen=True)
class Minibatch:
    """Whole environments of a rollout with their distinct frames, prepared once and used in every epoch.

    Attributes:
        batch: the frames, time-major: N = T * B.
        starts: bool (T, B). memory: (2, B, M) before the first step.
        prepared: the net's view of the distinct images.
        tokens, parents, offsets: prefix tree of the distinct histories.
        image_index, text_index: int64 (P,), image and tree state of each distinct pair.
        frame_index: int64 (N,), pair of each frame.
    """

    batch: Batch
    starts: Tensor
    memory: Tensor
    prepared: Any
    tokens: Tensor
    parents: Tensor
    offsets: list[int]
    image_index: Tensor
    text_index: Tensor
    frame_index: Tensor

    def evaluate(self, net: ActorCritic) -> tuple[Tensor, Tensor]:
        """Logits (N, sum of sizes) and values (N,) of the frames under the present weights."""
        text = net.dialogue(self.tokens, self.parents, self.offsets)
        features = net.perceive(self.prepared, text, self.image_index, self.text_index)
        steps, count = self.starts.shape
        frames = features.index_select(0, self.frame_index).view(steps, count, -1)
        logits, values = net.heads(net.memory(frames, self.starts, self.memory).flatten(0, 1))
        return logits, values


def make_minibatch(
    actor: Actor, rollout: Rollout, advantages: Tensor, returns: Tensor, envs: Tensor, stretch: int
) -> Minibatch:
    """Cut the environments `envs`, int64 (B,), out of a rollout, in stretches of `stretch` steps side by side."""

    def cut(array: Tensor) -> Tensor:
        """(T, E, ...) to (stretch, T / stretch * B, ...)."""
        chosen = array.index_select(1, envs.to(array.device))
        return chosen.view(-1, stretch, *chosen.shape[1:]).transpose(0, 1).flatten(1, 2)

    pair_rows, frame_index = np.unique(cut(torch.from_numpy(rollout.pair_rows)).numpy(), return_inverse=True)
    pairs = actor.pairs.data[pair_rows]
    image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
    history_rows, history_index = np.unique(pairs[:, 1], return_inverse=True)
    tree = prefix_tree(actor.histories.data[history_rows])
    device = actor.device

    def move(array: np.ndarray[Any, Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(device)

    return Minibatch(
        Batch(
            cut(rollout.actions).flatten(0, 1),
            cut(rollout.log_probs).flatten(0, 1),
            cut(rollout.values).flatten(),
            cut(advantages).flatten(),
            cut(returns).flatten(),
        ),
        cut(torch.from_numpy(rollout.starts)).to(device),
        rollout.memories.index_select(2, envs.to(device)).transpose(0, 1).flatten(1, 2),
        actor.net.prepare(move(actor.images.data[image_rows])),
        move(tree.tokens),
        move(tree.parents),
        tree.offsets,
        move(image_index),
        move(tree.leaves[history_index]),
        move(frame_index.reshape(-1)),
    )
