"""This module gives each environment random numbers of its own, which begin anew with a numbered episode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Streams that no numbered episode begins lie in a domain of keys of their own.
_UNNUMBERED = 1 << 63


class Streams:
    """One stream of random numbers for each of E environments.

    What an environment draws depends on the seed and on the number of its episode alone, not on how many others
    are played beside it. Where episodes have no numbers, it depends on the seed and the environment's place.
    """

    def __init__(self, seed: int) -> None:
        if not 0 <= seed < _UNNUMBERED:
            raise ValueError(f"seed: got {seed}, expected a whole number from 0 to 2**63 - 1")
        self._seed = seed
        self._streams: list[np.random.Generator] = []

    def begin(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Note that episodes begin where `mask`, bool (E,), with these numbers, int64 (E,), if they have any."""
        self._require(len(mask))
        if episodes is None:
            return
        for place in np.flatnonzero(mask).tolist():
            self._streams[place] = _stream(self._seed, int(episodes[place]))

    def uniform(self, count: int, width: int) -> NDArray[np.float64]:
        """The next numbers of each stream, from 0 up to but not including 1, float64 (E, width)."""
        self._require(count)
        return np.stack([stream.random(width) for stream in self._streams])

    def gumbel(self, count: int, width: int) -> NDArray[np.float32]:
        """The next standard Gumbel numbers of each stream, float32 (E, width)."""
        self._require(count)
        return np.stack([stream.gumbel(size=width) for stream in self._streams]).astype(np.float32)

    def _require(self, count: int) -> None:
        """Make the streams of `count` environments, if there are others or none."""
        if len(self._streams) != count:
            self._streams = [_stream(self._seed | _UNNUMBERED, place) for place in range(count)]


def _stream(seed: int, number: int) -> np.random.Generator:
    """Philox, whose streams of different keys are independent (Salmon et al. 2011)."""
    return np.random.Generator(np.random.Philox(key=np.array([seed, number], np.uint64)))
