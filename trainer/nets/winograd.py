"""This module convolves small images by Winograd's method: fewer multiplications, exact but for rounding.

Along one axis of length L a convolution with three taps and zeros at the borders is `y = A^T ((G w) * (B^T x))`, with
one multiplication for each row of G w: four instead of six for every two outputs (Winograd 1980; F(2, 3) in Lavin and
Gray 2016), two for the last of an odd number. Along both axes the same is done twice, and each multiplication of
numbers becomes one of matrices of channels: 196 for an image of 7 x 7 cells, where nine taps for 49 cells make 441.
All coefficients are 0, 1, -1 and one half, so that bfloat16 loses little; larger tiles would take 121 and lose four
times as much. The gradients are those of the same three steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer.nets import winograd_kernels as kernels
from trainer.nets.image_kernels import add_up
from trainer.nets.winograd_kernels import Layout, Tables

_TILE_KERNEL: Final = ((1, 0, 0), (0.5, 0.5, 0.5), (0.5, -0.5, 0.5), (0, 0, 1))
_TILE_INPUT: Final = ((1, 0, -1, 0), (0, 1, 1, 0), (0, -1, 1, 0), (0, 1, 0, -1))
_TILE_OUTPUT: Final = ((1, 0), (1, 1), (1, -1), (0, -1))
_LAST_KERNEL: Final = ((1, 0, 0), (0, 1, 0))

BLOCK: Final = 64
"""Images convolved together where a library multiplies: few calls, and products that hardly leave the cache."""

_OWN_BLOCK: Final = 16
"""Images convolved together where this package does: their products stay in the cache next to the core."""


@dataclass(frozen=True)
class Axis:
    """The three matrices of one axis of length L, with P products.

    Products come in groups: in a group of S kernels and M places, product `s * M + m` is that of kernel s at place m.

    Attributes:
        inputs: B^T, float32 (P, L).
        outputs: A, float32 (P, L).
        kernels: the distinct rows of G, float32 (S, 3), all groups' one after the other.
        groups: S and M of each group.
    """

    inputs: NDArray[np.float32]
    outputs: NDArray[np.float32]
    kernels: NDArray[np.float32]
    groups: tuple[tuple[int, int], ...]

    @classmethod
    @cache
    def of(cls, length: int) -> Axis:
        """The matrices of an axis of at least two cells."""
        tiles = length // 2
        padded = np.zeros((4 * tiles + 2, length + 3), np.float32)  # a border cell before, up to two behind
        outputs = np.zeros((4 * tiles + 2, length + 1), np.float32)
        for tile in range(tiles):
            padded[tile : 4 * tiles : tiles, 2 * tile : 2 * tile + 4] = _TILE_INPUT
            outputs[tile : 4 * tiles : tiles, 2 * tile : 2 * tile + 2] = _TILE_OUTPUT
        groups: tuple[tuple[int, int], ...] = ((4, tiles),)
        kernel_rows: tuple[tuple[float, ...], ...] = _TILE_KERNEL
        if length % 2:
            padded[-2, length - 1] = padded[-1, length] = 1
            outputs[-2:, length - 1] = 1
            groups, kernel_rows = (*groups, (2, 1)), (*_TILE_KERNEL, *_LAST_KERNEL)
        used = sum(kernel * places for kernel, places in groups)
        return cls(
            padded[:used, 1 : length + 1], outputs[:used, :length], np.array(kernel_rows, np.float32), groups
        )

    def products(self) -> Iterator[tuple[int, int, int, int]]:
        """Group, kernel in it, place, and number of places of each product."""
        for group, (kernel_rows, places) in enumerate(self.groups):
            for kernel in range(kernel_rows):
                for place in range(places):
                    yield group, kernel, place, places


@dataclass(frozen=True)
class Plan:
    """How images of a height and width are convolved.

    Products lie in rows, C channels each. Every pair of groups of the two axes is one batch of matrix products: its
    kernels, for each the images, for each image the places.

    Attributes:
        positions: products of an image.
        kernels: float32 (K, 9), what each of K matrices of channels is made of, from the nine taps.
        batches: int64 (G, 3), of each pair of groups the first of its kernels, how many, and its places.
        spread_input, gather_output: tables of the kernels of that name for the images; spread_grad, gather_grad: those
            for the gradients of the outputs and of the inputs.
        layout: where products are.
    """

    positions: int
    kernels: Tensor
    batches: NDArray[np.int64]
    spread_input: Tables
    spread_grad: Tables
    gather_output: Tables
    gather_grad: Tables
    layout: Layout

    @classmethod
    @cache
    def of(cls, height: int, width: int) -> Plan:
        """The plan for images of this size, at least 2 x 2."""
        down, across = Axis.of(height), Axis.of(width)
        rows, columns = list(down.products()), list(across.products())
        layout = np.zeros((3, len(rows), len(columns)), np.int64)
        starts: dict[tuple[int, int], int] = {}
        batches: list[tuple[int, int, int]] = []
        taps: list[NDArray[np.float32]] = []
        total = 0
        row_kernels, column_kernels = _by_group(down), _by_group(across)
        for g, (many, places) in enumerate(down.groups):
            for h, (others, other_places) in enumerate(across.groups):
                starts[g, h] = total
                batches.append((len(taps), many * others, places * other_places))
                taps += [np.kron(a, b) for a in row_kernels[g] for b in column_kernels[h]]
                total += many * others * places * other_places
        for p, (g, kernel, place, _) in enumerate(rows):
            for q, (h, other, other_place, other_places) in enumerate(columns):
                together = rows[p][3] * other_places
                first = starts[g, h] + (kernel * across.groups[h][0] + other) * together
                layout[:, p, q] = first, together, place * other_places + other_place
        return cls(
            total,
            torch.from_numpy(np.array(taps, np.float32)),
            np.array(batches, np.int64),
            (*_sparse(down.inputs, 2), *_sparse(across.inputs, 2)),
            (*_sparse(down.outputs, 2), *_sparse(across.outputs, 2)),
            (*_sparse(down.outputs.T, 4), *_sparse(across.outputs.T, 4)),
            (*_sparse(down.inputs.T, 4), *_sparse(across.inputs.T, 4)),
            (layout[0], layout[1], layout[2]),
        )

    def filters(self, weight: Tensor) -> Tensor:
        """Matrices of channels, (K, C, D), for weights (D, C, 3, 3)."""
        taps = weight.detach().permute(2, 3, 1, 0).flatten(2).flatten(0, 1)
        return (self.kernels.to(weight.dtype) @ taps).view(-1, weight.shape[1], weight.shape[0])

    def weight_grad(self, filters_grad: Tensor) -> Tensor:
        """Gradient for the weights, (D, C, 3, 3), of that for the matrices, (K, C, D)."""
        _, inputs, outputs = filters_grad.shape
        taps = self.kernels.to(filters_grad.dtype).t() @ filters_grad.flatten(1)
        return taps.view(3, 3, inputs, outputs).permute(3, 2, 0, 1)

    def parts(self, products: Tensor) -> Iterator[tuple[Tensor, slice]]:
        """The batches of a block's products, (positions * images, C), each with the kernels it belongs to."""
        begin, room = 0, len(products) // self.positions
        for first, many, places in self.batches.tolist():
            rows = many * places * room
            yield products[begin : begin + rows].view(many, places * room, -1), slice(first, first + many)
            begin += rows


def _by_group(axis: Axis) -> list[NDArray[np.float32]]:
    return np.split(axis.kernels, np.cumsum([many for many, _ in axis.groups])[:-1])


def _sparse(matrix: NDArray[np.float32], most: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Columns and values of the entries of each row that are not 0, (rows, most) each, filled up with zeros."""
    places = np.zeros((len(matrix), most), np.int64)
    values = np.zeros((len(matrix), most), np.float32)
    for row, entries in enumerate(matrix):
        (found,) = entries.nonzero()
        places[row, : len(found)], values[row, : len(found)] = found, entries[found]
    return places, values


def packed(filters: Tensor) -> Tensor:
    """Filters in the order `convolve` and `convolve_backward` take them where this package multiplies.

    Args:
        filters: float32 (K, C, C), from `Plan.filters`.

    Returns:
        bfloat16 (2, K, C / 2, C, 2): numbers of two rows that are one above the other lie together; of the matrices,
        then of them transposed.
    """
    count, depth, width = filters.shape
    both = torch.empty((2, count, depth // 2, width, 2), dtype=torch.bfloat16)
    kernels.pack(filters.contiguous().numpy(), both.view(torch.uint32).squeeze(-1).numpy())
    return both


def convolve(images: Tensor, filters: Tensor, bias: Tensor, rectified: bool) -> Tensor:
    """Convolve images, bfloat16 (N, H, W, C), without gradients.

    Args:
        images: on the CPU, C a multiple of `lanes.LANES`.
        filters: bfloat16 (K, C, D), from `Plan.filters`, for a library to multiply by; or `packed`.
        bias: float32 (D,).
        rectified: whether negative outputs become 0.

    Returns:
        bfloat16 (N, H, W, D).
    """
    plan = Plan.of(*images.shape[1:3])
    outputs = images.new_empty(*images.shape[:3], len(bias))
    if _is_packed(filters):
        kernels.convolve(
            as_u16(images),
            as_u16(filters[0]),
            bias.detach().numpy(),
            rectified,
            plan.spread_input,
            plan.gather_output,
            plan.layout,
            plan.batches,
            _OWN_BLOCK,
            as_u16(outputs),
        )
        return outputs
    for block, room in _blocks(len(images)):
        inputs = _spread(plan, plan.spread_input, images[block], room)
        products = inputs.new_empty(len(inputs), filters.shape[2])
        for (given, chosen), (made, _) in zip(plan.parts(inputs), plan.parts(products), strict=True):
            torch.bmm(given, filters[chosen], out=made)
        _gather(plan, plan.gather_output, products, room, outputs[block], bias, rectified)
    return outputs


def convolve_backward(
    grads: Tensor, images: Tensor, filters: Tensor, outputs: Tensor | None = None, added: Tensor | None = None
) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients of `convolve` for images, weights and bias, given that for its outputs.

    Args:
        grads: bfloat16 (N, H, W, D).
        images: what `convolve` was given.
        filters: what `convolve` was given.
        outputs: what it returned, if it was told to rectify.
        added: like images, what to add to their gradient.

    Returns:
        bfloat16 like images; float32 (D, C, 3, 3) and (D,).
    """
    plan = Plan.of(*images.shape[1:3])
    bias_grad = torch.zeros(grads.shape[3])
    filters_grad = torch.zeros(len(plan.kernels), images.shape[3], grads.shape[3])
    images_grad = torch.empty_like(images)
    gates, more = grads[:0] if outputs is None else outputs, images[:0] if added is None else added
    if _is_packed(filters):
        kernels.convolve_backward(
            as_u16(grads),
            as_u16(gates),
            as_u16(images),
            as_u16(filters[1]),
            as_u16(more),
            plan.spread_input,
            plan.spread_grad,
            plan.gather_grad,
            plan.layout,
            plan.batches,
            _OWN_BLOCK,
            as_u16(images_grad),
            filters_grad.numpy(),
            bias_grad.numpy(),
        )
        return images_grad, plan.weight_grad(filters_grad), bias_grad
    made, every = torch.empty_like(filters), np.arange(len(filters))
    for block, room in _blocks(len(images)):
        products = _spread(plan, plan.spread_grad, grads[block], room, bias_grad, gates[block])
        inputs = _spread(plan, plan.spread_input, images[block], room)
        for (given, chosen), (slopes, _) in zip(plan.parts(inputs), plan.parts(products), strict=True):
            torch.bmm(given.transpose(1, 2), slopes, out=made[chosen])
            torch.bmm(
                slopes, filters[chosen].transpose(1, 2), out=given
            )  # whose inputs are not needed any more
        add_up(as_u16(made.unsqueeze(1)), every, filters_grad.unsqueeze(1).numpy())
        _gather(plan, plan.gather_grad, inputs, room, images_grad[block], added=more[block])
    return images_grad, plan.weight_grad(filters_grad), bias_grad


def _is_packed(filters: Tensor) -> bool:
    return filters.dim() == 5


def _blocks(count: int) -> Iterator[tuple[slice, int]]:
    """Groups of images convolved together, each with the number of images to make room for."""
    for begin in range(0, count, BLOCK):
        end = min(begin + BLOCK, count)
        yield slice(begin, end), roomy(end - begin)


def roomy(count: int) -> int:
    """The number of images to make room for, because the products of each new shape are compiled and kept for good.

    The few images of a step while acting waste less.
    """
    grain = 2 if count <= 16 else 8
    return -(-count // grain) * grain


def _spread(
    plan: Plan,
    tables: Tables,
    images: Tensor,
    room: int,
    sums: Tensor | None = None,
    gates: Tensor | None = None,
) -> Tensor:
    products = images.new_empty(plan.positions * room, images.shape[3])
    total = torch.empty(0) if sums is None else sums
    open_ = images[:0] if gates is None else gates
    kernels.spread(as_u16(images), as_u16(open_), total.numpy(), tables, plan.layout, room, as_u16(products))
    return products


def _gather(
    plan: Plan,
    tables: Tables,
    products: Tensor,
    room: int,
    images: Tensor,
    bias: Tensor | None = None,
    rectified: bool = False,
    added: Tensor | None = None,
) -> None:
    offset = torch.zeros(images.shape[3]) if bias is None else bias.detach()
    more = images[:0] if added is None else added
    kernels.gather(
        as_u16(products), room, tables, plan.layout, offset.numpy(), rectified, as_u16(more), as_u16(images)
    )


def as_u16(numbers: Tensor) -> NDArray[np.uint16]:
    """A view of bfloat16 numbers for the kernels."""
    view: NDArray[np.uint16] = numbers.detach().view(torch.uint16).numpy()
    return view
