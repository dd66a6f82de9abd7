"""This module runs a network forward one step at a time, processing each distinct frame of a rollout once."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer.crew import SOLO, Crew
from trainer.distinct import DistinctRows, Int64, content_ids, history_lengths, prefix_tree
from trainer.errors import ObservationError
from trainer.nets import ActorCritic


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
        crew: Crew = SOLO,
    ) -> tuple[Int64, Tensor]:
        """Take in one observation of every environment.

        Args:
            images: uint8 (E, H, W, C).
            tokens: int16 (E, L), 0-padded.
            ids: 64-bit ids of the images and of the histories, int64 (E,) each; made from the content if absent.
            crew: who computes the features.

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
            self._perceive(pairs[fresh], crew)
        return rows, self._features[torch.from_numpy(rows).to(self.device)]

    def _perceive(self, pairs: Int64, crew: Crew) -> None:
        """Compute the features of the pairs last added."""
        begin, self._features = self.pairs.size - len(pairs), _with_room(self._features, self.pairs.size)
        # Those of an image lie together, so that few images are in two shares.
        order = torch.from_numpy(np.argsort(pairs[:, 0], kind="stable"))

        @torch.no_grad()
        def perceive(share: Tensor) -> None:
            chosen = pairs[share.numpy()]
            image_rows, image_index = np.unique(chosen[:, 0], return_inverse=True)
            history_rows, text_index = np.unique(chosen[:, 1], return_inverse=True)
            prepared = self.net.prepare(self._move(self.images.data[image_rows]))
            texts = self._texts[self._move(history_rows)]
            features = self.net.perceive(prepared, texts, self._move(image_index), self._move(text_index))
            self._features[begin + share.to(self.device)] = features

        shared = self.net.shared_from is not None and len(pairs) >= self.net.shared_from
        crew.map(perceive, crew.shares(order) if shared else [order])

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
            lengths = history_lengths(words)
            parents = (
                np.zeros(len(fresh), np.int64) if self._last_history is None else self._last_history[fresh]
            )
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
            states: Tensor = self.net.dialogue(
                self._move(tree.tokens), self._move(tree.parents), tree.offsets
            )
            return states[self._move(tree.leaves)]
        order = np.argsort(-new, kind="stable")
        columns = known[order, None] + np.arange(new.max())
        suffix = np.take_along_axis(words[order].astype(np.int64), np.minimum(columns, self._length - 1), 1)
        texts = self._texts[self._move(parents[order])]
        encoded = self.net.dialogue.extend(texts, self._move(suffix), new[order].tolist(), self._words)
        return torch.empty_like(encoded).index_copy_(0, self._move(order), encoded)

    def _move(self, array: NDArray[np.generic]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)


def _with_room(table: Tensor, rows: int) -> Tensor:
    """The table itself, or a copy with at least twice its rows, so that `rows` fit."""
    if rows <= len(table):
        return table
    grown = table.new_zeros(max(rows, 2 * len(table)), table.shape[1])
    grown[: len(table)] = table
    return grown
