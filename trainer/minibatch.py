"""Minibatches of a rollout: whole environments, each distinct frame computed once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from trainer.guides import Lead
from trainer.nets import ActorCritic
from trainer.nets.dialogue import PrefixTree, prefix_tree
from trainer.rollout import Rollout
from trainer.session import Session


class Batch(NamedTuple):
    """Frames that the loss is taken over: N of a minibatch, or (T, E) of a whole rollout in the place of N.

    Attributes:
        actions: int64 (N, H). log_probs: float32 (N, H), of the acting policy, before masking.
        values: float32 (N,), of the acting critic.
        advantages: float32 (N,). returns: float32 (N,), the targets of the value.
        lead: what a guide did and advised, (N, ...); None without a guide.
    """

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor
    lead: Lead | None = None

    def pick(self, some: Callable[[Tensor], Tensor]) -> Batch:
        """The frames that `some` takes out of each tensor."""
        *tensors, lead = self
        return Batch._make([*map(some, tensors), lead and Lead(*map(some, lead))])


@dataclass(frozen=True)
class Environments:
    """Whole environments of a rollout with their distinct frames, prepared once and used in every epoch.

    Attributes:
        batch: the frames, time-major: N = T * B.
        weight: share of its minibatch's frames that these are.
        starts: bool (T, B). memory: (B, *shape) before the first step.
        prepared: the net's view of the distinct images.
        tree: of the distinct histories.
        image_index, text_index: int64 (P,), image and tree state of each distinct pair.
        frame_index: int64 (N,), pair of each frame.
    """

    batch: Batch
    weight: float
    starts: Tensor
    memory: Tensor
    prepared: Any
    tree: PrefixTree
    image_index: Tensor
    text_index: Tensor
    frame_index: Tensor

    def evaluate(self, net: ActorCritic) -> Iterator[tuple[Batch, Tensor, Tensor]]:
        """Frames, logits (N, sum of sizes) and values (N,) under the present weights, in one part."""
        text = net.dialogue(self.tree)
        features = net.perceive(self.prepared, text, self.image_index, self.text_index)
        frames = features.index_select(0, self.frame_index).view(*self.starts.shape, -1)
        yield self.batch, *net.heads(net.memory(frames, self.starts, self.memory).flatten(0, 1))


def environments(session: Session, rollout: Rollout, batch: Batch) -> Iterator[list[Environments]]:
    """The minibatches of all epochs: groups of environments, drawn anew for each rollout, in a new order in each epoch.

    Each comes in shares that threads may work on side by side. `batch` is of all frames, (T, E, ...).
    """
    config, generator = session.config, session.generator
    groups = []
    for group in torch.randperm(config.envs, generator=generator).tensor_split(config.minibatches):
        shares = max(1, min(config.threads, len(group) * config.horizon // session.actor.net.smallest_share))
        parts = group.tensor_split(shares)
        groups.append([cut_out(session, rollout, batch, part, len(part) / len(group)) for part in parts])
    for _ in range(config.epochs):
        for index in torch.randperm(len(groups), generator=generator).tolist():
            yield groups[index]


def cut_out(
    session: Session, rollout: Rollout, batch: Batch, envs: Tensor, weight: float = 1.0
) -> Environments:
    """The environments `envs`, int64 (B,), of a rollout, in stretches of `bptt` steps side by side."""
    actor, stretch = session.actor, session.config.bptt or session.config.horizon

    def cut(array: Tensor) -> Tensor:
        """(T, E, ...) to (stretch, T / stretch * B, ...), the stretches of one time side by side."""
        chosen = array.index_select(1, envs.to(array.device))
        return chosen.view(-1, stretch, *chosen.shape[1:]).transpose(0, 1).flatten(1, 2)

    pair_rows, frame_index = np.unique(cut(rollout.pair_rows).numpy(), return_inverse=True)
    pairs = actor.pairs.data[pair_rows]
    image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
    history_rows, history_index = np.unique(pairs[:, 1], return_inverse=True)
    tree = prefix_tree(actor.histories.data[history_rows], actor.device)
    return Environments(
        batch.pick(lambda array: cut(array).flatten(0, 1)),
        weight,
        cut(rollout.starts),
        rollout.memories.index_select(1, envs.to(actor.device)).flatten(0, 1),
        actor.net.prepare(actor.move(actor.images.data[image_rows])),
        tree,
        actor.move(image_index),
        tree.leaves[actor.move(history_index)],
        actor.move(frame_index.reshape(-1)),
    )
