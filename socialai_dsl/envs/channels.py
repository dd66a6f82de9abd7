"""The picture as the agent gets it: the engine keeps four channels of a cell in one word, and gestures apart."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import VIEW

Image = NDArray[np.uint8]


def in_bytes(words: NDArray[Any]) -> Image:
    """The same memory, uint8 (E, 7, 7, channels): all words of a row hold the channels of its 49 cells."""
    return words.view(np.uint8).reshape(len(words), VIEW, VIEW, -1)


def joined(image: NDArray[np.uint32], gestures: NDArray[np.uint16]) -> Image:
    """The pictures of all rows, uint8 (E, 7, 7, 4), or (E, 7, 7, 6) where a program shows pointing and last acts.

    Args:
        image: packed cells, (E, 49).
        gestures: the fifth and sixth channel, (E, 49), or (E, 0).
    """
    if not gestures.size:
        return in_bytes(image)
    return np.concatenate([in_bytes(image), in_bytes(gestures)], axis=-1)
