"""The LSTM's written-out passes agree with one step after the other, with resets at arbitrary times."""

import pytest
import torch

from socialai_dsl.trainer.nets.memory import LstmMemory, Memory, emptied


@pytest.mark.parametrize("reset_rate", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("steps", [1, 7])
def test_agrees_with_single_steps_in_values_and_gradients(reset_rate: float, steps: int) -> None:
    torch.manual_seed(1)
    memory = LstmMemory(5, 4).double()
    inputs = torch.randn(steps, 6, 5, dtype=torch.float64, requires_grad=True)
    before = torch.randn(6, 2, 4, dtype=torch.float64, requires_grad=True)
    starts = torch.rand(steps, 6) < reset_rate
    expected, got = Memory.forward(memory, inputs, starts, before), memory(inputs, starts, before)
    assert torch.allclose(expected, got, rtol=0, atol=1e-12)
    weights = torch.randn_like(expected)
    wanted = [inputs, before, *memory.parameters()]
    for one, other in zip(
        torch.autograd.grad(expected, wanted, weights), torch.autograd.grad(got, wanted, weights), strict=True
    ):
        assert torch.allclose(one, other, rtol=0, atol=1e-12)


def test_a_step_is_that_of_pytorch_s_cell() -> None:
    torch.manual_seed(2)
    memory = LstmMemory(5, 4).double()
    inputs, before = torch.randn(6, 5).double(), torch.randn(6, 2, 4).double()
    output, after = memory.step(inputs, before)
    h, c = memory.cell(inputs, (before[:, 0], before[:, 1]))
    assert torch.equal(output, h)
    assert torch.equal(after, torch.stack((h, c), 1))


def test_a_memory_is_emptied_where_an_episode_starts() -> None:
    memory = torch.ones(3, 2, 4)
    got = emptied(memory, torch.tensor([True, False, True]))
    assert got.sum((1, 2)).tolist() == [0, 8, 0]
