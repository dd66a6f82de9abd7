"""Minibatches of a rollout: whole environments, each distinct frame computed once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from trainer.frames import Batch, Environments, Stretches
from trainer.rollout import Rollout
from trainer.session import Session


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
    stretches = Stretches.of(
        actor.net,
        cut(rollout.starts),
        rollout.memories.index_select(1, envs.to(actor.device)).flatten(0, 1),
        actor.images.data,
        actor.histories.data,
        actor.pairs.data[pair_rows],
        frame_index,
    )
    return Environments(batch.pick(lambda array: cut(array).flatten(0, 1)), stretches, weight)
