"""Winograd's method computes what a plain convolution computes, in values and gradients, and the loops what it says."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.nn import functional

from trainer.nets import tiles, winograd
from trainer.nets.winograd import Axis, Plan

WIDTH = 128
SIZES = [(7, 7), (2, 3), (6, 5)]


@pytest.fixture(params=["by a library", "by tiles"])
def ready(request: pytest.FixtureRequest) -> Callable[[Tensor], Tensor]:
    """Filters as they are taken by each of the two ways to multiply."""
    if request.param == "by a library":
        return Tensor.bfloat16
    if not tiles.NATIVE:
        pytest.skip("this processor has no dot products of bfloat16")
    return winograd.packed


def drawn(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def plain(images: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """A convolution of images with the channels last."""
    return functional.conv2d(images.permute(0, 3, 1, 2), weight, bias, padding=1).permute(0, 2, 3, 1)


def distance(got: Tensor, expected: Tensor) -> float:
    return float((got.double() - expected).norm() / expected.norm())


@pytest.mark.parametrize("length", range(2, 10))
def test_the_matrices_of_an_axis_convolve_exactly(length: int) -> None:
    axis, images, taps = Axis.of(length), drawn(length), drawn(3, seed=1)
    order = [sum(many for many, _ in axis.groups[:group]) + kernel for group, kernel, _, _ in axis.products()]
    products = (axis.kernels @ taps.numpy())[order] * (axis.inputs @ images.numpy())
    expected = functional.conv1d(images.view(1, 1, -1), taps.view(1, 1, -1), padding=1).view(-1)
    np.testing.assert_allclose(axis.outputs.T @ products, expected.numpy(), rtol=0, atol=1e-13)


def test_seven_cells_take_fourteen_products_and_an_image_196() -> None:
    assert len(list(Axis.of(7).products())) == 14
    assert Plan.of(7, 7).positions == 196


def test_gradients_for_the_matrices_of_channels_become_those_for_the_weights() -> None:
    plan, weight = Plan.of(7, 6), drawn(3, 2, 3, 3).requires_grad_()
    slopes = drawn(len(plan.kernels), 2, 3, seed=1)
    taps = weight.permute(2, 3, 1, 0).reshape(9, -1)
    filters = (plan.kernels.double() @ taps).view_as(slopes)
    assert torch.equal(plan.filters(weight), filters.detach())
    (expected,) = torch.autograd.grad(filters, weight, slopes)
    assert torch.allclose(plan.weight_grad(slopes), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("rectified", [False, True])
def test_values_and_gradients_are_those_of_a_convolution_but_for_rounding(
    size: tuple[int, int], rectified: bool, ready: Callable[[Tensor], Tensor]
) -> None:
    count = 67  # more than a block, and odd
    weight, bias = (drawn(WIDTH, WIDTH, 3, 3, seed=2) / 34).float(), drawn(WIDTH, seed=3).float()
    # Sums far from 0, so that a rectifier lets the same ones through.
    bias = torch.where(bias > 0, bias + 8, bias - 8)
    images, slopes = drawn(count, *size, WIDTH).bfloat16(), drawn(count, *size, WIDTH, seed=1).bfloat16()
    filters = ready(Plan.of(*size).filters(weight))
    outputs = winograd.convolve(images, filters, bias, rectified)
    got = winograd.convolve_backward(slopes, images, filters, outputs if rectified else None, added=slopes)

    inputs = [value.double().requires_grad_() for value in (images, weight, bias)]
    exact = plain(*inputs)
    exact = torch.relu(exact) if rectified else exact
    expected = list(torch.autograd.grad(exact, inputs, slopes.double()))
    expected[0] = expected[0] + slopes.double()
    # bfloat16 keeps 8 bits: one rounding is 0.2 %, and there are three on the way.
    assert distance(outputs, exact.detach()) < 0.006
    assert [distance(*pair) < 0.008 for pair in zip(got, expected, strict=True)] == [True] * 3


def test_what_an_image_becomes_does_not_depend_on_the_others(ready: Callable[[Tensor], Tensor]) -> None:
    images = drawn(70, 7, 7, WIDTH).bfloat16()
    filters = ready(Plan.of(7, 7).filters(drawn(WIDTH, WIDTH, 3, 3, seed=1).float()))
    together = winograd.convolve(images, filters, torch.zeros(WIDTH), rectified=False)
    alone = winograd.convolve(images[66:67], filters, torch.zeros(WIDTH), rectified=False)
    assert torch.equal(together[66:67], alone)


def test_a_number_that_is_none_is_not_lost(ready: Callable[[Tensor], Tensor]) -> None:
    images = drawn(2, 3, 3, WIDTH).bfloat16()
    images[1, 1, 1, 0] = torch.nan
    filters = ready(Plan.of(3, 3).filters(drawn(WIDTH, WIDTH, 3, 3, seed=1).float()))
    outputs = winograd.convolve(images, filters, torch.zeros(WIDTH), rectified=True)
    assert torch.isfinite(outputs[0]).all()
    assert torch.isnan(outputs[1, 1, 1]).all()


@pytest.mark.skipif(not tiles.NATIVE, reason="this processor has no dot products of bfloat16")
@pytest.mark.parametrize("width", [WIDTH, 2 * WIDTH])
def test_images_of_every_number_and_width_are_convolved_alike_both_ways(width: int) -> None:
    """Tiles end behind the rows of a filter, and behind the last row, unless their number happens to fit."""
    weight, bias = (drawn(width, width, 3, 3, seed=2) / 34).float(), drawn(width, seed=3).float()
    filters = Plan.of(3, 5).filters(weight)
    for count in range(1, 20):
        images, slopes = drawn(count, 3, 5, width).bfloat16(), drawn(count, 3, 5, width, seed=1).bfloat16()
        ways = []
        for taken in (filters.bfloat16(), winograd.packed(filters)):
            outputs = winograd.convolve(images, taken, bias, rectified=False)
            ways.append((outputs, *winograd.convolve_backward(slopes, images, taken)))
        # The library rounds its sums for the weights to bfloat16 after each block, the tiles keep them in float32.
        for library, own in zip(*ways, strict=True):
            assert distance(own, library.double()) < 0.004, count


def test_packed_filters_are_those_of_the_matrices_and_of_them_transposed() -> None:
    filters = drawn(2, WIDTH, WIDTH).float()
    packed = winograd.packed(filters)
    assert torch.equal(packed[0].transpose(2, 3).flatten(1, 2), filters.bfloat16())
    assert torch.equal(packed[1].transpose(2, 3).flatten(1, 2), filters.bfloat16().transpose(1, 2))
