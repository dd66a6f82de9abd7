"""Features of frames while acting; each distinct frame is computed once.

Of 8,192 frames of a rollout a few hundred images and histories are distinct. Both are kept in tables; a history is
encoded once, and so are the features of a pair of the two.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from socialai_dsl.trainer.errors import ObservationError
from socialai_dsl.trainer.extensions import require_shape
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.nets.dialogue import prefix_tree
from socialai_dsl.trainer.nets.sight import require_bounds

Int64 = NDArray[np.int64]


def content_ids(rows: NDArray[np.generic]) -> Int64:
    """64-bit ids, int64 (E,), equal for equal rows of an array (E, ...) and, up to 2**-64, only for them."""
    digests = (hashlib.blake2b(row.tobytes(), digest_size=8).digest() for row in rows)
    return np.frombuffer(b"".join(digests), np.int64)


class DistinctRows:
    """A growing table of rows, each stored once, addressed by a caller's 64-bit id.

    Attributes:
        data: the rows held, (K, ...); the first is all zeros and has no id.
    """

    def __init__(self, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
        self.data: NDArray[Any] = np.zeros((1, *shape), dtype)
        self._row_of: dict[int, int] = {}

    def add(
        self, ids: Int64, values: NDArray[Any], read: Callable[[NDArray[Any]], NDArray[Any]] = np.asarray
    ) -> tuple[Int64, Int64]:
        """Store the rows of `values` (E, ...) whose id is new, as `read` makes them; what is held is not read again.

        Returns:
            rows: int64 (E,), where each given row is held.
            fresh: int64 (K,), indices into `values` of those just stored, which are the last K of `data`.
        """
        unique, first, inverse = np.unique(ids, return_index=True, return_inverse=True)
        held = len(self.data)
        rows = np.array([self._row_of.setdefault(key, len(self._row_of) + 1) for key in unique.tolist()])
        fresh = first[rows >= held]
        if len(fresh):
            self.data = np.concatenate((self.data, read(values[fresh])))
        return rows[inverse], fresh


class Actor:
    """A network together with what it has already computed under its present weights.

    `begin` forgets all of that and must be called whenever the weights changed. Between two calls of `begin` the
    tables only grow, and rows in them are never changed.

    Attributes:
        images: distinct images as the network sees them, uint8 (I, *sight.shape).
        histories: distinct 0-padded histories as the network reads them, int16 (D, `reader.length(L)`).
        pairs: distinct (image row, history row), int64 (P, 2).
    """

    def __init__(self, net: ActorCritic, tokens_length: int) -> None:
        self.net = net
        self.device = next(net.parameters()).device
        self._length = net.reader.length(tokens_length)
        self.begin()

    @torch.no_grad()
    def begin(self) -> None:
        """Forget every encoding, because the weights changed."""
        self.images = DistinctRows(self.net.sight.shape, np.uint8)
        self.histories = DistinctRows((self._length,), np.int16)
        self.pairs = DistinctRows((2,), np.int64)
        self._texts = torch.zeros(1, self.net.dialogue.size, device=self.device)  # (D, size)
        self._features = torch.zeros(1, self.net.features, device=self.device)  # (P, F)

    @torch.no_grad()
    def see(
        self, images: NDArray[np.uint8], tokens: NDArray[np.int16], ids: tuple[Int64, Int64] | None = None
    ) -> tuple[Int64, Tensor]:
        """Take in one observation of every environment.

        Args:
            images: as the network's sight made them, uint8 (E, *sight.shape).
            tokens: int16 (E, L), 0-padded.
            ids: 64-bit ids of the images and of the histories, int64 (E,) each; made from the content if absent.

        Returns:
            int64 (E,) row of `pairs` of every environment, and their features (E, F).

        Raises:
            ObservationError: something is outside its bounds.
        """
        image_ids, history_ids = ids or (content_ids(images), content_ids(tokens))
        if not self.net.distinct:
            image_ids = np.arange(len(images)) + len(self.images.data)  # each image is new
        image_rows, fresh = self.images.add(image_ids, images)
        require_bounds(images[fresh], self.net.sight.high)
        history_rows = self._hear(history_ids, tokens)
        pairs = np.stack((image_rows, history_rows), 1)
        rows, fresh = self.pairs.add(image_rows << 32 | history_rows, pairs)
        if len(fresh):
            self._features = torch.cat((self._features, self._perceive(pairs[fresh])))
        return rows, self._features[self.move(rows)]

    def _perceive(self, pairs: Int64) -> Tensor:
        """Features (P, F) of pairs, int64 (P, 2)."""
        image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
        history_rows, text_index = np.unique(pairs[:, 1], return_inverse=True)
        prepared = self.net.prepare(self.move(self.images.data[image_rows]))
        texts = self._texts[self.move(history_rows)]
        found = self.net.perceive(prepared, texts, self.move(image_index), self.move(text_index))
        require_shape("net: the result of perceive", found, (len(pairs), self.net.features))
        return found

    def _hear(self, ids: Int64, tokens: NDArray[np.int16]) -> Int64:
        """Row of every history, int64 (E,); new ones are encoded."""
        rows, fresh = self.histories.add(ids, tokens, self._read)
        if len(fresh):
            tree = prefix_tree(self.histories.data[-len(fresh) :], self.device)
            self._texts = torch.cat((self._texts, self.net.dialogue(tree)))
        return rows

    def _read(self, tokens: NDArray[np.int16]) -> NDArray[np.int16]:
        """The engine's tokens, once checked, as the words the network knows."""
        last = self.net.spec.vocabulary_size - 1
        for got in (int(tokens.min()), int(tokens.max())):
            if not 0 <= got <= last:
                raise ObservationError(f"tokens: got {got}, expected ids from 0 to {last}")
        return self.net.reader.read(tokens)

    def move(self, array: NDArray[Any]) -> Tensor:
        """The array as a tensor on the network's device."""
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)
