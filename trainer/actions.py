"""Actions of four heads: samples, log-probabilities and entropies from logits (..., A)."""

from __future__ import annotations

import torch
from torch import Tensor

SPEAK, TEMPLATE = 1, 2  # positions of these heads; the noun follows the template


def gumbel_noise(shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
    """Noise, float32, whose addition to logits makes the argmax a sample; drawn on the CPU whatever the device."""
    uniform = torch.rand(shape, generator=generator).clamp_(min=torch.finfo(torch.float32).tiny)
    return uniform.log_().neg_().log_().neg_()


def choose(logits: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """The best choice of each head, int64 (..., 4); a sample if noise was added to the logits (..., sum of sizes)."""
    return torch.stack([part.argmax(-1) for part in torch.split(logits, list(sizes), -1)], -1)


def spoken_mask(actions: Tensor) -> Tensor:
    """Which heads took part in each action, float (..., 4): template and noun only when something was said."""
    mask = torch.ones(actions.shape, device=actions.device)
    mask[..., TEMPLATE:] = actions[..., SPEAK : SPEAK + 1].to(mask.dtype)
    return mask


def log_probs(logits: Tensor, actions: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """Log-probability of each head's choice, (..., 4), before masking."""
    return log_probs_and_entropies(logits, actions, sizes)[0]


def log_probs_and_entropies(logits: Tensor, actions: Tensor, sizes: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Log-probability of each head's choice and each head's entropy in nats, both (..., 4), before masking."""
    chosen, entropies = [], []
    for head, part in enumerate(torch.split(logits, list(sizes), -1)):
        logs = torch.log_softmax(part, -1)
        chosen.append(logs.gather(-1, actions[..., head : head + 1]))
        entropies.append(-(logs.exp() * logs).sum(-1))
    return torch.cat(chosen, -1), torch.stack(entropies, -1)


def joint_entropy(logits: Tensor, entropies: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """Entropy of the whole action in nats, (N,): H(primitive) + H(speak) + p(speak) (H(template) + H(noun)).

    The heads are independent, and silence is one action whatever template and noun would have been.

    Args:
        logits: (N, A).
        entropies: (N, 4), of each head.
        sizes: choices of each head.
    """
    first = sum(sizes[:SPEAK])
    speaks = torch.softmax(logits[:, first : first + sizes[SPEAK]], -1)[:, 1]  # (N,)
    return entropies[:, :TEMPLATE].sum(-1) + speaks * entropies[:, TEMPLATE:].sum(-1)
