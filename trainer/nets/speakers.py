"""The network `speakers`: who said what, and whose word counts."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

import torch
from torch import Tensor, nn

from socialai_dsl.vocabulary import COLORS, words
from trainer.nets.base import NetSpec
from trainer.nets.dialogue import DialogueEncoder, PrefixTree
from trainer.nets.fast import Cells, FastNet

_COLOR: Final = 1
"""The channel of colours."""


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
        nn.Module.__init__(self)
        size = len(vocabulary)
        # No word of a text begins so; the first two ids are padding and the unknown word.
        marks = [number for number, word in enumerate(vocabulary) if number > 1 and word[:1] == "<"]
        if not marks:
            raise ValueError(
                "net: speakers needs to know who speaks, and no token marks it; play the scenario with +marked, or set "
                "`observe: {lines: marked}`"
            )
        ids = {word: number for number, word in enumerate(vocabulary)}
        self.hidden, self.speakers = hidden, len(marks)
        speaker_of, named = torch.full((2, size), -1).unbind()
        for speaker, mark in enumerate(marks):
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


class SpeakersNet(FastNet):
    """`FastNet`, where a word counts by who said it.

    A word scales the cells that have a code (`mentions`) only in its speaker's last line, and by how far the speaker is
    trusted: any speaker, and one whom another has named. So one who says something else each time does not light up
    everything.

    Two biases are given by hand: the names of colours (`lexicon`, which a subclass can set to 0), and that `trust` may
    depend on being named by another speaker. What follows from either is learnt.

    Attributes:
        lexicon: how much the name of a colour scales the cells of that colour at first; 0: to be learnt.
        trust: of a speaker's last line, and how much more of one whom another has named.
        lines: (V, S, width), a layer over the words by who said them.
    """

    lexicon = 2.0
    SWAY = 5.0  # times `trust`: two numbers that decide about every word have to move faster than the weights of one
    word_rows = ("mentions", "lines", "dialogue.summed")
    dialogue: HeardSpeakers  # type: ignore[assignment]

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        super().__init__(spec, width)
        self.dialogue = HeardSpeakers(spec.vocabulary)
        self.trust = nn.Parameter(torch.tensor([1.0, 0.0]) / self.SWAY)
        self.lines = nn.Parameter(word_weights(spec.vocabulary_size, self.dialogue.speakers, width))
        self.chosen = nn.Linear(self.dialogue.speakers, width, bias=False)
        ids = {word: number for number, word in enumerate(spec.vocabulary)}
        with torch.no_grad():
            for code, color in enumerate(COLORS):
                if color in ids:
                    self.mentions[ids[color], _COLOR, code] = self.lexicon

    def perceive(self, prepared: Cells, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        used, history = torch.unique(text_index, return_inverse=True)
        state, said, last, named = self.dialogue.parts(text.index_select(0, used))  # (S, ...) each
        trust = self.SWAY * self.trust
        heard = torch.einsum("sn,snv->sv", trust[0] + trust[1] * named, last)
        spoken = self.words(state) + self.chosen(named) + torch.einsum("snv,vnw->sw", said, self.lines)
        return self.read(prepared, state, heard, spoken, image_index, history)


def word_weights(words: int, speakers: int, width: int) -> Tensor:
    """Weights (V, S, width) of as many inputs, as large at first as those of PyTorch's linear layers."""
    return torch.randn(words, speakers, width) / sqrt(3 * words * speakers)
