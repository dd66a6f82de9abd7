"""The update of the paper's code: chunks of a rollout, one step of all of them at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from trainer.features import Actor, Batch, prefix_tree
from trainer.nets import ActorCritic
from trainer.nets.memory import emptied
from trainer.ppo import descend, estimate_advantages, ppo_loss, summarize
from trainer.rollout import Rollout
from trainer.session import Session


def chunk_starts(num_envs: int, horizon: int, length: int, shifted: bool) -> Tensor:
    """Environment and first step of every chunk of `length` steps, int64 (C, 2), environment by environment.

    Chunks lie end to end; shifted ones begin `length // 2` steps later and each environment has one less, because
    the last one would not end within the rollout.
    """
    first = torch.arange(0, horizon, length)
    if shifted:
        first = first[:-1] + length // 2
    return torch.cartesian_prod(torch.arange(num_envs), first)


@dataclass(frozen=True)
class _Frames:
    """All frames of a rollout; every tensor but the tree has the axes (T, E) first.

    Attributes:
        batch: what the loss needs; its tensors are (T, E, ...).
        starts: bool (T, E), where an episode starts, into which no memory reaches.
        pairs: int64 (T, E, 2), row of the image in `images` and state of the history in the tree.
        images: uint8 (I, H, W, C).
        tree: tokens, parents and offsets of the histories' prefix tree.
    """

    batch: Batch
    starts: Tensor
    pairs: Tensor
    images: Tensor
    tree: tuple[Tensor, Tensor, list[int]]

    @classmethod
    def of(cls, actor: Actor, rollout: Rollout, advantages: Tensor, returns: Tensor) -> _Frames:
        tree = prefix_tree(actor.histories.data)
        image, history = actor.pairs.data[rollout.pair_rows].transpose(2, 0, 1)

        def move(array: Any) -> Tensor:
            return torch.as_tensor(array).to(actor.device)

        return cls(
            Batch(rollout.actions, rollout.log_probs, rollout.values, advantages, returns),
            move(rollout.starts),
            torch.stack((move(image), move(tree.leaves[history])), 2),
            move(actor.images.data),
            (move(tree.tokens), move(tree.parents), tree.offsets),
        )


def update_chunks(session: Session, rollout: Rollout) -> dict[str, float]:
    """Improve the network on one rollout as the paper's code does; returns what `ppo.update` does.

    A rollout is cut into chunks of `bptt` steps (`chunk_starts`), shifted in every second epoch, in a new order in
    each. A minibatch is some of them, all by the paper's presets. Its loss is the mean over the steps of the chunks
    of the loss of one step of all chunks together, so BatchNorm sees C frames at a time, C the number of chunks.
    Gradients go back through the memory to a chunk's beginning and no further.

    A chunk begins with the memory that was last computed for its first step: in the first epoch that of the acting
    network; and since each epoch stores the memories it passes through, one of an earlier epoch afterwards.
    """
    config = session.config
    advantages, returns = estimate_advantages(session, rollout)
    frames = _Frames.of(session.actor, rollout, advantages, returns)
    memories = acting_memories(rollout, config.bptt)  # (T, E, *shape)
    horizon, envs = rollout.values.shape
    steps = []
    for epoch in range(config.epochs):
        starts = chunk_starts(envs, horizon, config.bptt, shifted=epoch % 2 == 1)
        order = torch.randperm(len(starts), generator=session.generator)
        size = envs * horizon // config.bptt // config.minibatches
        for chunks in torch.split(starts[order], size):
            steps.append(_step(session, frames, memories, chunks.to(session.actor.device)))
    return summarize(steps, rollout.values, returns)


def acting_memories(rollout: Rollout, length: int) -> Tensor:
    """Memory before each step, float32 (T, E, *shape), known at the first steps of unshifted chunks only.

    The others are not numbers until the first epoch fills them in, so that none can be used by mistake.
    """
    _, envs, *shape = rollout.memories.shape
    memories = rollout.memories.new_full((len(rollout.values), envs, *shape), float("nan"))
    memories[::length] = rollout.memories
    return memories


def _step(session: Session, frames: _Frames, memories: Tensor, chunks: Tensor) -> Tensor:
    """One gradient step on chunks, int64 (C, 2); replaces the memories it passes through and returns `STATISTICS`."""
    net, config = session.actor.net, session.config
    session.optimizer.zero_grad()
    texts = net.dialogue(*frames.tree)
    env, first = chunks.unbind(1)
    memory = memories[first, env]  # (C, *shape)
    losses = []
    for t in range(config.bptt):
        now = (first + t, env)
        output, memory = net.memory.step(
            _features(net, frames, texts, now), emptied(memory, frames.starts[now])
        )
        if t + 1 < config.bptt:
            memories[first + t + 1, env] = memory.detach()
        logits, values = net.heads(output)
        batch = _at(frames.batch, now)
        losses.append(ppo_loss(batch, logits, values, net.spec.action_sizes, config, session.entropy_coef))
    torch.stack([loss.total for loss in losses]).mean().backward()  # type: ignore[no-untyped-call]
    return descend(net, session.optimizer, torch.stack([loss.row() for loss in losses]).mean(0), config)


def _features(net: ActorCritic, frames: _Frames, texts: Tensor, now: tuple[Tensor, Tensor]) -> Tensor:
    """Features of one step of all chunks, (C, F): one image and one history each, even if some are equal."""
    image, history = frames.pairs[now].unbind(1)
    each = torch.arange(len(image), device=image.device)
    return net.perceive(net.prepare(frames.images[image]), texts[history], each, each)


def _at(batch: Batch, now: tuple[Tensor, Tensor]) -> Batch:
    return Batch(
        batch.actions[now], batch.log_probs[now], batch.values[now], batch.advantages[now], batch.returns[now]
    )
