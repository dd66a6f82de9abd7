"""This module does what lies between the convolutions of images in bfloat16: modulation, sums and pooling, compiled.

Numbers are bfloat16, kept as uint16 because NumPy has no such type; sums are float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from trainer.nets.kernels import F32, I64, U16, compiled, inlined
from trainer.nets.lanes import LANES


@inlined
def _widened(number: Any) -> Any:
    """A bfloat16 as float32."""
    return np.uint32(np.uint32(number) << np.uint32(16)).view(np.float32)


@inlined
def _narrowed(number: Any) -> Any:
    """A finite float32 as bfloat16, rounded to the nearest, to even between two; infinity stays, and so does NaN."""
    bits = np.float32(number).view(np.uint32)
    odd = np.uint32(np.uint32(bits >> np.uint32(16)) & np.uint32(1))
    up = np.uint32(np.uint32(bits + np.uint32(0x7FFF)) + odd)
    return np.uint16(np.uint32((up if number == number else np.uint32(0x7FC00000)) >> np.uint32(16)))


@compiled
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


@compiled
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


@compiled
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


@compiled
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


@compiled
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
