"""Minibatches of a rollout: whole environments with each distinct frame computed once, or the paper's chunks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
import torch
from torch import Tensor

from trainer.features import Actor, prefix_tree
from trainer.guides import Lead
from trainer.nets import ActorCritic
from trainer.nets.memory import emptied
from trainer.rollout import Rollout
from trainer.session import Session

SMALLEST_SHARE = 1024
"""Frames below which a thread of its own costs more, waiting for Python's interpreter lock, than it brings."""


@dataclass(frozen=True)
class Batch:
    """Frames that the loss is taken over: N of a minibatch, or (T, E) of a whole rollout in the place of N.

    Attributes:
        actions: int64 (N, 4). log_probs: float32 (N, 4), of the acting policy, before masking.
        values: float32 (N,), of the acting critic.
        advantages: float32 (N,). returns: float32 (N,), the targets of the value.
        lead: what a guide did and advised, its tensors (N, ...); None without a guide.
    """

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor
    lead: Lead[Tensor] | None = None

    def pick(self, some: Callable[[Tensor], Tensor]) -> Batch:
        """The frames that `some` takes out of each tensor."""
        lead = None if self.lead is None else Lead(*map(some, self.lead))
        return Batch(
            some(self.actions),
            some(self.log_probs),
            some(self.values),
            some(self.advantages),
            some(self.returns),
            lead,
        )


def minibatches(session: Session, rollout: Rollout, batch: Batch) -> Iterator[Sequence[Minibatch]]:
    """The minibatches of all epochs, each in shares that threads may work on side by side.

    Args:
        session: its configuration says of what kind they are, its generator in which order they come.
        rollout: what was played.
        batch: all of its frames, (T, E, ...).
    """
    kind = _chunks if session.config.update == "chunks" else _environments
    return kind(session, rollout, batch)


# -- whole environments -------------------------------------------------------------------------------------------


def _environments(session: Session, rollout: Rollout, batch: Batch) -> Iterator[Sequence[Environments]]:
    """Groups of whole environments, drawn anew for each rollout and visited in a new order in each epoch."""
    config, generator = session.config, session.generator
    stretch = config.bptt or config.horizon
    order = torch.randperm(config.envs, generator=generator)
    groups = []
    for envs in order.tensor_split(config.minibatches):
        shares = max(1, min(config.threads, len(envs) * config.horizon // SMALLEST_SHARE))
        groups.append(
            [cut_out(session.actor, rollout, batch, share, stretch) for share in envs.tensor_split(shares)]
        )
    for _ in range(config.epochs):
        for index in torch.randperm(len(groups), generator=generator).tolist():
            yield groups[index]


@dataclass(frozen=True)
class Environments:
    """Whole environments of a rollout with their distinct frames, prepared once and used in every epoch.

    Attributes:
        batch: the frames, time-major: N = T * B.
        starts: bool (T, B). memory: (B, *shape) before the first step.
        prepared: the net's view of the distinct images.
        tree: tokens, parents and offsets of the distinct histories' prefix tree.
        image_index, text_index: int64 (P,), image and tree state of each distinct pair.
        frame_index: int64 (N,), pair of each frame.
    """

    batch: Batch
    starts: Tensor
    memory: Tensor
    prepared: Any
    tree: tuple[Tensor, Tensor, list[int]]
    image_index: Tensor
    text_index: Tensor
    frame_index: Tensor

    @property
    def frames(self) -> int:
        """How many there are: N."""
        return len(self.batch.returns)

    def evaluate(self, net: ActorCritic) -> Iterator[tuple[Batch, Tensor, Tensor]]:
        """Frames, logits (N, sum of sizes) and values (N,) under the present weights, in one part."""
        text = net.dialogue(*self.tree)
        features = net.perceive(self.prepared, text, self.image_index, self.text_index)
        steps, count = self.starts.shape
        frames = features.index_select(0, self.frame_index).view(steps, count, -1)
        logits, values = net.heads(net.memory(frames, self.starts, self.memory).flatten(0, 1))
        yield self.batch, logits, values


def cut_out(actor: Actor, rollout: Rollout, batch: Batch, envs: Tensor, stretch: int) -> Environments:
    """The environments `envs`, int64 (B,), of a rollout, in stretches of `stretch` steps side by side."""

    def cut(array: Tensor) -> Tensor:
        """(T, E, ...) to (stretch, T / stretch * B, ...), the stretches of one time side by side."""
        chosen = array.index_select(1, envs.to(array.device))
        return chosen.view(-1, stretch, *chosen.shape[1:]).transpose(0, 1).flatten(1, 2)

    pair_rows, frame_index = np.unique(cut(torch.from_numpy(rollout.pair_rows)).numpy(), return_inverse=True)
    pairs = actor.pairs.data[pair_rows]
    image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
    history_rows, history_index = np.unique(pairs[:, 1], return_inverse=True)
    tree = prefix_tree(actor.histories.data[history_rows])
    return Environments(
        batch.pick(lambda array: cut(array).flatten(0, 1)),
        cut(torch.from_numpy(rollout.starts)).to(actor.device),
        rollout.memories.index_select(1, envs.to(actor.device)).flatten(0, 1),
        actor.net.prepare(actor.move(actor.images.data[image_rows])),
        actor.move_tree(tree),
        actor.move(image_index),
        actor.move(tree.leaves[history_index]),
        actor.move(frame_index.reshape(-1)),
    )


# -- chunks -------------------------------------------------------------------------------------------------------


def _chunks(session: Session, rollout: Rollout, batch: Batch) -> Iterator[Sequence[Chunks]]:
    """Chunks of `bptt` steps, shifted in every second epoch, in a new order in each, as the paper's code has them.

    A minibatch is some of them, all by the paper's presets. A chunk begins with the memory that was last computed for
    its first step: in the first epoch that of the acting network; and since each epoch stores the memories it passes
    through, one of an earlier epoch afterwards.
    """
    config, actor = session.config, session.actor
    tree = prefix_tree(actor.histories.data)
    images, histories = np.moveaxis(actor.pairs.data[rollout.pair_rows], 2, 0)
    frames = RolloutFrames(
        batch,
        actor.move(rollout.starts),
        actor.move(np.stack((images, tree.leaves[histories]), 2)),
        actor.move(actor.images.data),
        actor.move_tree(tree),
        acting_memories(rollout, config.bptt),
    )
    size = config.frames_per_update // config.bptt // config.minibatches
    for epoch in range(config.epochs):
        starts = chunk_starts(config.envs, config.horizon, config.bptt, shifted=epoch % 2 == 1)
        order = torch.randperm(len(starts), generator=session.generator)
        for some in torch.split(starts[order], size):
            yield [Chunks(frames, some.to(actor.device), config.bptt)]


def chunk_starts(num_envs: int, horizon: int, length: int, shifted: bool) -> Tensor:
    """Environment and first step of every chunk of `length` steps, int64 (C, 2), environment by environment.

    Chunks lie end to end; shifted ones begin `length // 2` steps later and each environment has one less, because
    the last one would not end within the rollout.
    """
    first = torch.arange(0, horizon, length)
    if shifted:
        first = first[:-1] + length // 2
    return torch.cartesian_prod(torch.arange(num_envs), first)


def acting_memories(rollout: Rollout, length: int) -> Tensor:
    """Memory before each step, float32 (T, E, *shape), known at the first steps of unshifted chunks only.

    The others are not numbers until the first epoch fills them in, so that none can be used by mistake.
    """
    _, envs, *shape = rollout.memories.shape
    memories = rollout.memories.new_full((len(rollout.values), envs, *shape), float("nan"))
    memories[::length] = rollout.memories
    return memories


@dataclass(frozen=True)
class RolloutFrames:
    """All frames of a rollout; every tensor but images and tree has the axes (T, E) first.

    Attributes:
        batch: what the loss needs; its tensors are (T, E, ...).
        starts: bool (T, E), where an episode starts, into which no memory reaches.
        pairs: int64 (T, E, 2), row of the image in `images` and state of the history in the tree.
        images: uint8 (I, H, W, C).
        tree: tokens, parents and offsets of the histories' prefix tree.
        memories: float32 (T, E, *shape), the last computed before each step.
    """

    batch: Batch
    starts: Tensor
    pairs: Tensor
    images: Tensor
    tree: tuple[Tensor, Tensor, list[int]]
    memories: Tensor


@dataclass(frozen=True)
class Chunks:
    """Some chunks of a rollout, computed one step of all of them at a time.

    So BatchNorm sees C frames at a time, one image and one history each, even if some are equal. Gradients go back
    through the memory to a chunk's beginning and no further.

    Attributes:
        rollout: the frames they are parts of.
        starts: int64 (C, 2), environment and first step of each.
        length: steps of each.
    """

    rollout: RolloutFrames
    starts: Tensor
    length: int

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.starts) * self.length

    def evaluate(self, net: ActorCritic) -> Iterator[tuple[Batch, Tensor, Tensor]]:
        """Frames, logits (C, sum of sizes) and values (C,) under the present weights, a part for each step.

        Replaces the memories it passes through.
        """
        rollout = self.rollout
        texts = net.dialogue(*rollout.tree)
        env, first = self.starts.unbind(1)
        each = torch.arange(len(env), device=env.device)
        memory = rollout.memories[first, env]  # (C, *shape)
        for t in range(self.length):
            now = (first + t, env)
            image, history = rollout.pairs[now].unbind(1)
            features = net.perceive(net.prepare(rollout.images[image]), texts[history], each, each)
            output, memory = net.memory.step(features, emptied(memory, rollout.starts[now]))
            if t + 1 < self.length:
                rollout.memories[first + t + 1, env] = memory.detach()
            yield rollout.batch.pick(itemgetter(now)), *net.heads(output)


Minibatch = Environments | Chunks
"""Frames of one gradient step. The loss is the mean over the parts, all of one size, that `evaluate` gives."""
