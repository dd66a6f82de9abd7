"""The network `relations`: one that combines what it sees with what was said, and words with each other."""

from __future__ import annotations

from typing import ClassVar, Final

import torch
from torch import Tensor, nn

from socialai_dsl.trainer.nets.base import NetSpec
from socialai_dsl.trainer.nets.dialogue import HeardWords
from socialai_dsl.trainer.nets.fast import Cells, FastNet
from socialai_dsl.trainer.nets.lines import HeardOrder, HeardSpeakers, Together, marks, word_weights
from socialai_dsl.trainer.nets.naming import NamingSight
from socialai_dsl.trainer.nets.sight import MapSight, Sight
from socialai_dsl.vocabulary import COLORS

_COLOR: Final = 1
"""The channel of colours."""


class RelationsNet(FastNet):
    """`FastNet` with relations: what is seen is compared, words are taken together.

    Each part makes a combination of two perceptions, which a network would first have to find without any gradient on
    the way, a perception of its own. A subclass may have fewer of them, see `parts`:

    * `map`: things in view are compared with those seen before, and what people face is told (`MapSight`).
    * `names`: with `map`, things are called by what was said while they looked so (`NamingSight`).
    * `kinds`: what each kind of cell in view means wherever it is, through a layer of its own.
    * `order`: a layer reads the words in their order (`HeardOrder`).
    * `pairs`: products of two sums over the words heard say what words mean together, as a tone and a remark do.
    * `where`: the places of what was mentioned are read by themselves, once for each of the products of `pairs`.
    * `speakers`: where tokens mark who speaks, a word counts in its speaker's last line, and by how far the speaker is
      trusted: any speaker, and one whom another has named (`HeardSpeakers`). So one who says something else each time
      does not light up everything.

    Two biases are given by hand: the names of colours (`lexicon`, which a subclass can set to 0), and that `trust` may
    depend on being named by another speaker. What follows from either is learnt.

    Attributes:
        lexicon: how much the name of a colour scales the cells of that colour at first; 0: to be learnt.
        partners: (V, SUMS, GATES), with `forms`, (V, SUMS), the sums whose products are the gates.
        trust: of a speaker's last line, and how much more of one whom another has named.
        lines: (V, S, width), a layer over the words by who said them.
    """

    parts: frozenset[str] = frozenset(("map", "names", "kinds", "order", "pairs", "where", "speakers"))
    lexicon = 2.0
    SUMS, GATES, LOOKS = 64, 8, 64
    STRESS = 6.0  # of what was mentioned against all else in view
    SWAY = 5.0  # times `trust`: two numbers that decide about every word have to move faster than the weights of one
    sight_class: type[Sight] = NamingSight
    _WORD_ROWS = (
        *("mentions", "lines", "forms", "partners", "dialogue.each.0.embedding.weight"),
        *("dialogue.each.0.summed", "dialogue.each.1.pairs", "dialogue.each.1.placed"),
    )
    _SPEAKER_AXES: ClassVar = {"lines": 1, "dialogue.each.0.summed": 1, "chosen.weight": 1}
    dialogue: Together  # type: ignore[assignment]

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        sight = NamingSight if "names" in self.parts else MapSight
        self.sight_class = sight if "map" in self.parts else Sight
        words, order = spec.vocabulary_size, HeardOrder(spec.vocabulary_size)
        self.speakers = len(marks(spec.vocabulary)) if "speakers" in self.parts else 0
        heard = HeardSpeakers(spec.vocabulary) if self.speakers else HeardWords(words)
        super().__init__(spec, width, Together(heard, *([order] if "order" in self.parts else [])))
        if self.speakers:
            self.trust = nn.Parameter(torch.tensor([1.0, 0.0]) / self.SWAY)
            self.lines = nn.Parameter(word_weights(words, self.speakers, width))
            self.chosen = nn.Linear(self.speakers, width, bias=False)
        if "kinds" in self.parts:
            self.looks = nn.Parameter(
                torch.randn(len(self.channels), 256, self.LOOKS) * len(self.channels) ** -0.5
            )
            self.alone = nn.Linear(self.LOOKS, width)
            self.together = nn.Linear(width, width)
        if "order" in self.parts:
            read = nn.Linear(order.size, 256), nn.ReLU(), nn.Linear(256, width), nn.ReLU()
            self.past = nn.Sequential(nn.ReLU(), *read)
        if "pairs" in self.parts:
            self.forms = nn.Parameter(torch.randn(words, self.SUMS) * self.SUMS**-0.5)
            self.partners = nn.Parameter(torch.randn(words, self.SUMS, self.GATES) * 0.05)
            self.meant = nn.Linear(self.GATES, width)
        if "where" in self.parts:
            height, ahead = spec.image_shape[:2]
            self.where = nn.Linear(height * ahead, self.GATES * width, bias=False)
            bound = (height * ahead * self.GATES) ** -0.5
            nn.init.uniform_(self.where.weight, -bound, bound)
        with torch.no_grad():
            for word, name in enumerate(spec.vocabulary):
                if name in COLORS:
                    self.mentions[word, _COLOR, COLORS.index(name)] = self.lexicon
        own = dict(self.named_parameters())
        self.word_rows = tuple(name for name in self._WORD_ROWS if name in own)
        self.speaker_axes = self._SPEAKER_AXES if self.speakers else {}

    def perceive(self, prepared: Cells, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        used, history = torch.unique(text_index, return_inverse=True)
        encodings, *order = self.dialogue.split(text.index_select(0, used))  # (S, ...) each
        state, heard, scales, spoken = self._heard(encodings)
        mentioned = scales @ prepared.summed(self.mentions, 1)  # (S, C)
        features = self.read(prepared, state, mentioned, spoken, image_index, history)
        if "kinds" in self.parts:
            looks = torch.relu(self.alone(torch.relu(prepared.summed(self.looks))))  # (C, width)
            looks = torch.relu(self.together(prepared.counts @ looks))  # (I, width)
            features = features + looks.index_select(0, image_index)
        past, gates = heard.new_zeros(len(heard), self.features), heard.new_ones(len(heard), self.GATES)
        if "order" in self.parts:
            past = past + self.past(*order)
        if "pairs" in self.parts:
            partners = (heard @ self.partners.flatten(1)).view(-1, self.SUMS, self.GATES)
            gates = torch.tanh(torch.einsum("sf,sfg->sg", heard @ self.forms, partners))
            past = past + torch.relu(self.meant(gates))
        if "where" in self.parts:
            kind_of = prepared.kind_of.index_select(0, image_index)  # (P, cells)
            rows = (history[:, None] * mentioned.shape[1] + kind_of).flatten()
            found = self.STRESS * mentioned.flatten().index_select(0, rows).view_as(kind_of)
            ways = self.where(found).view(len(found), self.GATES, -1)  # (P, GATES, width)
            features = features + torch.relu(torch.einsum("pg,pgw->pw", gates.index_select(0, history), ways))
        return features + past.index_select(0, history)

    def _heard(self, encodings: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Of encodings (S, size) the states (S, hidden), the words heard (S, V), how much each scales the cells that it
        mentions (S, V), and what is added to what is seen (S, width).
        """
        heard = self.dialogue.each[0]
        if isinstance(heard, HeardWords):
            state, words = heard.split(encodings)
            return state, words, words, self.words(state)
        assert isinstance(heard, HeardSpeakers)
        state, said, last, named = heard.parts(encodings)
        trust = self.SWAY * self.trust
        scales = torch.einsum("sn,snv->sv", trust[0] + trust[1] * named, last)
        spoken = self.words(state) + self.chosen(named) + torch.einsum("snv,vnw->sw", said, self.lines)
        return state, said.amax(1), scales, spoken


class SpeakersNet(RelationsNet):
    """`RelationsNet` with nothing but who said what, and whose word counts; it needs marked lines.

    From the reward alone it learns what `RelationsNet` with all of its parts was not seen to learn.
    """

    parts = frozenset(("speakers",))

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        if not marks(spec.vocabulary):
            raise ValueError(
                "net: speakers needs to know who speaks, and no token marks it; play the scenario with +marked, or set "
                "`observe: {lines: marked}`"
            )
        super().__init__(spec, width)
