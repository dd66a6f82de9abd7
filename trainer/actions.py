"""Actions of H heads: samples, log-probabilities and entropies from logits (..., A). `used` is `NetSpec.used`."""

from __future__ import annotations

import torch
from torch import Tensor

SPEAK, TEMPLATE, SLOTS = 1, 2, 3  # positions of these heads


def gumbel_noise(shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
    """Noise, float32, whose addition to logits makes the argmax a sample; drawn on the CPU whatever the device."""
    uniform = torch.rand(shape, generator=generator).clamp_(min=torch.finfo(torch.float32).tiny)
    return uniform.log_().neg_().log_().neg_()


def choose(logits: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """The best choice of each head, int64 (..., H); a sample if noise was added to the logits (..., sum of sizes)."""
    return torch.stack([part.argmax(-1) for part in torch.split(logits, list(sizes), -1)], -1)


def spoken_mask(actions: Tensor, used: Tensor | None) -> Tensor:
    """Which heads took part in each action, float (..., H): if something was said the template and its slots."""
    mask = torch.ones(actions.shape, device=actions.device)
    mask[..., TEMPLATE:] = actions[..., SPEAK : SPEAK + 1].to(mask.dtype)
    if used is not None:
        mask[..., SLOTS:] *= used.to(mask)[actions[..., TEMPLATE]]
    return mask


def log_probs_and_entropies(logits: Tensor, actions: Tensor, sizes: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Log-probability of each head's choice and each head's entropy in nats, both (..., H), before masking."""
    chosen, entropies = [], []
    for head, part in enumerate(torch.split(logits, list(sizes), -1)):
        logs = torch.log_softmax(part, -1)
        chosen.append(logs.gather(-1, actions[..., head : head + 1]))
        entropies.append(-(logs.exp() * logs).sum(-1))
    return torch.cat(chosen, -1), torch.stack(entropies, -1)


def joint_entropy(logits: Tensor, entropies: Tensor, sizes: tuple[int, ...], used: Tensor | None) -> Tensor:
    """Entropy of the whole action in nats, (N,): H(body) + H(speak) + p(speak) (H(template) + sum of p(has s) H(s)).

    The heads are independent, and what a template lacks, and in silence all that would have been said, is no choice.
    Logits are (N, A), entropies (N, H) of each head; p(has s) is the chance of a template that has the slot s.
    Neither chance has a gradient: an agent that is paid for talking does not learn to heed answers (docs/learning.md).
    """
    _, speak, template, *_ = torch.split(logits.detach(), list(sizes), -1)
    chances = 1 if used is None else torch.softmax(template, -1) @ used.to(logits)  # (N, slots)
    said = torch.cat((entropies[:, TEMPLATE:SLOTS], chances * entropies[:, SLOTS:]), -1).sum(-1)  # (N,)
    return entropies[:, :TEMPLATE].sum(-1) + torch.softmax(speak, -1)[:, 1] * said
