"""Minibatches of a rollout: whole environments, each distinct frame computed once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from socialai_dsl.trainer.frames import Batch, Environments, Stretches
from socialai_dsl.trainer.rollout import Rollout
from socialai_dsl.trainer.session import Session


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
    frames = batch.pick(lambda array: cut(session, array, envs).flatten(0, 1))
    return Environments(frames, stretches_of(session, rollout, envs), weight)


def stretches_of(session: Session, rollout: Rollout, envs: Tensor) -> Stretches:
    """What the environments `envs`, int64 (B,), of a rollout have seen, in the order of `cut`."""
    actor = session.actor
    pair_rows, frame_index = np.unique(cut(session, rollout.pair_rows, envs).numpy(), return_inverse=True)
    return Stretches.of(
        actor.net,
        cut(session, rollout.forgets, envs),
        rollout.memories.index_select(1, envs.to(actor.device)).flatten(0, 1),
        actor.images.data,
        actor.histories.data,
        actor.pairs.data[pair_rows],
        frame_index,
    )


def cut(session: Session, array: Tensor, envs: Tensor) -> Tensor:
    """(T, E, ...) to (S, T / S * B, ...): stretches of S = `bptt` steps, those of one time side by side."""
    chosen = array.index_select(1, envs.to(array.device))
    steps = session.config.bptt or session.config.horizon
    return chosen.view(-1, steps, *chosen.shape[1:]).transpose(0, 1).flatten(1, 2)
