"""This module encodes dialogue histories as the state of a GRU and, beside it, which words were heard."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor

from trainer.nets.dialogue import DialogueEncoder


class HeardWords(DialogueEncoder):
    """The encoding of `DialogueEncoder`, then for each word of the vocabulary 1 if it is in the history, else 0.

    A recurrent state forgets a word while others are said after it, and has to learn not to. Here nothing is forgotten,
    and what order means is left to the recurrent state.
    """

    def __init__(self, vocabulary_size: int, hidden: int = 128) -> None:
        super().__init__(vocabulary_size, hidden)
        self.size = hidden + vocabulary_size

    def split(self, encodings: Tensor) -> tuple[Tensor, Tensor]:
        """Encodings (D, size) as recurrent states (D, hidden) and the words heard (D, V)."""
        return encodings[:, : self.hidden], encodings[:, self.hidden :]

    def forward(self, tokens: Tensor, parents: Tensor, offsets: Sequence[int]) -> Tensor:
        """See `DialogueEncoder.forward`."""
        states = super().forward(tokens, parents, offsets)
        heard = states.new_zeros(len(states), self.size - self.hidden)
        # Level by level: a history has the words of its parent, and one more.
        for first, behind in pairwise(offsets):
            words = heard.index_select(0, parents[first:behind])
            heard[1 + first : 1 + behind] = words.scatter_(1, tokens[first:behind, None], 1)
        return torch.cat((states, heard), 1)

    @torch.no_grad()
    def extend(self, states: Tensor, tokens: Tensor, lengths: Sequence[int], inputs: Tensor) -> Tensor:
        """See `DialogueEncoder.extend`."""
        recurrent, heard = self.split(states)
        heard = heard.clone()
        behind = torch.tensor(lengths, device=tokens.device)
        new = torch.arange(tokens.shape[1], device=tokens.device) < behind[:, None]
        heard[new.nonzero()[:, 0], tokens[new]] = 1
        return torch.cat((super().extend(recurrent, tokens, lengths, inputs), heard), 1)
