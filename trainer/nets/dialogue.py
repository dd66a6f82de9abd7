"""This module encodes dialogue histories with a GRU that visits every distinct prefix of them once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
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
    def forward(
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
        before, new = root.new_empty(count, size), root.new_empty(count, size)
        hidden, gates = root.new_empty(count, 3 * size), root.new_empty(count, 2 * size)
        sizes = [b - a for a, b in pairwise(offsets)]
        rows = zip(
            *(torch.split(array, sizes) for array in (parents, before, hidden, hidden[:, : 2 * size])),
            *(
                torch.split(array, sizes)
                for array in (inputs[:, : 2 * size], gates, gates[:, :size], gates[:, size:])
            ),
            *(
                torch.split(array, sizes)
                for array in (inputs[:, 2 * size :], hidden[:, 2 * size :], new, states[1:])
            ),
            strict=True,
        )
        w_t = w_hh.t()
        for (
            parent,
            previous,
            hid,
            hid_gates,
            in_gates,
            gate,
            reset,
            update,
            in_new,
            hid_new,
            cand,
            state,
        ) in rows:
            torch.index_select(states, 0, parent, out=previous)
            torch.addmm(b_hh, previous, w_t, out=hid)
            torch.add(in_gates, hid_gates, out=gate).sigmoid_()
            torch.addcmul(in_new, reset, hid_new, out=cand).tanh_()
            torch.lerp(cand, previous, update, out=state)
        ctx.save_for_backward(before, gates, new, hidden, w_hh, parents)
        ctx.sizes = sizes
        return states

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        before, gates, new, hidden, w_hh, parents = ctx.saved_tensors
        size = w_hh.shape[1]
        reset, update = torch.split(gates, size, 1)
        aten = torch.ops.aten
        # Local derivatives of all states at once; only the products along the tree have to go level by level.
        to_new = aten.tanh_backward(1 - update, new)
        d_hidden = torch.cat(
            (
                aten.sigmoid_backward(to_new * hidden[:, 2 * size :], reset),
                aten.sigmoid_backward(before - new, update),
                to_new * reset,
            ),
            1,
        )
        d_states = grad.clone()
        rows = zip(
            *(torch.split(array, ctx.sizes) for array in (d_hidden, d_hidden.view(-1, 3, size), update)),
            *(torch.split(array, ctx.sizes) for array in (parents, d_states[1:], d_states[1:].unsqueeze(1))),
            strict=True,
        )
        for d_gates, factors, kept, parent, d_state, d_state_row in reversed(list(rows)):
            factors.mul_(d_state_row)
            d_states.index_add_(0, parent, torch.addmm(d_state * kept, d_gates, w_hh))
        d_inputs = torch.cat((d_hidden[:, : 2 * size], d_states[1:] * to_new), 1)
        return d_inputs, d_hidden.t() @ before, d_hidden.sum(0), d_states[0], None, None


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

    def forward(self, tokens: Tensor, parents: Tensor, offsets: Sequence[int]) -> Tensor:
        """Encode the states of a `PrefixTree` (its fields as int64 tensors).

        Returns:
            Encodings (K + 1, size); row 0, the empty history, is zero.
        """
        inputs = functional.embedding(tokens, self.word_inputs())
        root = inputs.new_zeros(self.hidden)
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
        size, active = self.hidden, len(lengths)
        w_t, b_hh = self.gru.get_parameter("weight_hh_l0").t(), self.gru.get_parameter("bias_hh_l0")
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
