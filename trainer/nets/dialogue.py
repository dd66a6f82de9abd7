"""This module encodes dialogue histories with a GRU that visits every distinct prefix of them once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional


class _TreeGru(torch.autograd.Function):
    """GRU over a prefix tree, level by level, with the backward pass written out.

    Autograd would keep and replay about ten small nodes per level; here weight gradients are one product over all
    states. Gates are in PyTorch's order: reset, update, new.
    """

    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any,
        inputs: Tensor,
        w_hh: Tensor,
        b_hh: Tensor,
        root: Tensor,
        parents: Tensor,
        offsets: Sequence[int],
    ) -> Tensor:
        count, size = len(parents), w_hh.shape[1]
        states = root.new_empty(count + 1, size)
        states[0] = root
        before = root.new_empty(count, size)
        reset_update = root.new_empty(count, 2 * size)
        new = root.new_empty(count, size)
        hidden_new = root.new_empty(count, size)
        w_t = w_hh.t()
        for a, b in zip(offsets[:-1], offsets[1:], strict=True):
            previous = torch.index_select(states, 0, parents[a:b], out=before[a:b])
            hidden = torch.addmm(b_hh, previous, w_t)
            gates = torch.add(
                inputs[a:b, : 2 * size], hidden[:, : 2 * size], out=reset_update[a:b]
            ).sigmoid_()
            hidden_new[a:b] = hidden[:, 2 * size :]
            candidate = torch.addcmul(
                inputs[a:b, 2 * size :], gates[:, :size], hidden[:, 2 * size :], out=new[a:b]
            ).tanh_()
            torch.lerp(candidate, previous, gates[:, size:], out=states[a + 1 : b + 1])
        ctx.save_for_backward(before, reset_update, new, hidden_new, w_hh, parents)
        ctx.offsets = offsets
        return states

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:  # type: ignore[override]
        before, reset_update, new, hidden_new, w_hh, parents = ctx.saved_tensors
        size = w_hh.shape[1]
        reset, update = reset_update[:, :size], reset_update[:, size:]
        # Local derivatives of all states at once; only the products along the tree have to go level by level.
        to_new = (1 - update) * (1 - new * new)
        to_reset = to_new * hidden_new * reset * (1 - reset)
        to_update = (before - new) * update * (1 - update)
        factors = torch.cat((to_reset, to_update, to_new * reset), 1)
        d_states = grad.clone()
        d_hidden = torch.empty_like(factors)
        for a, b in reversed(list(zip(ctx.offsets[:-1], ctx.offsets[1:], strict=True))):
            d_state = d_states[a + 1 : b + 1]
            d_gates = torch.mul(
                factors[a:b].view(b - a, 3, size),
                d_state.unsqueeze(1),
                out=d_hidden[a:b].view(b - a, 3, size),
            ).view(b - a, 3 * size)
            d_before = torch.addcmul(d_gates @ w_hh, d_state, update[a:b])
            d_states.index_add_(0, parents[a:b], d_before)
        d_inputs = torch.cat((d_hidden[:, : 2 * size], d_states[1:] * to_new), 1)
        return d_inputs, d_hidden.t() @ before, d_hidden.sum(0), d_states[0], None, None


class DialogueEncoder(nn.Module):
    """Embedding and GRU over the words heard so far; the last state stands for the history.

    Source: SocialAI 1.0's language encoder (embedding 128, GRU 128, output at the last word).

    Attributes:
        size: width of the encoding, floats.
    """

    def __init__(self, vocabulary_size: int, size: int = 128) -> None:
        super().__init__()
        self.size = size
        self.embedding = nn.Embedding(vocabulary_size, size)
        self.gru = nn.GRU(size, size)

    def word_inputs(self) -> Tensor:
        """The GRU's input gates of every word of the vocabulary, (V, 3 * size), made once per batch of histories."""
        return functional.linear(self.embedding.weight, self.gru.weight_ih_l0, self.gru.bias_ih_l0)

    def forward(self, tokens: Tensor, parents: Tensor, offsets: Sequence[int]) -> Tensor:
        """Encode the states of a `PrefixTree` (its fields as int64 tensors).

        Returns:
            Encodings (K + 1, size); row 0, the empty history, is zero.
        """
        inputs = functional.embedding(tokens, self.word_inputs())
        root = inputs.new_zeros(self.size)
        states: Tensor = _TreeGru.apply(  # type: ignore[no-untyped-call]
            inputs, self.gru.weight_hh_l0, self.gru.bias_hh_l0, root, parents, offsets
        )
        return states

    @torch.no_grad()
    def extend(self, states: Tensor, tokens: Tensor, lengths: Sequence[int], inputs: Tensor) -> Tensor:
        """Continue encodings by the words heard since, without gradients.

        Args:
            states: (K, size) encodings so far.
            tokens: int64 (K, S), row k's first `lengths[k]` are its new words.
            lengths: new words per row, in descending order.
            inputs: result of `word_inputs` under the current weights.

        Returns:
            (K, size) encodings after the new words.
        """
        states = states.clone()
        size, active = self.size, len(lengths)
        w_t, b_hh = self.gru.weight_hh_l0.t(), self.gru.bias_hh_l0
        for position in range(lengths[0] if lengths else 0):
            while lengths[active - 1] <= position:
                active -= 1
            previous = states[:active]
            given = inputs[tokens[:active, position]]
            hidden = torch.addmm(b_hh, previous, w_t)
            gates = torch.sigmoid(given[:, : 2 * size] + hidden[:, : 2 * size])
            candidate = torch.tanh(
                torch.addcmul(given[:, 2 * size :], gates[:, :size], hidden[:, 2 * size :])
            )
            states[:active] = torch.lerp(candidate, previous, gates[:, size:])
        return states
