"""The update of the paper's code: a rollout in chunks, which go through the network one step at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
import torch
from torch import Tensor

from socialai_dsl.trainer.frames import Batch, Frames, Outputs
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.nets.dialogue import PrefixTree, prefix_tree
from socialai_dsl.trainer.nets.memory import emptied
from socialai_dsl.trainer.rollout import Rollout
from socialai_dsl.trainer.session import Session


@dataclass(frozen=True)
class Chunks:
    """Some chunks of a rollout, computed one step of all of them at a time.

    So BatchNorm sees C frames at a time, one image and one history each, even if some are equal. Gradients go back
    through the memory to a chunk's beginning and no further.

    Attributes:
        batch: all frames of the rollout, (T, E, ...).
        resets: bool (T, E), where a session starts, into which no memory reaches.
        pairs: int64 (T, E, 2), row of the image in `images` and state of the history in the tree.
        images: uint8 (I, H, W, C).
        tree: of the histories.
        memories: float32 (T, E, *shape), the last computed before each step; not numbers where none was yet.
        length: steps of each chunk.
        starts: int64 (C, 2), environment and first step of each.
        weight: share of its minibatch's frames that these are: all.
    """

    batch: Batch
    resets: Tensor
    pairs: Tensor
    images: Tensor
    tree: PrefixTree
    memories: Tensor
    length: int
    starts: Tensor
    weight: float = 1.0

    def evaluate(self, net: ActorCritic) -> Iterator[Frames]:
        """The frames under the present weights, a part of C for each step.

        Replaces the memories it passes through.
        """
        texts = net.dialogue(self.tree)
        env, first = self.starts.unbind(1)
        each = torch.arange(len(env), device=env.device)
        memory = self.memories[first, env]  # (C, *shape)
        for t in range(self.length):
            now = (first + t, env)
            image, history = self.pairs[now].unbind(1)
            features = net.perceive(net.prepare(self.images[image]), texts[history], each, each)
            output, memory = net.memory.step(features, emptied(memory, self.resets[now]))
            if t + 1 < self.length:
                self.memories[first + t + 1, env] = memory.detach()
            logits, values = net.heads(output)
            yield Frames(self.batch.pick(itemgetter(now)), Outputs(logits, values, features, output))


def chunks(session: Session, rollout: Rollout, batch: Batch) -> Iterator[list[Chunks]]:
    """The minibatches of all epochs: chunks of `bptt` steps, shifted in every second epoch, in a new order in each.

    A minibatch is some of them, all by the paper's presets. A chunk begins with the memory that was last computed for
    its first step: in the first epoch that of the acting network; and since each epoch stores the memories it passes
    through, one of an earlier epoch afterwards.
    """
    config, actor = session.config, session.actor
    tree = prefix_tree(actor.histories.data, actor.device)
    images, histories = np.moveaxis(actor.pairs.data[rollout.pair_rows.numpy()], 2, 0)  # (T, E) each
    shape = (config.horizon, config.envs, *rollout.memories.shape[2:])
    memories = rollout.memories.new_full(shape, float("nan"))  # so that none can be used by mistake
    memories[:: config.bptt] = rollout.memories
    every = Chunks(
        batch,
        rollout.forgets,
        torch.stack((actor.move(images), actor.move(histories)), 2),
        actor.move(actor.images.data),
        tree,
        memories,
        config.bptt,
        rollout.actions.new_empty(0, 2),
    )
    size = config.frames_per_update // config.bptt // config.minibatches
    for epoch in range(config.epochs):
        starts = chunk_starts(config.envs, config.horizon, config.bptt, shifted=epoch % 2 == 1)
        order = torch.randperm(len(starts), generator=session.generator)
        for some in torch.split(starts[order], size):
            yield [replace(every, starts=some.to(actor.device))]


def chunk_starts(num_envs: int, horizon: int, length: int, shifted: bool) -> Tensor:
    """Environment and first step of every chunk of `length` steps, int64 (C, 2), environment by environment.

    Chunks lie end to end; shifted ones begin `length // 2` steps later and each environment has one less, because
    the last one would not end within the rollout.
    """
    first = torch.arange(0, horizon, length)
    if shifted:
        first = first[:-1] + length // 2
    return torch.cartesian_prod(torch.arange(num_envs), first)
