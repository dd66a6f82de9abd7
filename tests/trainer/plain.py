"""Histories encoded one by one with PyTorch's own layers, to compare the streamed encoding with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from socialai_dsl.trainer.nets.dialogue import DialogueEncoder, GruEncoder, HeardWords
from socialai_dsl.trainer.nets.lines import HeardOrder, Together


def encode(dialogue: DialogueEncoder, tokens: np.ndarray) -> Tensor:
    """One history, int (L,) padded with 0, from its first word; (dialogue.size,)."""
    words = torch.from_numpy(tokens[tokens > 0].astype(np.int64))
    if isinstance(dialogue, Together):
        return torch.cat([encode(one, tokens) for one in dialogue.each])
    if isinstance(dialogue, HeardOrder):
        return sum_in_order(dialogue, words.tolist())
    assert isinstance(dialogue, GruEncoder)
    weight = dialogue.embedding.weight
    state = dialogue.gru(dialogue.embedding(words))[1][0] if len(words) else weight.new_zeros(dialogue.hidden)
    if not isinstance(dialogue, HeardWords):
        return state
    heard = torch.tensor([float(w in words) for w in range(len(weight))], dtype=weight.dtype)
    return torch.cat((state, heard))


def sum_in_order(dialogue: HeardOrder, words: list[int]) -> Tensor:
    """The sum of each word's products with the word before it and with its place."""
    order = dialogue.pairs.new_zeros(dialogue.size)
    before = 0
    for depth, word in enumerate(words):
        if before:
            order = order + dialogue.pairs[before, 0] * dialogue.pairs[word, 1]
        order = order + dialogue.places[min(depth, dialogue.PLACES - 1)] * dialogue.placed[word]
        before = word
    return order
