"""Encoders of the dialogue: a GRU that visits every distinct beginning of the histories once."""

from __future__ import annotations

from abc import ABC, abstractmethod
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
        words: int64 (D, L), the histories themselves, 0-padded.
    """

    tokens: Tensor
    parents: Tensor
    offsets: list[int]
    leaves: Tensor
    words: Tensor


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
    tokens, parents, leaves, paths = (
        torch.from_numpy(part).to(device) for part in (edges & 0xFFFFFFFF, edges >> 32, state, words)
    )
    return PrefixTree(tokens, parents, offsets, leaves, paths)


class _TreeGru(torch.autograd.Function):
    """GRU (Cho et al. 2014) over a prefix tree, level by level, with its backward pass written out.

    It takes half the time of autograd, which replays about ten small operations for each level, of which long dialogues
    have thirty. Only the products along the tree go level by level; the weights' gradients are single products at the
    end. Gates are in PyTorch's order: reset, update, new.
    """

    @staticmethod
    def forward(
        ctx: Any, inputs: Tensor, w_hh: Tensor, b_hh: Tensor, parents: Tensor, offsets: list[int]
    ) -> Tensor:
        count, size = len(parents), w_hh.shape[1]
        states = inputs.new_zeros(count + 1, size)  # the empty history's first
        before, new = inputs.new_empty(2, count, size).unbind()
        gates, recurrent = inputs.new_empty(count, 2 * size), inputs.new_empty(count, 3 * size)
        for first, behind in pairwise(offsets):
            at = slice(first, behind)
            h, hidden, gate, candidate = before[at], recurrent[at], gates[at], new[at]
            torch.index_select(states, 0, parents[at], out=h)
            torch.addmm(b_hh, h, w_hh.t(), out=hidden)
            given, given_new = inputs[at].tensor_split((2 * size,), 1)
            torch.add(given, hidden[:, : 2 * size], out=gate).sigmoid_()
            torch.addcmul(given_new, gate[:, :size], hidden[:, 2 * size :], out=candidate).tanh_()
            torch.lerp(candidate, h, gate[:, size:], out=states[first + 1 : behind + 1])
        ctx.save_for_backward(before, gates, new, recurrent[:, 2 * size :], w_hh, parents)
        ctx.offsets = offsets
        return states

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        before, gates, new, recurrent_new, w_hh, parents = ctx.saved_tensors
        reset, update = gates.chunk(2, 1)
        aten = torch.ops.aten
        # What each state's gradient does to the inputs of its gates, for all states at once.
        to_new = aten.tanh_backward(1 - update, new)
        slopes = torch.stack(
            (
                aten.sigmoid_backward(to_new * recurrent_new, reset),
                aten.sigmoid_backward(before - new, update),
                to_new * reset,
            ),
            1,
        )  # (K, 3, size); each level's slopes are replaced by its gradients
        d_states = grad.clone()
        for first, behind in reversed(list(pairwise(ctx.offsets))):
            d_state, d_gates = d_states[first + 1 : behind + 1], slopes[first:behind]
            d_gates.mul_(d_state[:, None])
            d_before = torch.addmm(d_state * update[first:behind], d_gates.flatten(1), w_hh)
            d_states.index_add_(0, parents[first:behind], d_before)
        d_hidden = slopes.flatten(1)
        d_inputs = torch.cat((d_hidden[:, : -to_new.shape[1]], d_states[1:] * to_new), 1)
        return d_inputs, d_hidden.t() @ before, d_hidden.sum(0), None, None


class DialogueEncoder(nn.Module, ABC):
    """An encoder of histories.

    Attributes:
        size: width of an encoding.
    """

    size: int

    @abstractmethod
    def forward(self, tree: PrefixTree) -> Tensor:
        """Encode the histories of a tree, float32 (D, size), those with a shared beginning together."""


class GruEncoder(DialogueEncoder):
    """Embedding and GRU over the words heard so far; the last state stands for the history, zero for the empty one.

    Source: SocialAI 1.0's language encoder (embedding 128, GRU 128, output at the last word).

    Attributes:
        hidden: width of the GRU, and of the words' embedding.
    """

    def __init__(self, vocabulary_size: int, hidden: int = 128) -> None:
        super().__init__()
        self.hidden = self.size = hidden
        self.embedding = nn.Embedding(vocabulary_size, hidden)
        self.gru = nn.GRU(hidden, hidden)

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        if not len(tree.tokens):  # nothing was heard, so no weight takes part
            return self.embedding.weight.new_zeros(len(tree.leaves), self.hidden)
        w_ih, w_hh = self.gru.get_parameter("weight_ih_l0"), self.gru.get_parameter("weight_hh_l0")
        b_ih, b_hh = self.gru.get_parameter("bias_ih_l0"), self.gru.get_parameter("bias_hh_l0")
        words = functional.linear(self.embedding.weight, w_ih, b_ih)  # (V, 3 * hidden)
        inputs = functional.embedding(tree.tokens, words)  # (K, 3 * hidden)
        states: Tensor = _TreeGru.apply(  # type: ignore[no-untyped-call]
            inputs, w_hh, b_hh, tree.parents, tree.offsets
        )
        return states.index_select(0, tree.leaves)


class HeardWords(GruEncoder):
    """The encoding of `GruEncoder`, then for each word of the vocabulary 1 if it is in the history, else 0.

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
        heard = states.new_zeros(len(states), self.embedding.num_embeddings).scatter_(1, tree.words, 1)
        heard[:, 0] = 0  # padding
        return torch.cat((states, heard), 1)
