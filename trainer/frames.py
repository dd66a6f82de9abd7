"""Frames as networks and losses take them: stretches of steps, in which each distinct frame is computed once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from socialai_dsl.trainer.features import Int64, content_ids
from socialai_dsl.trainer.guides import Lead
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.nets.dialogue import PrefixTree, prefix_tree


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


class Outputs(NamedTuple):
    """What a network makes of N frames under its present weights, with gradients; float32.

    Attributes:
        logits: (N, A) of all heads side by side. values: (N,).
        features: (N, F), of the frames alone. memory: (N, M), the output of the memory.
    """

    logits: Tensor
    values: Tensor
    features: Tensor
    memory: Tensor


@dataclass(frozen=True)
class Stretches:
    """T steps each of B environments, with their distinct frames prepared once; N = T * B frames, time-major.

    Attributes:
        starts: bool (T, B), whether memory starts anew with the step. memory: (B, ...) before the first step.
        images: uint8 (I, H, W, C), distinct ones. histories: int16 (D, L), distinct ones, as the network reads them.
        prepared: the net's view of the images. tree: of the histories.
        image_index, history_index: int64 (P,), image and history of each distinct pair.
        frame_index: int64 (N,), pair of each frame.
    """

    starts: Tensor
    memory: Tensor
    images: Tensor
    histories: Tensor
    prepared: Any
    tree: PrefixTree
    image_index: Tensor
    history_index: Tensor
    frame_index: Tensor

    @classmethod
    def of(
        cls,
        net: ActorCritic,
        starts: Tensor,
        memory: Tensor,
        images: NDArray[np.uint8],
        histories: NDArray[np.int16],
        pairs: Int64,
        frame_index: Int64,
    ) -> Stretches:
        """Prepare frames for a network, on its device.

        Args:
            net: the network.
            starts: bool (T, B).
            memory: (B, ...).
            images: uint8 (I, H, W, C).
            histories: int16 (D, L), as the network reads them.
            pairs: int64 (P, 2), distinct ones: rows of `images` and of `histories`.
            frame_index: int64 (N,), pair of each frame.
        """
        device = starts.device
        image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
        history_rows, history_index = np.unique(pairs[:, 1], return_inverse=True)
        shown = torch.from_numpy(images[image_rows]).to(device)
        return cls(
            starts,
            memory,
            shown,
            torch.from_numpy(histories[history_rows]).to(device),
            net.prepare(shown),
            prefix_tree(histories[history_rows], device),
            *(
                torch.from_numpy(index.reshape(-1)).to(device)
                for index in (image_index, history_index, frame_index)
            ),
        )

    @classmethod
    def replayed(
        cls, net: ActorCritic, images: Tensor, tokens: Tensor, starts: Tensor, memory: Tensor
    ) -> Stretches:
        """Prepare frames that were kept, as by a replay buffer.

        Args:
            net: the network, which may have learnt since.
            images: uint8 (T, B, H, W, C).
            tokens: int16 (T, B, L), as the network reads them; see `seen`.
            starts: bool (T, B), on the network's device.
            memory: (B, ...) before the first step, on the same.
        """
        pictures, lines = (array.flatten(0, 1).cpu().numpy() for array in (images, tokens))
        ids = content_ids(pictures) if net.distinct else np.arange(len(pictures))
        _, image_rows, image_of = np.unique(ids, return_index=True, return_inverse=True)
        _, line_rows, line_of = np.unique(content_ids(lines), return_index=True, return_inverse=True)
        pairs, frame_index = np.unique(np.stack((image_of, line_of), 1), axis=0, return_inverse=True)
        return cls.of(net, starts, memory, pictures[image_rows], lines[line_rows], pairs, frame_index)

    def seen(self) -> tuple[Tensor, Tensor]:
        """The frames themselves: images, uint8 (T, B, H, W, C), and histories as read, int16 (T, B, L), 0-padded."""
        steps = self.starts.shape
        images = self.images[self.image_index[self.frame_index]]
        histories = self.histories[self.history_index[self.frame_index]]
        return images.view(*steps, *images.shape[1:]), histories.view(*steps, -1)

    def outputs(self, net: ActorCritic) -> Outputs:
        """What the network makes of the frames now."""
        text = net.dialogue(self.tree)
        pairs = net.perceive(self.prepared, text, self.image_index, self.history_index)
        features = pairs.index_select(0, self.frame_index)
        memory = net.memory(features.view(*self.starts.shape, -1), self.starts, self.memory).flatten(0, 1)
        logits, values = net.heads(memory)
        return Outputs(logits, values, features, memory)


class Frames(NamedTuple):
    """N frames of a minibatch and what the network makes of them."""

    batch: Batch
    outputs: Outputs


@dataclass(frozen=True)
class Environments:
    """Whole environments of a rollout, a share of a minibatch, prepared once and used in every epoch.

    Attributes:
        batch: the frames, time-major.
        stretches: the same as the network takes them: `bptt` steps each, side by side.
        weight: share of its minibatch's frames that these are.
    """

    batch: Batch
    stretches: Stretches
    weight: float

    def evaluate(self, net: ActorCritic) -> Iterator[Frames]:
        """The frames under the present weights, in one part."""
        yield Frames(self.batch, self.stretches.outputs(net))
