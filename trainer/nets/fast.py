"""The default network, without convolutions, for ordinary CPUs: cells are read in the light of the dialogue."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import torch
from torch import Tensor, nn

from socialai_dsl.trainer.nets.base import ActorCritic, NetSpec
from socialai_dsl.trainer.nets.dialogue import HeardWords
from socialai_dsl.trainer.nets.lines import Together


class Cells:
    """Images as kinds of cells, of which there are far fewer than cells.

    Attributes:
        kinds: int64 (C, channels), the distinct cells.
        kind_of: int64 (I, cells), which of them each cell of each image is.
    """

    def __init__(self, images: Tensor, sizes: tuple[int, ...]) -> None:
        cells = images.flatten(1, 2)
        codes, self.kind_of = torch.unique(_codes(cells, sizes), return_inverse=True)
        of_kind = torch.empty_like(codes)  # a cell of each kind: any of them, since they are equal
        of_kind[self.kind_of.flatten()] = torch.arange(self.kind_of.numel(), device=images.device)
        self.kinds = cells.flatten(0, 1)[of_kind].to(torch.int64)
        self._channel = torch.arange(len(sizes), device=images.device)

    @cached_property
    def counts(self) -> Tensor:
        """How many cells of each image are of each kind, (I, C) float; three stands for more."""
        counts = torch.zeros(len(self.kind_of), len(self.kinds), device=self.kinds.device)
        return counts.scatter_add_(1, self.kind_of, torch.ones_like(self.kind_of, dtype=counts.dtype)).clamp_(
            max=3
        )

    def summed(self, table: Tensor, dim: Literal[0, 1] = 0) -> Tensor:
        """For each kind the sum of a table's entries for the code in each channel.

        `table` is (..., channels, 256, ...), channels being dimension `dim`; the sums are (..., C, ...).
        """
        entries = table[self._channel, self.kinds] if dim == 0 else table[:, self._channel, self.kinds]
        return entries.sum(dim + 1)


def _codes(cells: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """One int64 for each cell, equal where all channels are, in the order of the channels; (I, cells)."""
    codes, count = cells[..., 0].to(torch.int64), sizes[0]
    for channel, size in enumerate(sizes[1:], start=1):
        if count * size > torch.iinfo(torch.int64).max:  # so many cannot occur: number those that do
            found, codes = torch.unique(codes, return_inverse=True)
            count = len(found)
        codes, count = codes * size + cells[..., channel], count * size
    return codes


class FastNet(ActorCritic):
    """Every cell read in the light of the dialogue, a linear layer over all cells, LSTM, heads.

    Each kind of cell is embedded from its channels. The dialogue scales and shifts the embedding before a rectifier in
    two ways: feature by feature, by the recurrent state (FiLM, Perez et al. 2018); and as a whole, by a learnt weight
    of every heard word for every code of the cell. So a word such as a colour picks out the cells it names, wherever
    they are and however much was said since; with FiLM alone, agents asked and did not heed the answer. All this is
    computed once for each pair of a history and a kind of cell, then looked up for the cells of an image.

    Attributes:
        kind_size: width of a cell's embedding.
        mentions: (V, channels, 256), how much a word scales the cells that have a code; 0 at first.
    """

    kind_size = 16
    word_rows = (*ActorCritic.word_rows, "mentions")
    dialogue: HeardWords

    def __init__(
        self, spec: NetSpec, width: int = 128, dialogue: HeardWords | Together | None = None
    ) -> None:
        super().__init__(spec, width, dialogue or HeardWords(spec.vocabulary_size))
        height, ahead, channels = self.sight.shape
        # 256 values per channel, so that scenarios with other bounds share the weights' shape.
        self.channels = nn.Parameter(torch.randn(channels, 256, self.kind_size) * channels**-0.5)
        self.mentions = nn.Parameter(torch.zeros(spec.vocabulary_size, channels, 256))
        self.film = nn.Linear(self.dialogue.hidden, 2 * self.kind_size)
        self.cells = nn.Linear(height * ahead * self.kind_size, width)
        self.words = nn.Linear(self.dialogue.hidden, width, bias=False)
        self._sizes = tuple(high + 1 for high in self.sight.high)

    def prepare(self, images: Tensor) -> Cells:
        """The kinds of the images' cells."""
        return Cells(images, self._sizes)

    def perceive(self, prepared: Cells, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        used, history = torch.unique(text_index, return_inverse=True)
        state, heard = self.dialogue.split(text.index_select(0, used))  # (S, hidden), (S, V)
        mentioned = heard @ prepared.summed(self.mentions, 1)  # (S, C)
        return self.read(prepared, state, mentioned, self.words(state), image_index, history)

    def read(
        self,
        prepared: Cells,
        state: Tensor,
        mentioned: Tensor,
        said: Tensor,
        image_index: Tensor,
        history: Tensor,
    ) -> Tensor:
        """Features (P, width) of pairs of an image and one of S histories.

        Args:
            prepared: see `prepare`.
            state: (S, hidden), which scales and shifts the cells.
            mentioned: (S, C), how much each kind of cell is scaled.
            said: (S, width), added to what is seen.
            image_index: int64 (P,).
            history: int64 (P,).
        """
        kinds = prepared.summed(self.channels)  # (C, kind_size)
        scale, shift = self.film(state)[:, None].chunk(2, 2)
        scale = scale + mentioned[:, :, None]  # (S, C, kind_size)
        read = torch.relu(torch.addcmul(kinds + shift, kinds, scale))  # (S, C, kind_size)
        rows = history[:, None] * len(kinds) + prepared.kind_of.index_select(0, image_index)  # (P, cells)
        cells = read.flatten(0, 1).index_select(0, rows.flatten()).view(len(rows), -1)
        return torch.relu(self.cells(cells) + said.index_select(0, history))
