"""Readers: from the engine's tokens to the words that a dialogue encoder knows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

_MARKS: Final = 2  # the engine's ids 0 and 1 stand for padding and for an unknown word and spell nothing


class Reader:
    """Reads histories as the engine writes them: every word is known by the engine's id.

    Attributes:
        words: spelling of each id; 0 pads.
    """

    def __init__(self, vocabulary: Sequence[str]) -> None:
        self.words = tuple(vocabulary)

    def length(self, tokens: int) -> int:
        """The number of words in the longest history read from a buffer of this number of tokens."""
        return tokens

    def read(self, tokens: NDArray[np.int16]) -> NDArray[np.int16]:
        """0-padded histories (E, L) with the engine's ids to 0-padded histories (E, `length(L)`) with this reader's."""
        return tokens


class LetterReader(Reader):
    """Reads histories as the agents of the SocialAI 1.0 paper do.

    A word is a maximal run of the letters a to z: digits and apostrophes vanish and may part or delete a word. Before
    the first line every history has the sentence that the paper's environments begin each episode with. Ids are given
    in the order of first appearance, from 1 on: first that sentence, then the vocabulary.

    Source: SocialAI 1.0, released code of the agents; `docs/agents.md` says what is different.

    Raises:
        ValueError: there are more words than the paper's agents have room for.
    """

    PREAMBLE: Final = "This is what you hear."
    CAPACITY: Final = 100
    """Ids there are, the padding's included."""

    def __init__(self, vocabulary: Sequence[str]) -> None:
        opening = _runs(self.PREAMBLE)
        spelt = [[] if mark < _MARKS else _runs(word) for mark, word in enumerate(vocabulary)]
        words = dict.fromkeys((*opening, *(word for words in spelt for word in words)))
        if len(words) >= self.CAPACITY:
            raise ValueError(
                f"vocabulary: got {len(words)} words of letters, expected at most {self.CAPACITY - 1}, as many as the "
                "paper's agents can tell apart; the networks `paper` and `fast` have no such limit"
            )
        super().__init__(("", *words))
        ids = {word: number for number, word in enumerate(self.words)}
        self._opening = np.array([ids[word] for word in opening], np.int16)
        self._spelt = np.zeros((len(spelt), max(map(len, spelt), default=0)), np.int16)
        for row, runs in zip(self._spelt, spelt, strict=True):
            row[: len(runs)] = [ids[word] for word in runs]

    def length(self, tokens: int) -> int:
        """See `Reader.length`."""
        return len(self._opening) + tokens * self._spelt.shape[1]

    def read(self, tokens: NDArray[np.int16]) -> NDArray[np.int16]:
        """See `Reader.read`."""
        opening = np.broadcast_to(self._opening, (len(tokens), len(self._opening)))
        spelt = np.concatenate((opening, self._spelt[tokens].reshape(len(tokens), -1)), axis=1)
        words_first = np.argsort(spelt == 0, axis=1, kind="stable")
        return np.take_along_axis(spelt, words_first, axis=1)


def _runs(text: str) -> list[str]:
    return re.findall("[a-z]+", text.lower())
