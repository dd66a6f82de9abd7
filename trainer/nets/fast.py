"""This module is the default network: a bag of cells instead of convolutions, for training on ordinary CPUs."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from trainer.nets.base import ActorCritic, NetSpec
from trainer.nets.dialogue import DialogueEncoder


class CellRows:
    """Which row of the cell table each cell of each image selects.

    A row stands for one kind of cell (a distinct tuple of channels) at one place of the view.

    Attributes:
        kinds: int64 (C, channels), the distinct tuples.
        rows: int64 (I, cells), place * C + kind.
    """

    def __init__(self, images: Tensor, sizes: tuple[int, ...]) -> None:
        cells = images.flatten(1, 2)
        code = cells[..., 0].to(torch.int64)
        for channel, size in enumerate(sizes[1:], start=1):
            code = code * size + cells[..., channel]
        present = torch.zeros(_product(sizes), dtype=torch.bool, device=images.device)
        present[code.flatten()] = True
        kinds = present.nonzero().squeeze(1)
        rank = present.cumsum(0) - 1
        self.kinds = _unravel(kinds, sizes)
        places = torch.arange(cells.shape[1], device=images.device) * len(kinds)
        self.rows = rank[code] + places

    @cached_property
    def transposed(self) -> tuple[Tensor, Tensor]:
        """For each table row the images that select it: their numbers, row after row, and where each row begins."""
        flat = self.rows.flatten()
        images = torch.argsort(flat, stable=True) // self.rows.shape[1]
        counts = torch.bincount(flat, minlength=self.rows.shape[1] * len(self.kinds))
        return images, counts.cumsum(0) - counts


def _product(sizes: tuple[int, ...]) -> int:
    total = 1
    for size in sizes:
        total *= size
    return total


def _unravel(codes: Tensor, sizes: tuple[int, ...]) -> Tensor:
    channels = []
    for size in reversed(sizes):
        channels.append(codes % size)
        codes = codes // size
    return torch.stack(channels[::-1], 1)


class _SumRows(torch.autograd.Function):
    """Sum of an image's table rows; its gradient is the same kind of sum over the transposed selection."""

    @staticmethod
    def forward(ctx: Any, table: Tensor, view: CellRows) -> Tensor:
        ctx.view = view
        return functional.embedding_bag(view.rows, table, mode="sum")

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, None]:
        images, offsets = ctx.view.transposed
        return functional.embedding_bag(images, grad.contiguous(), offsets, mode="sum"), None


class FastNet(ActorCritic):
    """Bag of cells, FiLM by the dialogue, LSTM, heads.

    Each kind of cell is embedded from its channels; place and kind together select a row of a table; an image is the
    sum of its rows. That is a linear layer over embedded cells, computed by looking up what few kinds there are.
    The dialogue scales and shifts the sum (FiLM, Perez et al. 2018).

    Attributes:
        kind_size: width of a cell's embedding.
    """

    kind_size = 16

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        super().__init__(spec, width, DialogueEncoder(spec.vocabulary_size))
        height, ahead, channels = spec.image_shape
        # 256 values per channel, so that scenarios with other bounds share the weights' shape.
        self.channels = nn.Parameter(torch.randn(channels, 256, self.kind_size))
        self.kind = nn.Linear(self.kind_size, self.kind_size)
        self.places = nn.Parameter(torch.empty(height * ahead, self.kind_size, width))
        nn.init.normal_(self.places, std=(height * ahead * self.kind_size) ** -0.5)
        self.bias = nn.Parameter(torch.zeros(width))
        self.film = nn.Linear(self.dialogue.size, 2 * width)
        self._sizes = tuple(high + 1 for high in spec.image_high)

    def prepare(self, images: Tensor) -> CellRows:
        """Kinds and table rows of the images."""
        return CellRows(images, self._sizes)

    def perceive(self, prepared: CellRows, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        channel = torch.arange(self.channels.shape[0], device=text.device)
        kinds = self.kind(torch.relu(self.channels[channel, prepared.kinds].sum(1)))
        table = torch.matmul(kinds, self.places).flatten(0, 1)
        images: Tensor = _SumRows.apply(table, prepared)  # type: ignore[no-untyped-call]
        scale, shift = self.film(text).index_select(0, text_index).chunk(2, 1)
        seen = (images + self.bias).index_select(0, image_index)
        return torch.relu(torch.addcmul(seen + shift, seen, scale))
