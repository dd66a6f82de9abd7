"""This module keeps each distinct image and history of a rollout once, and arranges histories as a prefix tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Int64 = NDArray[np.int64]

# Fixed odd multipliers; one per column, so that equal rows and only they (up to 2**-64) get equal ids.
_MULTIPLIERS = np.random.Generator(np.random.PCG64(0x5EED)).integers(
    1, 2**63, size=4096, dtype=np.uint64
) * np.uint64(2) + np.uint64(1)


def content_ids(rows: NDArray[np.generic]) -> Int64:
    """Return 64-bit ids, int64 (E,), equal for equal rows of an integer array (E, ...) of at most 4096 columns."""
    flat = rows.reshape(len(rows), -1)
    if flat.shape[1] > len(_MULTIPLIERS):
        raise ValueError(f"rows: got {flat.shape[1]} columns, expected at most {len(_MULTIPLIERS)}")
    total = flat.astype(np.uint64) @ _MULTIPLIERS[: flat.shape[1]]
    ids: Int64 = (total ^ (total >> np.uint64(29))).view(np.int64)
    return ids


class DistinctRows:
    """A growing table of rows, each stored once, addressed by a caller's 64-bit id.

    Attributes:
        size: number of rows held, among them the first `unnamed` ones, which are zero and have no id.
    """

    def __init__(
        self, shape: tuple[int, ...], dtype: type[np.generic], unnamed: int = 0, capacity: int = 1024
    ) -> None:
        self.size = unnamed
        self._data = np.zeros((capacity, *shape), dtype)
        self._row_of: dict[int, int] = {}

    @property
    def data(self) -> NDArray[np.generic]:
        """The rows held, (size, ...); a view, valid until the next `add`."""
        return self._data[: self.size]

    def add(
        self,
        ids: Int64,
        values: NDArray[Any],
        read: Callable[[NDArray[Any]], NDArray[Any]] = lambda rows: rows,
    ) -> tuple[Int64, Int64]:
        """Store the rows of `values` (E, ...) whose id is new, as `read` makes them; what is held is not read again.

        Returns:
            rows: int64 (E,), where each given row is held.
            fresh: int64 (K,), indices into `values` of the rows just stored; they were stored in this order, so
                they are rows `size - K` to `size - 1`.
        """
        unique, first, inverse = np.unique(ids, return_index=True, return_inverse=True)
        found = [self._row_of.get(key, -1) for key in unique.tolist()]
        rows = np.array(found, np.int64)
        missing = np.flatnonzero(rows < 0)
        if len(missing):
            fresh_rows = np.arange(self.size, self.size + len(missing))
            rows[missing] = fresh_rows
            self._row_of.update(zip(unique[missing].tolist(), fresh_rows.tolist(), strict=True))
            self._reserve(self.size + len(missing))
            self._data[fresh_rows] = read(values[first[missing]])
            self.size += len(missing)
        return rows[inverse], first[missing].astype(np.int64)

    def _reserve(self, size: int) -> None:
        if size > len(self._data):
            grown = np.zeros((max(size, 2 * len(self._data)), *self._data.shape[1:]), self._data.dtype)
            grown[: self.size] = self._data[: self.size]
            self._data = grown


@dataclass(frozen=True)
class PrefixTree:
    """Distinct histories as paths from a root, so that a shared beginning is encoded once.

    State 0 is the empty history; state k >= 1 is the history of state `parents[k - 1]` plus `tokens[k - 1]`.
    States are sorted by length: those of length d are `offsets[d - 1] + 1` to `offsets[d]`.

    Attributes:
        tokens: int64 (K,) last word of each state.
        parents: int64 (K,) state it continues.
        offsets: K's running total by length, starting at 0.
        leaves: int64 (D,) state of each history given to `prefix_tree`.
    """

    tokens: Int64
    parents: Int64
    offsets: list[int]
    leaves: Int64


def history_lengths(tokens: NDArray[np.generic]) -> Int64:
    """Return the number of words, int64 (D,), of 0-padded histories (D, L)."""
    lengths: Int64 = np.count_nonzero(tokens, axis=1).astype(np.int64)
    return lengths


def prefix_tree(tokens: NDArray[np.generic]) -> PrefixTree:
    """Build the tree of 0-padded histories, integer (D, L), duplicates allowed.

    A history that lost its oldest utterances (it outgrew the buffer) is a path of its own, which is exactly the
    history the agent observes. The cost is a sort of the D rows plus work in proportion to the states.
    """
    lengths = history_lengths(tokens)
    longest = int(lengths.max(initial=0))
    count = len(tokens)
    if longest == 0:
        empty = np.zeros(0, np.int64)
        return PrefixTree(empty, empty, [0], np.zeros(count, np.int64))
    words = np.ascontiguousarray(tokens[:, :longest].astype(">u2"))
    order = np.argsort(words.view(f"V{2 * longest}").ravel(), kind="stable")
    words, sorted_lengths = words[order], lengths[order]

    # Row i shares `shared[i]` words with the row before it and adds one state for each word after those.
    differs = np.ones((count, longest + 1), np.bool_)
    np.not_equal(words[1:], words[:-1], out=differs[1:, :longest])
    shared = np.minimum(differs.argmax(axis=1), sorted_lengths)
    added = sorted_lengths - shared
    row = np.repeat(np.arange(count), added)
    depth = np.arange(len(row)) - np.repeat(np.cumsum(added) - added, added) + np.repeat(shared, added)

    key = depth * count + row
    by_depth = np.argsort(key, kind="stable")
    key, row, depth = key[by_depth], row[by_depth], depth[by_depth]

    def state(last_word: Int64, rows: Int64) -> Int64:
        """State of the prefix of `rows` that ends with word number `last_word` (-1 = the root)."""
        owner = np.searchsorted(key, last_word * count + rows, side="right")
        return np.where(last_word < 0, 0, owner).astype(np.int64)

    leaves = np.empty(count, np.int64)
    leaves[order] = state(sorted_lengths - 1, np.arange(count))
    offsets = np.concatenate(([0], np.cumsum(np.bincount(depth, minlength=longest)))).tolist()
    return PrefixTree(words[row, depth].astype(np.int64), state(depth - 1, row), offsets, leaves)
