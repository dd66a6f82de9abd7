"""This module moves images to and from the products of a convolution by Winograd's method, in compiled loops.

Numbers are bfloat16, kept as uint16 because NumPy has no such type; sums are float32. Indices come from slices so that
the compiler sees them rise from 0 and uses whole vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

import numpy as np
from numba import config, njit
from numpy.typing import NDArray

LANES: Final = 128
"""Channels an image must have, or a multiple: the loops over them have this length when they are compiled."""

AVAILABLE: Final = not config.DISABLE_JIT
"""Whether the loops are compiled; as Python they would take minutes."""

U16 = NDArray[np.uint16]
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _compiled(function: _Function) -> _Function:
    # Threads of a crew run these side by side. A sum may be rounded once less, by a fused multiplication.
    return cast(_Function, njit(nogil=True, error_model="numpy", fastmath={"contract"}, cache=True)(function))


def _inlined(function: _Function) -> _Function:
    return cast(_Function, njit(inline="always", error_model="numpy")(function))


@_inlined
def _widened(number: Any) -> Any:
    """A bfloat16 as float32."""
    return np.uint32(np.uint32(number) << np.uint32(16)).view(np.float32)


@_inlined
def _narrowed(number: Any) -> Any:
    """A finite float32 as bfloat16, rounded to the nearest, to even between two; infinity stays, and so does NaN."""
    bits = np.float32(number).view(np.uint32)
    odd = np.uint32(np.uint32(bits >> np.uint32(16)) & np.uint32(1))
    up = np.uint32(np.uint32(bits + np.uint32(0x7FFF)) + odd)
    return np.uint16(np.uint32((up if number == number else np.uint32(0x7FC00000)) >> np.uint32(16)))


@_inlined
def _sum_of_two(into: F32, at: Any, source: F32, i: Any, u: Any, j: Any, v: Any) -> None:
    """One cell's channels: into[at] = u * source[i] + v * source[j]."""
    for c in range(LANES):
        k = np.uintp(c)
        into[at + k] = u * source[i + k] + v * source[j + k]


@_compiled
def spread(
    images: U16,
    outputs: U16,
    masked: bool,
    sums: F32,
    rows: I64,
    row_weights: F32,
    columns: I64,
    column_weights: F32,
    first: I64,
    step: I64,
    place: I64,
    room: int,
    products: U16,
) -> None:
    """Write what one side of the products is made of: rows' matrix times image times columns' matrix transposed.

    Args:
        images: (N, H, W, C).
        outputs: like images; where `masked`, an image's numbers count as 0 where this is not positive.
        masked: see above.
        sums: (C,), where the images' sums over all cells are added, after masking.
        rows: (P, 2), where the first matrix is not 0, two entries in each row.
        row_weights: (P, 2), those entries.
        columns: (Q, 2), where the second matrix is not 0.
        column_weights: (Q, 2), those entries.
        first: (P, Q), product (p, q) of image n goes to row `first * room + n * step + place`.
        step: (P, Q), see above.
        place: (P, Q), see above.
        room: images that `products` has room for; those beyond the N given are 0.
        products: (positions * room, C).
    """
    count, height, width, channels = images.shape
    cells = height * width
    source, open_, target = images.reshape(-1), outputs.reshape(-1), products.reshape(-1)
    image = np.empty(cells * LANES, np.float32)
    scratch = np.empty(len(rows) * width * LANES, np.float32)
    total = np.empty(LANES, np.float32)
    for n in range(count):
        for start in range(0, channels, LANES):
            total[:] = 0
            for cell in range(cells):
                at = np.uintp((n * cells + cell) * channels + start)
                to = np.uintp(cell * LANES)
                if masked:
                    for c in range(LANES):
                        k = np.uintp(c)
                        # As integers the positive numbers are those from 1 to 0x7FFF.
                        passes = np.uint16(open_[at + k] - np.uint16(1)) < np.uint16(0x7FFF)
                        image[to + k] = _widened(source[at + k]) if passes else np.float32(0)
                        total[k] += image[to + k]
                else:
                    for c in range(LANES):
                        k = np.uintp(c)
                        image[to + k] = _widened(source[at + k])
                        total[k] += image[to + k]
            sums[start : start + LANES] += total
            for p in range(len(rows)):
                u, v = row_weights[p, 0], row_weights[p, 1]
                for x in range(width):
                    i = np.uintp((rows[p, 0] * width + x) * LANES)
                    j = np.uintp((rows[p, 1] * width + x) * LANES)
                    _sum_of_two(scratch, np.uintp((p * width + x) * LANES), image, i, u, j, v)
            for p in range(len(rows)):
                for q in range(len(columns)):
                    u, v = column_weights[q, 0], column_weights[q, 1]
                    i = np.uintp((p * width + columns[q, 0]) * LANES)
                    j = np.uintp((p * width + columns[q, 1]) * LANES)
                    to = np.uintp((first[p, q] * room + n * step[p, q] + place[p, q]) * channels + start)
                    for c in range(LANES):
                        k = np.uintp(c)
                        target[to + k] = _narrowed(u * scratch[i + k] + v * scratch[j + k])
    for n in range(count, room):
        for p in range(len(rows)):
            for q in range(len(columns)):
                products[first[p, q] * room + n * step[p, q] + place[p, q]] = 0


@_compiled
def gather(
    products: U16,
    room: int,
    rows: I64,
    row_weights: F32,
    columns: I64,
    column_weights: F32,
    first: I64,
    step: I64,
    place: I64,
    bias: F32,
    rectified: bool,
    added: U16,
    images: U16,
) -> None:
    """Write images: rows' matrix times products times columns' matrix transposed, plus a bias, perhaps rectified.

    Args:
        products: (positions * room, C).
        room: images that `products` has room for.
        rows: (H, 4), where the first matrix is not 0, at most four entries in each row, filled up.
        row_weights: (H, 4), those entries, or 0.
        columns: (W, 4), where the second matrix is not 0.
        column_weights: (W, 4), those entries, or 0.
        first: (P, Q), for each product, as for `spread`.
        step: (P, Q), as for `spread`.
        place: (P, Q), as for `spread`.
        bias: (C,).
        rectified: whether negative numbers become 0.
        added: like images, what is added instead of a bias; without images for nothing.
        images: (N, H, W, C), written.
    """
    count, height, width, channels = images.shape
    cells, positions = height * width, first.shape[0]
    source, more, target = products.reshape(-1), added.reshape(-1), images.reshape(-1)
    scratch = np.empty(positions * width * LANES, np.float32)
    places = np.empty(first.shape[1], np.uintp)
    lowest = np.float32(0) if rectified else np.float32(-np.inf)
    for n in range(count):
        for start in range(0, channels, LANES):
            for p in range(positions):
                for q in range(len(places)):
                    row = first[p, q] * room + n * step[p, q] + place[p, q]
                    places[q] = np.uintp(row * channels + start)
                for x in range(width):
                    f, g = places[columns[x, 0]], places[columns[x, 1]]
                    h, i = places[columns[x, 2]], places[columns[x, 3]]
                    u, v = column_weights[x, 0], column_weights[x, 1]
                    w, z = column_weights[x, 2], column_weights[x, 3]
                    to = np.uintp((p * width + x) * LANES)
                    if z == 0:
                        for c in range(LANES):
                            k = np.uintp(c)
                            one, two = _widened(source[f + k]), _widened(source[g + k])
                            scratch[to + k] = u * one + v * two + w * _widened(source[h + k])
                    else:
                        for c in range(LANES):
                            k = np.uintp(c)
                            one, two = _widened(source[f + k]), _widened(source[g + k])
                            three, four = _widened(source[h + k]), _widened(source[i + k])
                            scratch[to + k] = u * one + v * two + w * three + z * four
            for y in range(height):
                for x in range(width):
                    f, g = (
                        np.uintp((rows[y, 0] * width + x) * LANES),
                        np.uintp((rows[y, 1] * width + x) * LANES),
                    )
                    h, i = (
                        np.uintp((rows[y, 2] * width + x) * LANES),
                        np.uintp((rows[y, 3] * width + x) * LANES),
                    )
                    u, v, w, z = row_weights[y, 0], row_weights[y, 1], row_weights[y, 2], row_weights[y, 3]
                    to = np.uintp((n * cells + y * width + x) * channels + start)
                    offset = np.uintp(start)
                    if len(more):
                        for c in range(LANES):
                            k = np.uintp(c)
                            one, two = (
                                u * scratch[f + k] + v * scratch[g + k],
                                w * scratch[h + k] + z * scratch[i + k],
                            )
                            target[to + k] = _narrowed(one + two + _widened(more[to + k]))
                    else:
                        for c in range(LANES):
                            k = np.uintp(c)
                            one, two = (
                                u * scratch[f + k] + v * scratch[g + k],
                                w * scratch[h + k] + z * scratch[i + k],
                            )
                            value = one + two + bias[offset + k]
                            target[to + k] = _narrowed(lowest if value < lowest else value)  # NaN stays


@_compiled
def modulate(hidden: U16, scale: F32, shift: F32, text: I64, added: U16, images: U16) -> None:
    """Write the images `max(hidden * scale + shift, 0) + added`, where row `text[n]` of both tables is image n's.

    Images are (N, H, W, C), the tables (D, C), and `text` is (N,).
    """
    count, height, width, channels = images.shape
    for n in range(count):
        for start in range(0, channels, LANES):
            by, up = scale[text[n], start : start + LANES], shift[text[n], start : start + LANES]
            for y in range(height):
                for x in range(width):
                    source, more = (
                        hidden[n, y, x, start : start + LANES],
                        added[n, y, x, start : start + LANES],
                    )
                    target = images[n, y, x, start : start + LANES]
                    for c in range(LANES):
                        value = _widened(source[c]) * by[c] + up[c]
                        target[c] = _narrowed((np.float32(0) if value < 0 else value) + _widened(more[c]))


@_compiled
def modulate_backward(
    grads: U16, hidden: U16, scale: F32, shift: F32, text: I64, d_hidden: U16, d_scale: F32, d_shift: F32
) -> None:
    """Write the gradient of `modulate` for `hidden`, and add to those for its tables; `grads` is that of its images."""
    count, height, width, channels = hidden.shape
    for n in range(count):
        for start in range(0, channels, LANES):
            by, up = scale[text[n], start : start + LANES], shift[text[n], start : start + LANES]
            to_scale, to_shift = (
                d_scale[text[n], start : start + LANES],
                d_shift[text[n], start : start + LANES],
            )
            for y in range(height):
                for x in range(width):
                    source, grad = (
                        hidden[n, y, x, start : start + LANES],
                        grads[n, y, x, start : start + LANES],
                    )
                    target = d_hidden[n, y, x, start : start + LANES]
                    for c in range(LANES):
                        value = _widened(source[c])
                        slope = np.float32(0) if value * by[c] + up[c] <= 0 else _widened(grad[c])
                        target[c] = _narrowed(slope * by[c])
                        to_scale[c] += slope * value
                        to_shift[c] += slope


@_compiled
def add_up(grads: U16, index: I64, total: F32) -> None:
    """Add image n of `grads`, (N, H, W, C), to number `index[n]` of `total`, (I, H, W, C)."""
    count, height, width, channels = grads.shape
    for n in range(count):
        for y in range(height):
            for x in range(width):
                for start in range(0, channels, LANES):
                    grad = grads[n, y, x, start : start + LANES]
                    into = total[index[n], y, x, start : start + LANES]
                    for c in range(LANES):
                        into[c] += _widened(grad[c])


@_compiled
def peaks(images: U16, values: F32, cells: U16) -> None:
    """Write each channel's highest number and the first cell that has it, (N, C) both; NaN is above all numbers.

    Images are (N, H, W, C) of at most 65,536 cells.
    """
    count, height, width, channels = images.shape
    for n in range(count):
        for start in range(0, channels, LANES):
            best, where = values[n, start : start + LANES], cells[n, start : start + LANES]
            best[:], where[:] = -np.inf, 0
            for y in range(height):
                for x in range(width):
                    source, cell = images[n, y, x, start : start + LANES], np.uint16(y * width + x)
                    for c in range(LANES):
                        value = _widened(source[c])
                        higher = value > best[c] or value != value
                        where[c] = cell if higher else where[c]
                        best[c] = value if higher else best[c]


@_compiled
def peaks_backward(grads: F32, cells: U16, images: U16) -> None:
    """Write the gradient of `peaks` for its images; `grads` is that of its values."""
    count, height, width, channels = images.shape
    for n in range(count):
        for start in range(0, channels, LANES):
            grad, where = grads[n, start : start + LANES], cells[n, start : start + LANES]
            for y in range(height):
                for x in range(width):
                    target, cell = images[n, y, x, start : start + LANES], np.uint16(y * width + x)
                    for c in range(LANES):
                        target[c] = _narrowed(grad[c] if where[c] == cell else np.float32(0))
