"""This module runs an LSTM over rollouts whose environments start new episodes at different times."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional


class _ResettableLstm(torch.autograd.Function):
    """LSTM over time with zeroed memory at episode starts, with back-propagation through time written out.

    One product per step in each direction; the weights' gradients are single products at the end. Gates are ordered
    cell, input, forget, output: the three sigmoids are neighbours, and so are the three gates the cell's gradient
    reaches.
    """

    @staticmethod
    def forward(
        ctx: Any,
        inputs: Tensor,
        w_ih: Tensor,
        w_hh: Tensor,
        bias: Tensor,
        memory: Tensor,
        keep: Tensor,
        resets: list[bool],
    ) -> Tensor:
        steps, batch, size = inputs.shape[0], inputs.shape[1], w_hh.shape[1]
        gates = functional.linear(inputs.flatten(0, 1), w_ih, bias).view(steps, batch, 4 * size)
        cells, squashed, outputs = (inputs.new_empty(steps, batch, size) for _ in range(3))
        rows = zip(
            gates.unbind(),
            gates[..., size:].unbind(),
            *(gate.unbind() for gate in torch.split(gates, size, 2)),
            cells.unbind(),
            squashed.unbind(),
            outputs.unbind(),
            strict=True,
        )
        w_t = w_hh.t()
        h, c = memory.unbind()
        for t, (gate, sigmoids, candidate, entry, forget, exit_, cell, squash, output) in enumerate(rows):
            if resets[t]:
                h, c = h * keep[t], c * keep[t]
            gate.addmm_(h, w_t)
            sigmoids.sigmoid_()
            candidate.tanh_()
            torch.mul(entry, candidate, out=cell).addcmul_(forget, c)
            torch.tanh(cell, out=squash)
            torch.mul(exit_, squash, out=output)
            h, c = output, cell
        ctx.save_for_backward(inputs, w_ih, w_hh, memory, keep, gates, cells, squashed, outputs)
        ctx.resets = resets
        return outputs

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        inputs, w_ih, w_hh, memory, keep, gates, cells, squashed, outputs = ctx.saved_tensors
        steps, batch, size = outputs.shape
        h_in = torch.cat((memory[:1], outputs[:-1])).mul_(keep)
        c_in = torch.cat((memory[1:], cells[:-1])).mul_(keep)
        candidate, entry, forget, exit_ = torch.split(gates, size, 2)
        # What each gate's input does to the cell (output gate: to h), for all steps at once.
        slopes = torch.empty_like(gates)
        aten = torch.ops.aten
        for part, (reach, gate) in zip(
            torch.split(slopes, size, 2),
            ((entry, candidate), (candidate, entry), (c_in, forget), (squashed, exit_)),
            strict=True,
        ):
            rule = aten.tanh_backward if gate is candidate else aten.sigmoid_backward
            rule.grad_input(reach, gate, grad_input=part)
        to_cell = aten.tanh_backward(exit_, squashed)

        d_gates = slopes  # each step's slopes are replaced by its gradients
        rows = list(
            zip(
                d_gates.unbind(),
                d_gates.view(steps, batch, 4, size)[:, :, :3].unbind(),
                d_gates[..., 3 * size :].unbind(),
                forget.unbind(),
                to_cell.unbind(),
                grad.unbind(),
                strict=True,
            )
        )
        d_c, d_h = torch.zeros_like(cells[0]), rows[-1][-1]
        d_c_row = d_c.unsqueeze(1)
        for t in range(steps - 1, -1, -1):
            d_gate, reached, last, forgotten, slope, _ = rows[t]
            d_c.addcmul_(d_h, slope)
            reached.mul_(d_c_row)
            last.mul_(d_h)
            d_c.mul_(forgotten)
            before = rows[t - 1][-1] if t else None
            if before is not None and not ctx.resets[t]:
                d_h = torch.addmm(before, d_gate, w_hh)
                continue
            d_h = torch.mm(d_gate, w_hh)
            if ctx.resets[t]:
                d_c.mul_(keep[t])
                d_h.mul_(keep[t])
            if before is not None:
                d_h.add_(before)
        flat = d_gates.view(-1, 4 * size)
        flat_t = flat.t()
        d_inputs = (flat @ w_ih).view_as(inputs)
        d_w_ih = flat_t @ inputs.flatten(0, 1)
        d_w_hh = flat_t @ h_in.view(-1, size)
        return d_inputs, d_w_ih, d_w_hh, flat.sum(0), torch.stack((d_h, d_c)), None, None


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
        cell = self.cell
        outputs: Tensor = _ResettableLstm.apply(  # type: ignore[no-untyped-call]
            inputs,
            _reordered(cell.weight_ih),
            _reordered(cell.weight_hh),
            _reordered(cell.bias_ih + cell.bias_hh),
            memory,
            (~starts).to(inputs.dtype).unsqueeze(2),
            starts.any(1).tolist(),
        )
        return outputs


def _reordered(weight: Tensor) -> Tensor:
    """Rows in PyTorch's order of gates (input, forget, cell, output) in that of `_ResettableLstm`."""
    entry, forget, candidate, exit_ = weight.chunk(4)
    return torch.cat((candidate, entry, forget, exit_))
