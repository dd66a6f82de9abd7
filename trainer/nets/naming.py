"""Which word goes with which kind of thing, by what was in view when it was said. Nothing in it is learnt."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.trainer.nets.sight import ORIENTATION, Int64, MapSight
from socialai_dsl.vocabulary import WALL


class NamingSight(MapSight):
    """`MapSight`, with the word that each thing in view is called by as one more channel.

    It counts in how many of the steps with new lines each word was heard and each kind of thing was in view. A kind is
    called by the word whose presence makes it most more likely in view than it is anyway; of several the one heard
    first. So a thing that is always in view has no name, and one that is marked now and then is called by what was
    said while it was.
    """

    KINDS: Final = 97
    """Kinds are told apart by their code modulo this."""

    _LEAST = 0.01  # by how much a word has to make a kind more likely
    _EARLIER = 1e-5  # what a place earlier in the dialogue is worth, which decides between equals only

    def __init__(self, shape: tuple[int, int, int], high: tuple[int, ...], words: int) -> None:
        """See `Sight`; the first 256 words can be names."""
        super().__init__(shape, high, words)
        self.words = min(words, 256)
        height, width, channels = self.shape
        self.shape, self.high = (height, width, channels + 1), (*self.high, self.words - 1)
        # The map's part; how much was heard; steps with a word and a kind, with a word, with a kind, and all.
        sizes = self.size, 1, self.KINDS * self.words, self.words, self.KINDS, 1
        *self._kept, self.size = np.cumsum(sizes).tolist()

    def look(
        self, images: NDArray[np.uint8], tokens: NDArray[np.int16], seen: Int64
    ) -> tuple[NDArray[np.uint8], Int64]:
        """See `Sight.look`."""
        of_map, length, both, said, shown, steps = np.split(seen, self._kept, 1)
        related, of_map = super().look(images, tokens, of_map)
        envs, cells = np.nonzero(images[..., 0].reshape(len(images), -1) > WALL)
        codes = images.reshape(*related.shape[:1], -1, images.shape[-1])[envs, cells].astype(np.int64)
        codes[:, ORIENTATION] = 0
        kinds = codes @ self._digits % self.KINDS
        place, now = np.arange(tokens.shape[1]), np.count_nonzero(tokens, 1)[:, None]
        rows, columns = np.nonzero((tokens > 0) & (tokens < self.words))
        first = np.full(said.shape, len(place))  # (E, words), where each word stands first
        first[rows[::-1], tokens[rows, columns][::-1]] = columns[::-1]
        rows, columns = np.nonzero((place >= length) & (place < now) & (tokens < self.words))
        new, present = np.zeros_like(said), np.zeros_like(shown)
        new[rows, tokens[rows, columns]] = 1
        present[envs, kinds] = 1
        talk = new.max(1, keepdims=True)  # (E, 1), whether anything was heard
        both = both.reshape(len(both), self.KINDS, self.words) + present[:, :, None] * new[:, None]
        said, shown, steps = said + new, shown + present * talk, steps + talk
        likely = shown[envs, kinds] / np.maximum(steps[envs, 0], 1)
        more = both[envs, kinds] / np.maximum(said[envs], 1) - likely[:, None]  # (N, words)
        best = (more - self._EARLIER * first[envs]).argmax(1)
        called = np.zeros((len(images), related[0, ..., 0].size, 1), np.uint8)
        called[envs, cells, 0] = np.where(more.max(1, initial=0) > self._LEAST, best, 0)
        kept = of_map, now, both.reshape(len(both), -1), said, shown, steps
        return np.concatenate((related, called.reshape(*related.shape[:3], 1)), 3), np.concatenate(kept, 1)
