"""This module does the three steps of a convolution by Winograd's method, in compiled loops.

Numbers are bfloat16, kept as uint16 because NumPy has no such type; sums are float32. Arrays are flat where vectors
are read and written, and indices count their elements.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from trainer.nets import tiles
from trainer.nets.kernels import F32, I64, U16, U32, compiled, inlined
from trainer.nets.lanes import LANES, Lanes, over_lanes

Tables = tuple[I64, F32, I64, F32]
"""A sparse matrix for the rows and one for the columns, of each its columns and values; see `spread` and `gather`."""

Layout = tuple[I64, I64, I64]
"""First, step and place, int64 (P, Q) each.

Among the products of R images, product (p, q) of image n is in row `first * R + n * step + place`.
"""


_TURNED: Final = 16
"""Rows that are transposed together: as many numbers as a line of the cache has."""


@over_lanes
def _copy(lanes: Lanes, into: Any, at: Any, source: Any, a: Any) -> None:
    lanes.put(into, at, lanes.get(source, a))


@over_lanes
def _copy_open(lanes: Lanes, into: Any, at: Any, source: Any, gates: Any, a: Any) -> None:
    lanes.put(into, at, lanes.where_positive(lanes.get(source, a), lanes.get(gates, a)))


@over_lanes
def _add(lanes: Lanes, into: Any, at: Any, source: Any, a: Any) -> None:
    lanes.put(into, at, lanes.plus(lanes.get(into, at), lanes.get(source, a)))


@over_lanes
def _weigh(lanes: Lanes, into: Any, at: Any, source: Any, *terms: Any) -> None:
    """The sum of what an array holds at some places times numbers, given one after the other."""
    lanes.put(into, at, _weighted(lanes, source, terms))


@over_lanes
def _weigh_and_add(
    lanes: Lanes, into: Any, at: Any, lowest: Any, more: Any, i: Any, source: Any, *terms: Any
) -> None:
    """The same, and what another array holds; a number that is the least that may come of it."""
    total = lanes.plus(_weighted(lanes, source, terms), lanes.get(more, i))
    lanes.put(into, at, lanes.at_least(total, lowest))


def _weighted(lanes: Lanes, source: Any, terms: tuple[Any, ...]) -> Any:
    held = [lanes.get(source, index) for index in terms[::2]]
    return lanes.weighted(*(part for term in zip(held, terms[1::2], strict=True) for part in term))


@over_lanes
def _pair_up(lanes: Lanes, into: Any, at: Any, source: Any, above: Any, below: Any) -> None:
    lanes.put_pairs(into, at, lanes.get(source, above), lanes.get(source, below))


@compiled
def spread(
    images: U16, gates: U16, sums: F32, tables: Tables, layout: Layout, room: int, products: U16
) -> None:
    """Write what one side of the products is made of: rows' matrix times image times columns' matrix transposed.

    Args:
        images: (N, H, W, C).
        gates: like images; where this is not positive, an image's numbers count as 0. Without images none does.
        sums: (C,), where the images' sums over all cells are added, after that; or empty.
        tables: the two matrices, (P, H) and (Q, W), two entries in each row: columns (P, 2) and values (P, 2).
        layout: where products are.
        room: images that `products` has room for; those beyond the N given are 0.
        products: (positions * room, C), or with more rows.
    """
    count, height, width, channels = images.shape
    rows, row_weights, columns, column_weights = tables
    first, step, place = layout
    cells = height * width
    source, open_, target = images.reshape(-1), gates.reshape(-1), products.reshape(-1)
    image, line = np.empty(cells * LANES, np.float32), np.empty(width * LANES, np.float32)
    for n in range(count):
        for start in range(0, channels, LANES):
            for cell in range(cells):
                at = (n * cells + cell) * channels + start
                if len(gates):
                    _copy_open(image, cell * LANES, source, open_, at)
                else:
                    _copy(image, cell * LANES, source, at)
                if len(sums):
                    _add(sums, start, image, cell * LANES)
            for p in range(len(rows)):
                above, below = rows[p, 0] * width * LANES, rows[p, 1] * width * LANES
                u, v = row_weights[p, 0], row_weights[p, 1]
                for x in range(0, width * LANES, LANES):
                    _weigh(line, x, image, above + x, u, below + x, v)
                for q in range(len(columns)):
                    row = first[p, q] * room + n * step[p, q] + place[p, q]
                    left, right = columns[q, 0] * LANES, columns[q, 1] * LANES
                    u, v = column_weights[q, 0], column_weights[q, 1]
                    _weigh(target, row * channels + start, line, left, u, right, v)
    for n in range(count, room):
        for p in range(len(rows)):
            for q in range(len(columns)):
                products[first[p, q] * room + n * step[p, q] + place[p, q]] = 0


@compiled
def gather(
    products: U16,
    room: int,
    tables: Tables,
    layout: Layout,
    bias: F32,
    rectified: bool,
    added: U16,
    images: U16,
) -> None:
    """Write images: rows' matrix times products times columns' matrix transposed, plus a bias, perhaps rectified.

    Args:
        products: (positions * room, C), or with more rows.
        room: images that `products` has room for.
        tables: the two matrices, (H, P) and (W, Q), four entries in each row, filled up with zeros.
        layout: where products are.
        bias: (C,).
        rectified: whether negative numbers become 0.
        added: like images, what is added instead of a bias; without images the bias is.
        images: (N, H, W, C), written.
    """
    count, height, width, channels = images.shape
    rows, row_weights, columns, column_weights = tables
    first, step, place = layout
    cells, positions, across = height * width, first.shape[0], first.shape[1]
    source, more, target = products.reshape(-1), added.reshape(-1), images.reshape(-1)
    column = np.empty(positions * LANES, np.float32)
    starts = np.empty(first.shape, np.int64)
    lowest = np.float32(0) if rectified else np.float32(-np.inf)
    for n in range(count):
        for p in range(positions):
            for q in range(across):
                starts[p, q] = (first[p, q] * room + n * step[p, q] + place[p, q]) * channels
        for start in range(0, channels, LANES):
            for x in range(width):
                t, u = column_weights[x, 0], column_weights[x, 1]
                v, w = column_weights[x, 2], column_weights[x, 3]
                for p in range(positions):
                    a, b = starts[p, columns[x, 0]] + start, starts[p, columns[x, 1]] + start
                    c, d = starts[p, columns[x, 2]] + start, starts[p, columns[x, 3]] + start
                    if w == 0:
                        _weigh(column, p * LANES, source, a, t, b, u, c, v)
                    else:
                        _weigh(column, p * LANES, source, a, t, b, u, c, v, d, w)
                for y in range(height):
                    a, b, c, d = (
                        rows[y, 0] * LANES,
                        rows[y, 1] * LANES,
                        rows[y, 2] * LANES,
                        rows[y, 3] * LANES,
                    )
                    t, u, v, w = row_weights[y, 0], row_weights[y, 1], row_weights[y, 2], row_weights[y, 3]
                    at = (n * cells + y * width + x) * channels + start
                    if len(added):
                        _weigh_and_add(target, at, lowest, more, at, column, a, t, b, u, c, v, d, w)
                    else:
                        _weigh_and_add(target, at, lowest, bias, start, column, a, t, b, u, c, v, d, w)


@inlined
def _multiply(given: U16, filters: U16, batches: I64, room: int, depth: int, width: int, made: U16) -> None:
    """Multiply the rows of each filter, of `depth` channels, by it, to rows of `width` channels.

    A tile may end behind the rows of its filter. What it writes there is written anew by the next filter, or is behind
    the last row that counts.
    """
    begin = 0
    for batch in range(len(batches)):
        first, many, places = batches[batch]
        for kernel in range(first, first + many):
            end = begin + places * room
            for panel in range(0, width, tiles.PANEL):
                chosen = kernel * depth * width + 2 * panel
                for row in range(begin, end, tiles.ROWS):
                    tiles.multiply(
                        given,
                        row * depth,
                        depth,
                        2,
                        filters,
                        chosen,
                        2 * width,
                        made,
                        row * width + panel,
                        width,
                        depth // 2,
                    )
            begin = end


@inlined
def _multiply_add(
    inputs: U32, slopes: U32, batches: I64, room: int, depth: int, width: int, total: F32
) -> None:
    """Add the products of inputs, transposed, and slopes over the rows of each filter to its `total`.

    Both are pairs of rows, of `depth` and `width` channels; a filter's total is (depth, width).
    """
    begin = 0
    for batch in range(len(batches)):
        first, many, places = batches[batch]
        pairs = places * room // 2
        for kernel in range(first, first + many):
            for column in range(0, width, tiles.ADDED_COLUMNS):
                for row in range(0, depth, tiles.ADDED_ROWS):
                    tiles.multiply_add(
                        inputs,
                        begin * depth + row,
                        1,
                        depth,
                        slopes,
                        begin * width + column,
                        width,
                        total,
                        (kernel * depth + row) * width + column,
                        width,
                        pairs,
                    )
            begin += pairs


@inlined
def _pair_up_rows(rows: U16, count: int, channels: int, pairs: U32) -> None:
    """Let the first `count` rows, an even number, be pairs."""
    for row in range(0, count, 2):
        for start in range(0, channels, LANES):
            above = row * channels + start
            _pair_up(pairs, row // 2 * channels + start, rows, above, above + channels)


@compiled
def pack(filters: F32, pairs: U32) -> None:
    """Write `winograd.packed` of filters, (K, C, C), to `pairs`, (2, K, C / 2, C)."""
    count, channels, _ = filters.shape
    matrix, columns = filters.reshape(-1), np.empty((channels, channels), np.float32)
    as_rows, as_columns = pairs[0].reshape(-1), pairs[1].reshape(-1)
    for kernel in range(count):
        for start in range(0, channels, _TURNED):
            for d in range(channels):
                for c in range(start, start + _TURNED):
                    columns[d, c] = filters[kernel, c, d]
        for row in range(0, channels, 2):
            for start in range(0, channels, LANES):
                at = (kernel * channels + row) // 2 * channels + start
                above = (kernel * channels + row) * channels + start
                _pair_up(as_rows, at, matrix, above, above + channels)
                above = row * channels + start
                _pair_up(as_columns, at, columns.reshape(-1), above, above + channels)


@compiled
def convolve(
    images: U16,
    filters: U16,
    bias: F32,
    rectified: bool,
    spreading: Tables,
    gathering: Tables,
    layout: Layout,
    batches: I64,
    block: int,
    outputs: U16,
) -> None:
    """Write to `outputs` what `winograd.convolve` makes of images.

    Args:
        images: (N, H, W, C).
        filters: (K, C / 2, D, 2), the first half of `winograd.packed`.
        bias: (D,).
        rectified: whether negative outputs become 0.
        spreading: tables for `spread`.
        gathering: tables for `gather`.
        layout: where products are.
        batches: (G, 3): the first of the filters of each batch, how many, and its places in an image.
        block: images that are convolved together.
        outputs: (N, H, W, D).
    """
    depth, width = images.shape[3], outputs.shape[3]
    rows = layout[0].size * min(len(images), block) + tiles.ROWS - 1
    given, made = np.empty((rows, depth), np.uint16), np.empty((rows, width), np.uint16)
    no_sums = np.empty(0, np.float32)
    for begin in range(0, len(images), block):
        some = images[begin : begin + block]
        spread(some, some[:0], no_sums, spreading, layout, len(some), given)
        _multiply(given.reshape(-1), filters.reshape(-1), batches, len(some), depth, width, made.reshape(-1))
        into = outputs[begin : begin + block]
        gather(made, len(some), gathering, layout, bias, rectified, some[:0], into)


@compiled
def convolve_backward(
    grads: U16,
    gates: U16,
    images: U16,
    filters: U16,
    added: U16,
    spreading: Tables,
    spreading_grads: Tables,
    gathering_grads: Tables,
    layout: Layout,
    batches: I64,
    block: int,
    images_grad: U16,
    filters_grad: F32,
    bias_grad: F32,
) -> None:
    """Write the gradient of `convolve` for images, and add to those for filters and bias.

    Args:
        grads: (N, H, W, D), gradient for the outputs.
        gates: the outputs if they were rectified, else none of them.
        images: (N, H, W, C).
        filters: (K, D / 2, C, 2), the second half of `winograd.packed`.
        added: like images, what to add to their gradient, or none of them.
        spreading: tables for `spread` for the images.
        spreading_grads: tables for `spread` for the gradients.
        gathering_grads: tables for `gather` for the gradient of the images.
        layout: where products are.
        batches: as for `convolve`.
        block: images that are convolved together, an even number.
        images_grad: (N, H, W, C).
        filters_grad: (K, C, D).
        bias_grad: (D,).
    """
    depth, width = images.shape[3], grads.shape[3]
    most = layout[0].size * min(_even(len(images)), block)
    inputs = np.empty((most + tiles.ROWS - 1, depth), np.uint16)
    slopes = np.empty((most + tiles.ROWS - 1, width), np.uint16)
    input_pairs, slope_pairs = np.empty(most // 2 * depth, np.uint32), np.empty(most // 2 * width, np.uint32)
    no_sums, no_bias = np.empty(0, np.float32), np.zeros(depth, np.float32)
    for begin in range(0, len(images), block):
        end = min(begin + block, len(images))
        room = _even(end - begin)
        rows = layout[0].size * room
        spread(grads[begin:end], gates[begin:end], bias_grad, spreading_grads, layout, room, slopes)
        spread(images[begin:end], images[:0], no_sums, spreading, layout, room, inputs)
        _pair_up_rows(inputs.reshape(-1), rows, depth, input_pairs)
        _pair_up_rows(slopes.reshape(-1), rows, width, slope_pairs)
        _multiply_add(input_pairs, slope_pairs, batches, room, depth, width, filters_grad.reshape(-1))
        _multiply(slopes.reshape(-1), filters.reshape(-1), batches, room, width, depth, inputs.reshape(-1))
        into, more = images_grad[begin:end], added[begin:end]
        gather(inputs, room, gathering_grads, layout, no_bias, False, more, into)


@inlined
def _even(count: int) -> int:
    """The next even number: rows are multiplied in pairs."""
    return count + (count & 1)
