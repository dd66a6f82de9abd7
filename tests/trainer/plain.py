"""Histories encoded one by one with PyTorch's own layers, to compare the streamed encoding with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from trainer.nets.dialogue import DialogueEncoder, HeardWords


def encode(dialogue: DialogueEncoder, tokens: np.ndarray) -> Tensor:
    """One history, int (L,) padded with 0, from its first word; (dialogue.size,)."""
    words = torch.from_numpy(tokens[tokens > 0].astype(np.int64))
    weight = dialogue.embedding.weight
    state = dialogue.gru(dialogue.embedding(words))[1][0] if len(words) else weight.new_zeros(dialogue.hidden)
    if not isinstance(dialogue, HeardWords):
        return state
    return torch.cat(
        (state, torch.tensor([float(w in words) for w in range(len(weight))], dtype=weight.dtype))
    )
