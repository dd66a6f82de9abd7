"""This module computes the convolutions of the paper's network in bfloat16 on a CPU, with what lies between them.

It does what `trainer.nets.paper` says in plain PyTorch, in other steps: convolutions by Winograd's method, each with
its bias and rectifier in one pass, modulation and residual connection in another. Images are (N, H, W, C), bfloat16.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from trainer.nets import image_kernels, lanes, tiles, winograd
from trainer.nets.kernels import AVAILABLE
from trainer.nets.winograd import Plan, as_u16


def fits(image_shape: tuple[int, ...], width: int) -> bool:
    """Whether images of these cells and convolutions of this many channels can be computed here."""
    return AVAILABLE and min(image_shape[:2]) > 1 and width % lanes.LANES == 0


class Filters:
    """The matrices of channels of one convolution, made anew when its weights have changed.

    Whether they have is seen from the weights themselves, because fused optimisers leave no other trace of it.
    """

    def __init__(self) -> None:
        self._made: tuple[Plan, NDArray[np.float32], Tensor] | None = None

    def of(self, weight: Tensor, height: int, width: int) -> Tensor:
        """`Plan.filters` as `winograd.convolve` takes them for images of this size."""
        plan, made = Plan.of(height, width), self._made
        if made is None or made[0] is not plan or not np.array_equal(made[1], weight.detach().numpy()):
            filters = plan.filters(weight)
            ready = winograd.packed(filters) if tiles.NATIVE else filters.bfloat16()
            self._made = made = (plan, weight.detach().clone().numpy(), ready)
        return made[2]


def surroundings(images: Tensor) -> Tensor:
    """What a 3 x 3 convolution sees at each cell, in the order of its weights, bfloat16.

    Args:
        images: uint8 (I, H, W, C).

    Returns:
        (J, H, W, 9 * C), where J is I rounded up as a block of `winograd.convolve` is; what is beyond I is 0.
    """
    channels_first = images.permute(0, 3, 1, 2).float()
    columns = functional.unfold(channels_first, 3, padding=1).transpose(1, 2)
    seen = columns.bfloat16().view(*images.shape[:3], -1)
    return functional.pad(seen, (0, 0) * 3 + (0, winograd.roomy(len(seen)) - len(seen)))


class FirstConvolution(torch.autograd.Function):
    """The first convolution and a rectifier, given `surroundings`, weights and bias.

    It is computed by blocks, because the products of every number of images that ever occurs are compiled and kept.
    """

    @staticmethod
    def forward(ctx: Any, seen: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
        """What is seen, (J, H, W, 9 * C), to images (J, H, W, D)."""
        outputs = seen.new_empty(*seen.shape[:3], len(weight))
        matrix, offset = weight.flatten(1).bfloat16().t(), bias.bfloat16()
        for given, made in zip(_rows(seen), _rows(outputs), strict=True):
            torch.addmm(offset, given, matrix, out=made).relu_()
        ctx.save_for_backward(seen, outputs)
        ctx.shape = weight.shape
        return outputs

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients for what `forward` takes; none for what is seen."""
        seen, outputs = ctx.saved_tensors
        d_weight, d_bias = torch.zeros(grad.shape[3], seen.shape[3]), torch.zeros(grad.shape[3])
        for given, made, slopes in zip(_rows(seen), _rows(outputs), _rows(grad.contiguous()), strict=True):
            passed = torch.ops.aten.threshold_backward(slopes, made, 0)
            d_weight += passed.t() @ given
            d_bias += passed.sum(0, dtype=torch.float32)
        return None, d_weight.view(ctx.shape), d_bias


def _rows(images: Tensor) -> list[Tensor]:
    """The cells of images, (N * H * W, C), by blocks of images."""
    return [block.flatten(0, 2) for block in torch.split(images, winograd.BLOCK)]


class Convolution(torch.autograd.Function):
    """A convolution and a rectifier, given images, weights, bias and the weights' `Filters`."""

    @staticmethod
    def forward(ctx: Any, images: Tensor, weight: Tensor, bias: Tensor, filters: Tensor) -> Tensor:
        """Images (N, H, W, C) to (N, H, W, D)."""
        outputs = winograd.convolve(images, filters, bias, rectified=True)
        ctx.save_for_backward(images, filters, outputs)
        return outputs

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients for what `forward` takes."""
        images, filters, outputs = ctx.saved_tensors
        return *winograd.convolve_backward(grad.contiguous(), images, filters, outputs), None


class FilmBlock(torch.autograd.Function):
    """Two convolutions, a rectifier between them, modulation, a rectifier and the residual connection.

    Takes images, weights and biases of the convolutions, the tables of scales and shifts, float32 (D, C), the row of
    them that is each image's, int64 (N,), and the convolutions' `Filters`.
    """

    @staticmethod
    def forward(
        ctx: Any,
        images: Tensor,
        weight1: Tensor,
        bias1: Tensor,
        weight2: Tensor,
        bias2: Tensor,
        scale: Tensor,
        shift: Tensor,
        text_index: Tensor,
        filters1: Tensor,
        filters2: Tensor,
    ) -> Tensor:
        """Images (N, H, W, C) to as many of that size."""
        between = winograd.convolve(images, filters1, bias1, rectified=True)
        hidden = winograd.convolve(between, filters2, bias2, rectified=False)
        outputs = torch.empty_like(images)
        tables = scale.detach().numpy(), shift.detach().numpy(), text_index.numpy()
        image_kernels.modulate(as_u16(hidden), *tables, as_u16(images), as_u16(outputs))
        ctx.save_for_backward(images, between, hidden, scale, shift, text_index, filters1, filters2)
        return outputs

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients for what `forward` takes."""
        images, between, hidden, scale, shift, text_index, filters1, filters2 = ctx.saved_tensors
        grad = grad.contiguous()
        d_hidden, d_scale, d_shift = (
            torch.empty_like(hidden),
            torch.zeros_like(scale),
            torch.zeros_like(shift),
        )
        tables = scale.numpy(), shift.numpy(), text_index.numpy()
        image_kernels.modulate_backward(
            as_u16(grad), as_u16(hidden), *tables, as_u16(d_hidden), d_scale.numpy(), d_shift.numpy()
        )
        d_between, d_weight2, d_bias2 = winograd.convolve_backward(d_hidden, between, filters2)
        d_images, d_weight1, d_bias1 = winograd.convolve_backward(
            d_between, images, filters1, outputs=between, added=grad
        )
        return d_images, d_weight1, d_bias1, d_weight2, d_bias2, d_scale, d_shift, None, None, None


class Chosen(torch.autograd.Function):
    """Images by their numbers, int64 (P,); the gradients of one chosen often are added up in float32."""

    @staticmethod
    def forward(ctx: Any, images: Tensor, index: Tensor) -> Tensor:
        """Images (I, H, W, C) to (P, H, W, C)."""
        ctx.save_for_backward(index)
        ctx.shape = images.shape
        return images.index_select(0, index)

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients for what `forward` takes."""
        (index,) = ctx.saved_tensors
        total = torch.zeros(ctx.shape)
        image_kernels.add_up(as_u16(grad.contiguous()), index.numpy(), total.numpy())
        return total.bfloat16(), None


class Peaks(torch.autograd.Function):
    """Max pooling over whole images: of cells that are equal the first has the gradient."""

    @staticmethod
    def forward(ctx: Any, images: Tensor) -> Tensor:
        """Images (N, H, W, C) to float32 (N, C)."""
        values = torch.empty(len(images), images.shape[3])
        cells = np.empty(values.shape, np.uint16)
        image_kernels.peaks(as_u16(images), values.numpy(), cells)
        ctx.cells, ctx.shape = cells, images.shape
        return values

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> Tensor:
        """Gradient for the images."""
        images = torch.empty(ctx.shape, dtype=torch.bfloat16)
        image_kernels.peaks_backward(grad.contiguous().numpy(), ctx.cells, as_u16(images))
        return images
