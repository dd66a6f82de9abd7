"""The hand-written LSTM agrees with PyTorch's cell, with resets at arbitrary times."""

import pytest
import torch

from trainer.nets.memory import Memory


@pytest.mark.parametrize("reset_rate", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("steps", [1, 7])
def test_agrees_with_the_cell_in_values_and_gradients(reset_rate: float, steps: int) -> None:
    torch.manual_seed(1)
    memory = Memory(5, 4).double()
    inputs = torch.randn(steps, 6, 5, dtype=torch.float64, requires_grad=True)
    before = torch.randn(2, 6, 4, dtype=torch.float64, requires_grad=True)
    starts = torch.rand(steps, 6) < reset_rate
    h, c = before.unbind()
    plain = []
    for t in range(steps):
        keep = (~starts[t]).double()[:, None]
        h, c = memory.cell(inputs[t], (h * keep, c * keep))
        plain.append(h)
    expected, got = torch.stack(plain), memory(inputs, starts, before)
    assert torch.allclose(expected, got, rtol=0, atol=1e-12)
    weights = torch.randn_like(expected)
    wanted = [inputs, before, *memory.parameters()]
    for one, other in zip(
        torch.autograd.grad(expected, wanted, weights), torch.autograd.grad(got, wanted, weights), strict=True
    ):
        assert torch.allclose(one, other, rtol=0, atol=1e-12)


def test_a_step_is_a_sequence_of_one() -> None:
    torch.manual_seed(2)
    memory = Memory(5, 4).double()
    inputs, before = torch.randn(6, 5).double(), torch.randn(2, 6, 4).double()
    output = memory(inputs[None], torch.zeros(1, 6, dtype=torch.bool), before)[0]
    assert torch.allclose(memory.step(inputs, before)[0], output, rtol=0, atol=1e-12)
