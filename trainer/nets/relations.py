"""The network `relations`: one that combines what it sees with what was said, and words with each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from trainer.nets.base import NetSpec
from trainer.nets.dialogue import HeardWords, PrefixTree
from trainer.nets.fast import Cells, FastNet
from trainer.nets.sight import MapSight, Sight


class HeardLines(HeardWords):
    """The encoding of `HeardWords`, then sums over the words in their order.

    Every word adds the product of its own embedding with that of the word before it, and one with that of its place. So
    the sum depends on the order of the words, and the gradient reaches each word from the first update on, however much
    was said since.
    """

    PLACES = 64

    def __init__(self, vocabulary: Sequence[str], hidden: int = 128, order: int = 128) -> None:
        words = len(vocabulary)
        super().__init__(words, hidden)
        self.order = order
        self.pairs = nn.Parameter(torch.randn(words, 2, order) * 0.6)  # as the word before, and as the word
        self.placed = nn.Parameter(torch.randn(words, order) * 0.6)
        self.places = nn.Parameter(torch.randn(self.PLACES, order) * 0.6)
        self.size = hidden + words + order

    def parts(self, encodings: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Encodings (D, size) as recurrent states (D, hidden), the words heard (D, V), and sums over the order
        (D, order).
        """
        state, heard, order = torch.split(encodings, [self.hidden, len(self.pairs), self.order], 1)
        return state, heard, order

    def forward(self, tree: PrefixTree) -> Tensor:
        """See `DialogueEncoder.forward`."""
        base = super().forward(tree)
        words = torch.cat((tree.tokens.new_zeros(1), tree.tokens))  # the last of each state
        before = self.pairs[words[tree.parents], 0] * (tree.parents > 0)[:, None]
        depth = torch.repeat_interleave(torch.diff(torch.tensor(tree.offsets, device=words.device)))
        added = before * self.pairs[tree.tokens, 1]
        added = added + self.places[depth.clamp(max=self.PLACES - 1)] * self.placed[tree.tokens]
        sums = [added.new_zeros(1, self.order)]
        for first, behind in pairwise(tree.offsets):
            level = tree.parents[first:behind] - (first - len(sums[-1]) + 1)
            sums.append(sums[-1].index_select(0, level) + added[first:behind])
        return torch.cat((base, torch.cat(sums)[tree.leaves]), 1)


class RelationsNet(FastNet):
    """`FastNet` with relations: what is seen is compared, words are taken together, cells are read twice.

    Each part makes a combination of two perceptions, which a network would first have to find without any gradient on
    the way, a perception of its own. A subclass may have fewer of them, see `parts`:

    * `map`: things in view are compared with those seen before (`MapSight`).
    * `order`: a layer reads the words in their order (`HeardLines`).
    * `products`: products of two sums over the words heard say what words mean together, as a tone and a remark do.
    * `again`: what was seen and said decides what is looked for in a second reading of the cells.

    Attributes:
        forms: (V, 2, F), the two sums of each product.
        again: (V, channels, 256, G), how much a word scales the cells that have a code in the second reading; each
            part of it has a gate.
    """

    parts: frozenset[str] = frozenset(("map", "order", "products", "again"))
    FORMS, GATES = 32, 4
    sight_class: type[Sight] = MapSight
    word_rows = (*FastNet.word_rows, "again", "forms", "dialogue.pairs", "dialogue.placed")
    dialogue: HeardLines

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        if "map" not in self.parts:
            self.sight_class = Sight
        super().__init__(spec, width)
        self.dialogue = HeardLines(spec.vocabulary)
        words, k = spec.vocabulary_size, self.kind_size
        if "order" in self.parts:
            read = nn.Linear(self.dialogue.order, 256), nn.ReLU(), nn.Linear(256, width), nn.ReLU()
            self.past = nn.Sequential(nn.ReLU(), *read)
        if "products" in self.parts:
            self.forms = nn.Parameter(torch.randn(words, 2, self.FORMS) * 0.4)
            self.meant = nn.Linear(self.FORMS, width)
            self.meaning = nn.Linear(self.FORMS, 1 + self.GATES, bias=False)
            nn.init.zeros_(self.meaning.weight)
        if "again" in self.parts:
            self.think = nn.Sequential(
                nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU()
            )
            self.gate = nn.Linear(width, 2 * k + self.GATES)
            self.again = nn.Parameter(torch.zeros(words, len(self.channels), 256, self.GATES))
            self.second = nn.Linear(self.cells.in_features, width)
            self.join = nn.Linear(2 * width, width)

    def perceive(self, prepared: Cells, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        used, history = torch.unique(text_index, return_inverse=True)
        state, heard, order = self.dialogue.parts(text.index_select(0, used))  # (S, ...) each
        gates = heard.new_zeros(len(heard), 1 + self.GATES)
        spoken, past = self.words(state), heard.new_zeros(len(heard), self.features)  # (S, width)
        if "order" in self.parts:
            past = past + self.past(order)
        if "products" in self.parts:
            forms = torch.einsum("sv,vaf->saf", heard, self.forms).prod(1)  # (S, FORMS)
            gates, past = self.meaning(forms), past + torch.relu(self.meant(forms))
        channel = torch.arange(len(self.channels), device=text.device)
        kinds = self.channels[channel, prepared.kinds].sum(1)  # (C, kind_size)
        mentioned = heard @ self.mentions[:, channel, prepared.kinds].sum(2) * (1 + gates[:, :1])  # (S, C)
        scale, shift = self.film(state)[:, None].chunk(2, 2)
        scale = scale + mentioned[:, :, None]  # (S, C, kind_size)
        read = torch.relu(torch.addcmul(kinds + shift, kinds, scale))
        kind_of = prepared.kind_of.index_select(0, image_index)  # (P, cells)
        rows = (history[:, None] * len(kinds) + kind_of).flatten()
        cells = read.flatten(0, 1).index_select(0, rows).view(len(kind_of), -1)
        first, past = torch.relu(self.cells(cells) + spoken[history]), past[history]
        if "again" not in self.parts:
            return first + past
        thought = self.think(torch.cat((first, past), 1))  # (P, width)
        scale, shift, weights = self.gate(thought).split((self.kind_size, self.kind_size, self.GATES), 1)
        weights = torch.tanh(weights + gates[history, 1:])  # (P, GATES)
        named_again = self.again[:, channel, prepared.kinds].sum(2)  # (V, C, GATES)
        again = torch.einsum("sv,vcg->scg", heard, named_again)  # (S, C, GATES)
        found = again.flatten(0, 1).index_select(0, rows).view(*kind_of.shape, -1)  # (P, cells, GATES)
        looked_for = (found * weights[:, None]).sum(2, keepdim=True)
        seen = kinds.index_select(0, kind_of.flatten()).view(*kind_of.shape, -1)
        seen = torch.relu(seen * (1 + scale[:, None] + looked_for) + shift[:, None])
        second = torch.relu(self.second(seen.flatten(1)))
        return torch.relu(self.join(torch.cat((first + thought, second), 1))) + past
