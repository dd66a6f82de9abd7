"""Features of frames while acting, each distinct frame computed once.

Of 8,192 frames of a rollout a few hundred images and histories are distinct. Both are kept in tables; a history is
encoded from its longest known beginning, the features of a pair of the two are computed once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer.errors import ObservationError
from trainer.nets import ActorCritic

Int64 = NDArray[np.int64]


def content_ids(rows: NDArray[np.generic]) -> Int64:
    """64-bit ids, int64 (E,), equal for equal rows of an array (E, ...) and, up to 2**-64, only for them."""
    digests = (hashlib.blake2b(row.tobytes(), digest_size=8).digest() for row in rows)
    return np.frombuffer(b"".join(digests), np.int64)


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
        rows = np.array([self._row_of.get(key, -1) for key in unique.tolist()], np.int64)
        missing = np.flatnonzero(rows < 0)
        if len(missing):
            fresh_rows = np.arange(self.size, self.size + len(missing))
            rows[missing] = fresh_rows
            self._row_of.update(zip(unique[missing].tolist(), fresh_rows.tolist(), strict=True))
            if self.size + len(missing) > len(self._data):
                spare = np.zeros_like(self._data, shape=(self.size + len(missing), *self._data.shape[1:]))
                self._data = np.concatenate((self._data, spare))
            self._data[fresh_rows] = read(values[first[missing]])
            self.size += len(missing)
        return rows[inverse], first[missing].astype(np.int64)


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


def prefix_tree(tokens: NDArray[np.generic]) -> PrefixTree:
    """Build the tree of 0-padded histories, integer (D, L), duplicates allowed.

    A history that lost its oldest utterances (it outgrew the buffer) is a path of its own, which is exactly the
    history the agent observes. The cost is a sort of the D rows plus work in proportion to the states.
    """
    lengths = np.count_nonzero(tokens, axis=1)
    count, longest = len(tokens), int(lengths.max(initial=1))
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
    offsets = np.concatenate(([0], np.cumsum(np.bincount(depth)))).tolist()
    return PrefixTree(words[row, depth].astype(np.int64), state(depth - 1, row), offsets, leaves)


class Actor:
    """A network together with what it has already computed under its present weights.

    `begin` forgets all of that and must be called whenever the weights changed. Between two calls of `begin` the
    tables below only grow, and rows in them are never changed.

    Attributes:
        images: distinct images, uint8 (I, H, W, C).
        histories: distinct 0-padded histories as the network reads them, int16 (D, `reader.length(L)`); row 0 is an
            empty one, where encoding begins.
        pairs: distinct (image row, history row), int64 (P, 2).
    """

    def __init__(self, net: ActorCritic, tokens_length: int) -> None:
        self.net = net
        self.device = next(net.parameters()).device
        self._length = net.reader.length(tokens_length)
        self._image_high = np.array(net.spec.image_high)
        self._frames = 0
        self.begin()

    def begin(self) -> None:
        """Forget every encoding, because the weights changed."""
        self.images = DistinctRows(self.net.spec.image_shape, np.uint8)
        self.histories = DistinctRows((self._length,), np.int16, unnamed=1)
        self.pairs = DistinctRows((2,), np.int64)
        self._lengths = np.zeros(1, np.int64)
        self._last_history: Int64 | None = None
        with torch.no_grad():
            self._words = self.net.dialogue.word_inputs()
        self._texts = torch.zeros(1024, self.net.dialogue.size, device=self.device)
        self._features = torch.zeros(4096, self.net.features, device=self.device)

    @torch.no_grad()
    def see(
        self,
        images: NDArray[np.uint8],
        tokens: NDArray[np.int16],
        ids: tuple[Int64, Int64] | None = None,
    ) -> tuple[Int64, Tensor]:
        """Take in one observation of every environment.

        Args:
            images: uint8 (E, H, W, C).
            tokens: int16 (E, L), 0-padded.
            ids: 64-bit ids of the images and of the histories, int64 (E,) each; made from the content if absent.

        Returns:
            int64 (E,) row of `pairs` of every environment, and their features (E, F).

        Raises:
            ObservationError: something is outside its bounds.
        """
        image_ids, history_ids = ids or (content_ids(images), content_ids(tokens))
        if not self.net.distinct:
            image_ids = np.arange(self._frames, self._frames + len(images))
            self._frames += len(images)
        image_rows, fresh = self.images.add(image_ids, images)
        if (images[fresh] > self._image_high).any():
            raise ObservationError(
                f"image: a cell exceeds the bounds {tuple(self.net.spec.image_high)} of its channels"
            )
        history_rows = self._hear(history_ids, tokens)
        pairs = np.stack((image_rows, history_rows), 1)
        rows, fresh = self.pairs.add(image_rows << 32 | history_rows, pairs)
        if len(fresh):
            self._perceive(pairs[fresh])
        return rows, self._features[torch.from_numpy(rows).to(self.device)]

    def _perceive(self, pairs: Int64) -> None:
        """Compute the features of the pairs last added, int64 (P, 2)."""
        begin, self._features = self.pairs.size - len(pairs), _with_room(self._features, self.pairs.size)
        image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
        history_rows, text_index = np.unique(pairs[:, 1], return_inverse=True)
        prepared = self.net.prepare(self.move(self.images.data[image_rows]))
        texts = self._texts[self.move(history_rows)]
        features = self.net.perceive(prepared, texts, self.move(image_index), self.move(text_index))
        self._features[begin : self.pairs.size] = features

    def _read(self, tokens: NDArray[np.int16]) -> NDArray[np.int16]:
        """The engine's tokens, once checked, as the words the network knows."""
        last = self.net.spec.vocabulary_size - 1
        for got in (int(tokens.min()), int(tokens.max())):
            if not 0 <= got <= last:
                raise ObservationError(f"tokens: got {got}, expected ids from 0 to {last}")
        return self.net.reader.read(tokens)

    def _hear(self, ids: Int64, tokens: NDArray[np.int16]) -> Int64:
        """Row of every history, int64 (E,); new ones are encoded, from where the same environment was if possible."""
        before = self.histories.size
        rows, fresh = self.histories.add(ids, tokens, self._read)
        if len(fresh):
            words: NDArray[Any] = self.histories.data[before:]
            lengths = np.count_nonzero(words, axis=1)
            parents = np.zeros_like(fresh) if self._last_history is None else self._last_history[fresh]
            known = self._lengths[parents]
            same = self.histories.data[parents] == words
            prefix = (same | (np.arange(self._length) >= known[:, None])).all(axis=1)
            parents, known = np.where(prefix, parents, 0), np.where(prefix, known, 0)
            self._lengths = np.concatenate((self._lengths, lengths))
            self._texts = _with_room(self._texts, self.histories.size)
            self._texts[before : self.histories.size] = self._encode(words, parents, known, lengths - known)
        self._last_history = rows
        return rows

    def _encode(self, words: NDArray[np.int16], parents: Int64, known: Int64, new: Int64) -> Tensor:
        """Encode histories given the row and length of the known beginning and the number of new words of each."""
        if not known.any():
            tree = prefix_tree(words)
            states: Tensor = self.net.dialogue(*self.move_tree(tree))
            return states[self.move(tree.leaves)]
        order = np.argsort(-new, kind="stable")
        columns = known[order, None] + np.arange(new.max())
        suffix = np.take_along_axis(words[order].astype(np.int64), np.minimum(columns, self._length - 1), 1)
        texts = self._texts[self.move(parents[order])]
        encoded = self.net.dialogue.extend(texts, self.move(suffix), new[order].tolist(), self._words)
        return torch.empty_like(encoded).index_copy_(0, self.move(order), encoded)

    def move(self, array: NDArray[Any]) -> Tensor:
        """The array as a tensor on the network's device."""
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)

    def move_tree(self, tree: PrefixTree) -> tuple[Tensor, Tensor, list[int]]:
        """Tokens, parents and offsets of a tree, as an encoder of dialogues takes them."""
        return self.move(tree.tokens), self.move(tree.parents), tree.offsets


def _with_room(table: Tensor, rows: int) -> Tensor:
    """The table itself, or a copy with more rows, so that `rows` fit."""
    if rows <= len(table):
        return table
    return torch.cat((table, table.new_zeros(rows, table.shape[1])))
