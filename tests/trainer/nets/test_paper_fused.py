"""The parts of the paper's network that are computed in other steps, against PyTorch's own."""

import torch
from torch.nn import functional

from trainer.nets import paper_fused as fused
from trainer.nets.winograd import BLOCK

WIDTH = 128


def drawn(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def test_peaks_are_those_of_max_pooling_and_of_equal_cells_the_first_has_the_gradient() -> None:
    images = torch.relu(drawn(5, 3, 4, WIDTH).round()).bfloat16()  # few values, so that many cells are equal
    images[0, 1, 1, 7] = torch.nan
    grad = drawn(5, WIDTH, seed=1).bfloat16().float()
    ours, theirs = images.clone().requires_grad_(), images.float().requires_grad_()
    got = fused.Peaks.apply(ours)
    expected = functional.max_pool2d(theirs.permute(0, 3, 1, 2), (3, 4)).flatten(1)
    torch.testing.assert_close(got, expected, rtol=0, atol=0, equal_nan=True)
    got.backward(grad)
    expected.backward(grad)
    assert ours.grad is not None
    assert torch.equal(ours.grad.float(), theirs.grad)


def test_the_first_convolution_is_pytorchs() -> None:
    """Over more than one block of images, some of which are only room."""
    count = BLOCK + 3
    seen_images = torch.randint(0, 12, (count, 5, 4, 3), generator=torch.Generator().manual_seed(0)).byte()
    weight = (drawn(WIDTH, 3, 3, 3) / 5).bfloat16().float().requires_grad_()
    bias = drawn(WIDTH, seed=1).bfloat16().float().requires_grad_()
    grad = drawn(count, 5, 4, WIDTH, seed=2).bfloat16()
    got = fused.FirstConvolution.apply(fused.surroundings(seen_images.contiguous()), weight, bias)[:count]
    inputs = seen_images.permute(0, 3, 1, 2).float()
    expected = torch.relu(functional.conv2d(inputs, weight, bias, padding=1)).permute(0, 2, 3, 1)
    torch.testing.assert_close(got.float(), expected, rtol=0.01, atol=0.01)
    ours = torch.autograd.grad(got, (weight, bias), grad)
    theirs = torch.autograd.grad(expected, (weight, bias), grad.float())
    for mine, other in zip(ours, theirs, strict=True):
        assert float((mine - other).norm() / other.norm()) < 0.01
