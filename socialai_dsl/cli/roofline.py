"""This module says how fast the paper's network could be trained on this machine if only its arithmetic counted."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import Final

import torch
from torch.nn import functional

from trainer.crew import Crew

CELLS: Final = 7 * 7
WIDTH: Final = 128
_BATCHES: Final = (64, 256)
_SECONDS: Final = 0.4


@dataclass(frozen=True)
class Work:
    """What a network computed: distinct images and pairs of image and history, without and with gradients.

    Attributes:
        images, pairs: in the rollout, forward only.
        learnt_images, learnt_pairs: in the update, forward and backward, all epochs together.
    """

    images: int
    pairs: int
    learnt_images: int
    learnt_pairs: int

    def flops(self, frames: int, epochs: int, channels: int = 4) -> float:
        """Floating point operations of the paper's network for this work.

        A multiplication and an addition count as two. A 3 x 3 convolution of 7 x 7 cells from a to b channels is
        2 * 49 * 9 * a * b: 0.45 M from 4 to 128 and 14.45 M from 128 to 128. Two of them read an image; the four of
        the two FiLM blocks see a pair. The LSTM is 2 * (128 + 128) * 512 and the five heads about 2 * 5 * 128 * 64,
        for every frame. That is 73.1 M for a frame of its own; the FiLM layers and the dialogue, 0.1 M a history and
        0.2 M a word, are left out, because histories are shared. The backward pass costs twice the forward pass: a
        gradient for the inputs and one for the weights. So a frame that shares nothing costs 1 + 3 * 4 forward
        passes with four epochs, 951 M.
        """
        first, other = 2 * CELLS * 9 * channels * WIDTH, 2 * CELLS * 9 * WIDTH * WIDTH
        memory = 2 * 2 * WIDTH * 4 * WIDTH + 2 * 5 * WIDTH * 64
        images = self.images + 3 * self.learnt_images
        pairs = self.pairs + 3 * self.learnt_pairs
        return float(images * (first + other) + pairs * 4 * other + (1 + 3 * epochs) * frames * memory)


def every_frame(frames: int, epochs: int) -> Work:
    """The work when each frame is computed by itself."""
    return Work(frames, frames, frames * epochs, frames * epochs)


def convolution_limit(dtype: torch.dtype, threads: int) -> float:
    """Floating point operations per second of the network's convolutions, forward and backward.

    The best of several batches and memory layouts; each thread convolves a batch of its own on one core.
    """
    layouts = (torch.contiguous_format, torch.channels_last)
    with Crew(threads) as crew:
        return max(
            sum(crew.map(partial(_convolve, dtype, batch), [layout] * threads))
            for batch in _BATCHES
            for layout in layouts
        )


def _convolve(dtype: torch.dtype, batch: int, layout: torch.memory_format) -> float:
    """Speed of one thread, by its own CPU time."""
    images = torch.randn(batch, WIDTH, 7, 7, dtype=dtype).to(memory_format=layout).requires_grad_()
    weight = torch.randn(WIDTH, WIDTH, 3, 3, dtype=dtype).to(memory_format=layout).requires_grad_()
    passes, began = -1, 0.0
    while passes <= 0 or time.thread_time() - began < _SECONDS:
        output = functional.conv2d(images, weight, padding=1)
        torch.autograd.grad(output, (images, weight), output.detach())
        passes += 1
        if passes == 0:  # the first pass only warms up
            began = time.thread_time()
    seconds = time.thread_time() - began
    return passes * batch * 3 * 2 * CELLS * 9 * WIDTH * WIDTH / seconds
