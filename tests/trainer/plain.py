"""Histories encoded one by one with PyTorch's own layers, to compare the streamed encoding with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from trainer.nets.dialogue import DialogueEncoder, HeardWords
from trainer.nets.relations import HeardLines


def encode(dialogue: DialogueEncoder, tokens: np.ndarray) -> Tensor:
    """One history, int (L,) padded with 0, from its first word; (dialogue.size,)."""
    words = torch.from_numpy(tokens[tokens > 0].astype(np.int64))
    weight = dialogue.embedding.weight
    state = dialogue.gru(dialogue.embedding(words))[1][0] if len(words) else weight.new_zeros(dialogue.hidden)
    if not isinstance(dialogue, HeardWords):
        return state
    parts = [state, torch.tensor([float(w in words) for w in range(len(weight))], dtype=weight.dtype)]
    if isinstance(dialogue, HeardLines):
        parts += [*heard_lines(dialogue, words.tolist(), weight)]
    return torch.cat(parts)


def heard_lines(dialogue: HeardLines, words: list[int], like: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The sum over the words in their order, the words of each speaker, and who was named by another."""
    order = like.new_zeros(dialogue.order)
    said = like.new_zeros(dialogue.speakers, len(like))
    named = like.new_zeros(dialogue.speakers)
    before, speaking = 0, -1
    for depth, word in enumerate(words):
        if before:
            order = order + dialogue.pairs[before, 0] * dialogue.pairs[word, 1]
        order = order + dialogue.places[min(depth, dialogue.PLACES - 1)] * dialogue.placed[word]
        before = word
        if (mark := int(dialogue.speaker_of[word])) >= 0:
            speaking = mark
        elif speaking >= 0:
            said[speaking, word] = 1
            if (whom := int(dialogue.named[word])) not in (-1, speaking):
                named[whom] = 1
    return order, said.flatten(), named
