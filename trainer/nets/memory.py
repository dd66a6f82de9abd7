"""This module runs an LSTM over rollouts whose environments start new episodes at different times."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional


class _ResettableLstm(torch.autograd.Function):
    """LSTM over time with zeroed memory at episode starts, with back-propagation through time written out.

    One product per step in each direction; the weights' gradient is a single product at the end. Gates are ordered
    input, forget, output, cell, so that the three sigmoids are one call.
    """

    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any, inputs: Tensor, w_hh: Tensor, h0: Tensor, c0: Tensor, keep: Tensor, resets: list[bool]
    ) -> tuple[Tensor, Tensor]:
        steps, batch, size = inputs.shape[0], inputs.shape[1], w_hh.shape[1]
        gates = inputs.new_empty(steps, batch, 4 * size)
        h_in = inputs.new_empty(steps, batch, size)
        c_in = inputs.new_empty(steps, batch, size)
        squashed = inputs.new_empty(steps, batch, size)
        outputs = inputs.new_empty(steps, batch, size)
        w_t, h, c = w_hh.t(), h0, c0
        for t in range(steps):
            if resets[t]:
                h, c = torch.mul(h, keep[t], out=h_in[t]), torch.mul(c, keep[t], out=c_in[t])
            else:
                h, c = h_in[t].copy_(h), c_in[t].copy_(c)
            gate = torch.addmm(inputs[t], h, w_t, out=gates[t])
            gate[:, : 3 * size].sigmoid_()
            gate[:, 3 * size :].tanh_()
            c = torch.addcmul(gate[:, :size] * gate[:, 3 * size :], gate[:, size : 2 * size], c)
            torch.tanh(c, out=squashed[t])
            h = torch.mul(gate[:, 2 * size : 3 * size], squashed[t], out=outputs[t])
        ctx.save_for_backward(gates, h_in, c_in, squashed, w_hh, keep)
        ctx.resets = resets
        ctx.mark_non_differentiable(c)
        return outputs, c

    @staticmethod
    def backward(ctx: Any, grad: Tensor, _: Tensor) -> tuple[Tensor | None, ...]:  # type: ignore[override]
        gates, h_in, c_in, squashed, w_hh, keep = ctx.saved_tensors
        steps, batch, size = h_in.shape
        sigmoids = gates[..., : 3 * size]
        entry, forget, exit_, cell = gates.split(size, dim=2)
        # Local derivatives of all steps at once: from the cell (entry, forget, cell gates) and the output gate.
        slope = torch.empty_like(gates)
        torch.mul(sigmoids, 1 - sigmoids, out=slope[..., : 3 * size])
        slope[..., :size] *= cell
        slope[..., size : 2 * size] *= c_in
        slope[..., 2 * size : 3 * size] *= squashed
        torch.mul(entry, 1 - cell * cell, out=slope[..., 3 * size :])
        to_cell = exit_ * (1 - squashed * squashed)

        d_gates = torch.empty_like(gates)
        d_c = torch.zeros_like(h_in[0])
        d_h = grad[steps - 1]
        for t in range(steps - 1, -1, -1):
            d_c = torch.addcmul(d_c, d_h, to_cell[t])
            d_gate = d_gates[t]
            torch.mul(
                slope[t, :, : 2 * size].view(batch, 2, size),
                d_c.unsqueeze(1),
                out=d_gate[:, : 2 * size].view(batch, 2, size),
            )
            torch.mul(slope[t, :, 2 * size : 3 * size], d_h, out=d_gate[:, 2 * size : 3 * size])
            torch.mul(slope[t, :, 3 * size :], d_c, out=d_gate[:, 3 * size :])
            d_c = d_c * forget[t]
            d_h = d_gate @ w_hh
            if ctx.resets[t]:
                d_c *= keep[t]
                d_h *= keep[t]
            if t:
                d_h += grad[t - 1]
        d_w = d_gates.view(-1, 4 * size).t() @ h_in.view(-1, size)
        return d_gates, d_w, d_h, d_c, None, None


class Memory(nn.Module):
    """An LSTM whose memory (h, c) is emptied whenever an episode starts.

    Attributes:
        size: width of h and of c, floats.
    """

    def __init__(self, input_size: int, size: int = 128) -> None:
        super().__init__()
        self.size = size
        self.cell = nn.LSTMCell(input_size, size)

    def initial(self, batch: int) -> Tensor:
        """The empty memory, zeros (2, batch, size): h and c."""
        return self.cell.weight_hh.new_zeros(2, batch, self.size)

    def step(self, inputs: Tensor, memory: Tensor) -> Tensor:
        """One step for acting: (E, input_size) and memory (2, E, size) to the new memory, whose row 0 is the output."""
        return torch.stack(self.cell(inputs, (memory[0], memory[1])))

    def forward(self, inputs: Tensor, starts: Tensor, memory: Tensor) -> Tensor:
        """Outputs over time, differentiable.

        Args:
            inputs: (T, B, input_size).
            starts: bool (T, B), whether an episode starts with this step.
            memory: (2, B, size) before the first step.

        Returns:
            (T, B, size).
        """
        steps, batch, _ = inputs.shape
        w_ih, w_hh = self._reordered(self.cell.weight_ih), self._reordered(self.cell.weight_hh)
        bias = self._reordered(self.cell.bias_ih + self.cell.bias_hh)
        gates = functional.linear(inputs.flatten(0, 1), w_ih, bias).view(steps, batch, -1)
        keep = (~starts).to(inputs.dtype).unsqueeze(2)
        outputs: Tensor = _ResettableLstm.apply(  # type: ignore[no-untyped-call]
            gates, w_hh, memory[0], memory[1], keep, starts.any(1).tolist()
        )[0]
        return outputs

    def _reordered(self, weight: Tensor) -> Tensor:
        """PyTorch's gates (input, forget, cell, output) in the order of `_ResettableLstm`."""
        entry, forget, cell, exit_ = weight.chunk(4)
        return torch.cat((entry, forget, exit_, cell))
