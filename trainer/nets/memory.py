"""Memories of a network, carried from step to step and emptied at the start of an episode."""

from __future__ import annotations

from abc import ABC, abstractmethod
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
        w_t = w_hh.t()
        h, c = memory.unbind()
        for t, (gate, cell, squash, output) in enumerate(zip(gates, cells, squashed, outputs, strict=True)):
            if resets[t]:
                h, c = h * keep[t], c * keep[t]
            gate.addmm_(h, w_t)
            candidate, entry, forget, exit_ = torch.split(gate, size, 1)
            candidate.tanh_()
            gate[:, size:].sigmoid_()
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
        reaches = ((entry, candidate), (candidate, entry), (c_in, forget), (squashed, exit_))
        for part, (reach, gate) in zip(torch.split(slopes, size, 2), reaches, strict=True):
            rule = aten.tanh_backward if gate is candidate else aten.sigmoid_backward
            rule.grad_input(reach, gate, grad_input=part)
        to_cell = aten.tanh_backward(exit_, squashed)

        d_gates = slopes  # each step's slopes are replaced by its gradients
        d_c, d_h, nothing = torch.zeros_like(cells[0]), grad[-1], torch.zeros_like(grad[0])
        for t in range(steps - 1, -1, -1):
            d_gate, before = d_gates[t], grad[t - 1] if t else nothing
            d_c.addcmul_(d_h, to_cell[t])
            d_gate.view(batch, 4, size)[:, :3].mul_(d_c[:, None])
            d_gate[:, 3 * size :].mul_(d_h)
            d_c.mul_(forget[t])
            if ctx.resets[t]:
                d_c.mul_(keep[t])
                d_h = torch.mm(d_gate, w_hh).mul_(keep[t]).add_(before)
            else:
                d_h = torch.addmm(before, d_gate, w_hh)
        flat = d_gates.view(-1, 4 * size)
        flat_t = flat.t()
        d_inputs = (flat @ w_ih).view_as(inputs)
        d_w_ih = flat_t @ inputs.flatten(0, 1)
        d_w_hh = flat_t @ h_in.view(-1, size)
        return d_inputs, d_w_ih, d_w_hh, flat.sum(0), torch.stack((d_h, d_c)), None, None


class Memory(nn.Module, ABC):
    """The state of a network from step to step: a float32 tensor (E, *shape), all zeros where an episode starts.

    A subclass says how one step changes it. Back-propagation through time follows from that; `forward` may be
    overridden by something faster.

    Attributes:
        shape: of one environment's memory.
        size: width of the output.
    """

    def __init__(self, shape: tuple[int, ...], size: int) -> None:
        super().__init__()
        self.shape, self.size = shape, size

    def initial(self, batch: int) -> Tensor:
        """The empty memory, zeros (batch, *shape)."""
        return next(self.parameters()).new_zeros(batch, *self.shape)

    @abstractmethod
    def step(self, inputs: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """One step: inputs (E, F) and memory (E, *shape) to the output (E, size) and the new memory."""

    def forward(self, inputs: Tensor, starts: Tensor, memory: Tensor) -> Tensor:
        """Outputs over time, differentiable.

        Args:
            inputs: (T, B, F).
            starts: bool (T, B), whether an episode starts with this step.
            memory: (B, *shape) before the first step.

        Returns:
            (T, B, size).
        """
        outputs = []
        for now, start in zip(inputs, starts, strict=True):
            output, memory = self.step(now, emptied(memory, start))
            outputs.append(output)
        return torch.stack(outputs)


def emptied(memory: Tensor, starts: Tensor) -> Tensor:
    """The memory (E, *shape) with zeros where `starts`, bool (E,)."""
    return memory.masked_fill(starts.view(-1, *(1,) * (memory.dim() - 1)), 0)


class LstmMemory(Memory):
    """An LSTM (Hochreiter and Schmidhuber 1997); the memory is h and c, (E, 2, size), the output h.

    Its passes over a rollout are written out, which makes training a fifth faster than `Memory.forward`. PyTorch's LSTM
    over packed episodes has the same outputs, but its backward pass takes more than twice as long.
    """

    def __init__(self, inputs: int, size: int = 128) -> None:
        super().__init__((2, size), size)
        self.cell = nn.LSTMCell(inputs, size)

    def step(self, inputs: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """See `Memory.step`."""
        h, c = self.cell(inputs, tuple(memory.unbind(1)))
        return h, torch.stack((h, c), 1)

    def forward(self, inputs: Tensor, starts: Tensor, memory: Tensor) -> Tensor:
        """See `Memory.forward`."""
        cell = self.cell
        outputs: Tensor = _ResettableLstm.apply(  # type: ignore[no-untyped-call]
            inputs,
            _reordered(cell.weight_ih),
            _reordered(cell.weight_hh),
            _reordered(cell.bias_ih + cell.bias_hh),
            memory.transpose(0, 1).contiguous(),
            (~starts).to(inputs.dtype).unsqueeze(2),
            starts.any(1).tolist(),
        )
        return outputs


def _reordered(weight: Tensor) -> Tensor:
    """Rows in PyTorch's order of gates (input, forget, cell, output) in that of `_ResettableLstm`."""
    entry, forget, candidate, exit_ = weight.chunk(4)
    return torch.cat((candidate, entry, forget, exit_))
