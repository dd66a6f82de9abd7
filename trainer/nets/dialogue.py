"""Encoders of the dialogue: a GRU that visits every distinct beginning of the histories once."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional


class PrefixTree(NamedTuple):
    """Distinct histories as paths from a root, so that a shared beginning is encoded once.

    State 0 is the empty history; state k >= 1 is the history of state `parents[k - 1]` plus `tokens[k - 1]`.
    States are sorted by length: those of length d are `offsets[d - 1] + 1` to `offsets[d]`.

    Attributes:
        tokens: int64 (K,) last word of each state.
        parents: int64 (K,) state it continues.
        offsets: K's running total by length, starting at 0.
        leaves: int64 (D,) state of each history given to `prefix_tree`.
    """

    tokens: Tensor
    parents: Tensor
    offsets: list[int]
    leaves: Tensor


def prefix_tree(histories: NDArray[Any], device: torch.device | str = "cpu") -> PrefixTree:
    """Build the tree of 0-padded histories, integer (D, L), duplicates allowed, one word of all of them at a time."""
    words = histories.astype(np.int64)
    lengths = np.count_nonzero(words, axis=1)  # (D,)
    state = np.zeros(len(words), np.int64)  # (D,), of each history's beginning so far
    offsets, levels = [0], [state[:0]]
    for depth in range(lengths.max(initial=0)):
        longer = lengths > depth
        edges, which = np.unique(state[longer] << 32 | words[longer, depth], return_inverse=True)
        state[longer] = offsets[-1] + 1 + which
        offsets.append(offsets[-1] + len(edges))
        levels.append(edges)
    edges = np.concatenate(levels)
    tokens, parents, leaves = (
        torch.from_numpy(part).to(device) for part in (edges & 0xFFFFFFFF, edges >> 32, state)
    )
    return PrefixTree(tokens, parents, offsets, leaves)


class DialogueEncoder(nn.Module):
    """Embedding and GRU over the words heard so far; the last state stands for the history.

    Source: SocialAI 1.0's language encoder (embedding 128, GRU 128, output at the last word).

    Attributes:
        hidden: width of the GRU, and of the words' embedding.
        size: width of the encoding, floats.
    """

    def __init__(self, vocabulary_size: int, hidden: int = 128) -> None:
        super().__init__()
        self.hidden = self.size = hidden
        self.embedding = nn.Embedding(vocabulary_size, hidden)
        self.gru = nn.GRU(hidden, hidden)

    def word_inputs(self) -> Tensor:
        """The GRU's input gates of every word of the vocabulary, (V, 3 * hidden), made once per batch of histories."""
        w_ih, b_ih = self.gru.get_parameter("weight_ih_l0"), self.gru.get_parameter("bias_ih_l0")
        return functional.linear(self.embedding.weight, w_ih, b_ih)

    def _advance(self, inputs: Tensor, states: Tensor) -> Tensor:
        """One word more: input gates (K, 3 * hidden) and states (K, hidden) to the next states.

        PyTorch's GRU (Cho et al. 2014), gates in its order: reset, update, new.
        """
        size = self.hidden
        w_hh, b_hh = self.gru.get_parameter("weight_hh_l0"), self.gru.get_parameter("bias_hh_l0")
        recurrent = functional.linear(states, w_hh, b_hh)
        gates = torch.sigmoid(inputs[:, : 2 * size] + recurrent[:, : 2 * size])
        new = torch.tanh(torch.addcmul(inputs[:, 2 * size :], gates[:, :size], recurrent[:, 2 * size :]))
        return torch.lerp(new, states, gates[:, size:])

    def forward(self, tree: PrefixTree) -> Tensor:
        """Encode the states of a tree, level by level; (K + 1, size), the empty history's row 0 being zero."""
        inputs = functional.embedding(tree.tokens, self.word_inputs())
        levels = [inputs.new_zeros(1, self.hidden)]
        first_of_parents = 0
        for first, behind in pairwise(tree.offsets):
            before = levels[-1].index_select(0, tree.parents[first:behind] - first_of_parents)
            levels.append(self._advance(inputs[first:behind], before))
            first_of_parents = first + 1
        return torch.cat(levels)

    @torch.no_grad()
    def extend(self, states: Tensor, tokens: Tensor, inputs: Tensor) -> Tensor:
        """Continue encodings by the words heard since, without gradients.

        Args:
            states: (K, size) encodings so far.
            tokens: int64 (K, S), the new words of each, 0-padded.
            inputs: result of `word_inputs` under the current weights.

        Returns:
            (K, size) encodings after the new words.
        """
        states = states.clone()
        for words in tokens.unbind(1):
            longer = words.nonzero().squeeze(1)
            states[longer] = self._advance(inputs[words[longer]], states[longer])
        return states


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

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        states = super().forward(tree)
        heard = states.new_zeros(len(states), self.size - self.hidden)
        # Level by level: a history has the words of its parent, and one more.
        for first, behind in pairwise(tree.offsets):
            words = heard.index_select(0, tree.parents[first:behind])
            heard[1 + first : 1 + behind] = words.scatter_(1, tree.tokens[first:behind, None], 1)
        return torch.cat((states, heard), 1)

    @torch.no_grad()
    def extend(self, states: Tensor, tokens: Tensor, inputs: Tensor) -> Tensor:
        """See `DialogueEncoder.extend`."""
        recurrent, heard = self.split(states)
        heard = heard.scatter(1, tokens, 1)
        heard[:, 0] = 0  # the padding is no word
        return torch.cat((super().extend(recurrent, tokens, inputs), heard), 1)
