"""Encoders of the dialogue that keep what a recurrent state blurs: the order of the words, and who said them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt

import torch
from torch import Tensor, nn

from socialai_dsl.trainer.nets.dialogue import DialogueEncoder, HeardWords, PrefixTree
from socialai_dsl.vocabulary import words


class Together(DialogueEncoder):
    """The encodings of several side by side; what scales the cells is the state of the first."""

    def __init__(self, first: HeardWords | HeardSpeakers, *others: DialogueEncoder) -> None:
        super().__init__()
        self.hidden = first.hidden
        self.each = nn.ModuleList((first, *others))
        self._sizes = [first.size, *(other.size for other in others)]
        self.size = sum(self._sizes)

    def split(self, encodings: Tensor) -> tuple[Tensor, ...]:
        """Encodings (D, size) as those of each, (D, its size)."""
        return torch.split(encodings, self._sizes, 1)

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        return torch.cat([one(tree) for one in self.each], 1)


class HeardOrder(DialogueEncoder):
    """Sums over the words in their order.

    Every word adds the product of its own embedding with that of the word before it, and one with that of its place. So
    the sum depends on the order of the words, and the gradient reaches each word from the first update on, however much
    was said since.
    """

    PLACES = 64

    def __init__(self, vocabulary_size: int, size: int = 128) -> None:
        super().__init__()
        self.size = size
        self.pairs = nn.Parameter(
            torch.randn(vocabulary_size, 2, size) * 0.6
        )  # as the word before, and as the word
        self.placed = nn.Parameter(torch.randn(vocabulary_size, size) * 0.6)
        self.places = nn.Parameter(torch.randn(self.PLACES, size) * 0.6)

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        words = torch.cat((tree.tokens.new_zeros(1), tree.tokens))  # the last of each state
        before = self.pairs[words[tree.parents], 0] * (tree.parents > 0)[:, None]
        depth = torch.repeat_interleave(torch.diff(torch.tensor(tree.offsets, device=words.device)))
        added = before * self.pairs[tree.tokens, 1]
        added = added + self.places[depth.clamp(max=self.PLACES - 1)] * self.placed[tree.tokens]
        sums = [added.new_zeros(1, self.size)]
        for first, behind in pairwise(tree.offsets):
            level = tree.parents[first:behind] - (first - len(sums[-1]) + 1)
            sums.append(sums[-1].index_select(0, level) + added[first:behind])
        return torch.cat(sums)[tree.leaves]


class HeardSpeakers(DialogueEncoder):
    """What each speaker has said and said last, and whether another has named it: words without order.

    Tokens mark who speaks (`observe.lines: marked`). Nothing is recurrent, so nothing is forgotten, and an answer has
    the same features whatever was said since.

    Attributes:
        speakers: how many there are, by the marks in the vocabulary.
        speaker_of: int64 (V,), the speaker that a token marks. named: int64 (V,), the speaker whose name ends with the
            word. Both -1 for none.
        summed: (V, S, hidden), what a word means in the mouth of each speaker.
    """

    def __init__(self, vocabulary: Sequence[str], hidden: int = 128) -> None:
        super().__init__()
        size, found = len(vocabulary), marks(vocabulary)
        ids = {word: number for number, word in enumerate(vocabulary)}
        self.hidden, self.speakers = hidden, len(found)
        speaker_of, named = torch.full((2, size), -1).unbind()
        for speaker, mark in enumerate(found):
            speaker_of[mark] = speaker
            named[[ids[word] for word in words(vocabulary[mark])[-1:] if word in ids]] = speaker
        self.speaker_of: Tensor
        self.register_buffer("speaker_of", speaker_of, persistent=False)
        self.named: Tensor
        self.register_buffer("named", named, persistent=False)
        self.summed = nn.Parameter(word_weights(size, self.speakers, hidden))
        self._sizes = (hidden, self.speakers * size, self.speakers * size, self.speakers)
        self.size = sum(self._sizes)

    def parts(self, encodings: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Encodings (D, size) as states (D, hidden), the words of each speaker and those of its last line (D, S, V),
        and who was named by another (D, S).
        """
        state, said, last, named = torch.split(encodings, list(self._sizes), 1)
        shape = (len(encodings), self.speakers, len(self.speaker_of))
        return state, said.view(shape), last.view(shape), named

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        said, last, named = self._read(tree.words)
        state = torch.tanh(torch.einsum("dsv,vsh->dh", said, self.summed))
        return torch.cat((state, said.flatten(1), last.flatten(1), named), 1)

    @torch.no_grad()
    def _read(self, heard: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Of histories (D, L) the words of each speaker, those of its last line (D, S, V), and who was named (D, S)."""
        count, length = heard.shape
        nobody = self.speakers
        said, last = self.summed.new_zeros(2, count, nobody + 1, len(self.speaker_of)).unbind()
        named = self.summed.new_zeros(count, nobody + 1)
        place = torch.arange(length, device=heard.device).expand_as(heard)
        marked = self.speaker_of[heard]
        starts = torch.where(marked >= 0, place, -1)
        begins = starts.cummax(1).values if length else starts  # where the line of each word begins
        who = torch.where(begins >= 0, marked.gather(1, begins.clamp(min=0)), nobody)
        latest = torch.full((count, nobody + 1), -1, device=heard.device)
        latest.scatter_reduce_(1, torch.where(marked >= 0, marked, nobody), starts, "amax")
        rows = torch.arange(count, device=heard.device)[:, None].expand_as(heard)
        speaking = (heard > 0) & (marked < 0)
        speaker = torch.where(speaking, who, nobody)
        said[rows, speaker, heard] = 1
        last[rows, torch.where(begins == latest.gather(1, who), speaker, nobody), heard] = 1
        whom = self.named[heard]
        named[rows, torch.where((speaker < nobody) & (whom >= 0) & (whom != who), whom, nobody)] = 1
        return said[:, :nobody], last[:, :nobody], named[:, :nobody]


def marks(vocabulary: Sequence[str]) -> list[int]:
    """The tokens that mark who speaks; no word of a text begins as they do, and the first two ids are no words."""
    return [number for number, word in enumerate(vocabulary) if number > 1 and word[:1] == "<"]


def word_weights(words: int, speakers: int, width: int) -> Tensor:
    """Weights (V, S, width) of as many inputs, as large at first as those of PyTorch's linear layers."""
    return torch.randn(words, speakers, width) / sqrt(3 * words * speakers)
