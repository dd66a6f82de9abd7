"""The picture as the agent gets it: the engine keeps four channels of a cell in one word, and gestures apart."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import VIEW

Image = NDArray[np.uint8]


class Channels:
    """The pictures of all rows, uint8 (E, 7, 7, 4), or (E, 7, 7, 6) where a program shows pointing and last acts.

    Attributes:
        values: the pictures; the engine's own buffer, or what the last `refresh` made of its buffers.
    """

    def __init__(self, image: NDArray[np.uint32], gestures: NDArray[np.uint16]) -> None:
        """`image`: packed cells, (E, 49). `gestures`: the fifth and sixth channel, (E, 49), or (E, 0)."""
        self._parts = _parts(image, gestures)
        self.values = self._parts[0] if len(self._parts) == 1 else np.concatenate(self._parts, axis=-1)
        # Two channels at a time, each a plain copy with a stride: several times as fast as joining cells of bytes.
        self._pairs = [
            (_in_pairs(self.values)[..., place], _in_pairs(part)[..., k])
            for place, (part, k) in enumerate((p, k) for p in self._parts for k in range(p.shape[-1] // 2))
        ]

    def refresh(self) -> None:
        """Take over what the engine has written."""
        if len(self._parts) > 1:
            for target, source in self._pairs:
                target[...] = source


def joined(image: NDArray[np.uint32], gestures: NDArray[np.uint16]) -> Image:
    """The pictures in one array; see Channels."""
    return Channels(image, gestures).values


def _in_pairs(image: Image) -> NDArray[np.uint16]:
    """The same memory, two channels in one number."""
    return image.view(np.uint16)


def _parts(image: NDArray[np.uint32], gestures: NDArray[np.uint16]) -> list[Image]:
    parts: list[tuple[NDArray[Any], int]] = [(image, 4), (gestures, 2)] if gestures.size else [(image, 4)]
    return [array.view(np.uint8).reshape(len(image), VIEW, VIEW, channels) for array, channels in parts]
