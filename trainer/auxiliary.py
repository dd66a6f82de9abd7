"""Auxiliary losses: what the network is to learn besides acting and judging."""

from __future__ import annotations

from abc import ABC, abstractmethod

import torch
from torch import Tensor, nn

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.extensions import load_class
from socialai_dsl.trainer.frames import Environments, Outputs
from socialai_dsl.trainer.nets import ActorCritic

SHIPPED = ("none",)


class AuxiliaryLoss(nn.Module, ABC):
    """A loss that is added to PPO's, `aux_coef` times; `--aux mine:Loss` builds `Loss(config, net)`.

    The optimizer trains its parameters along with the network's. Checkpoints save its whole state, which is that of a
    module: parameters, and buffers, which may grow.

    Args:
        config: every option of the run.
        net: the network, for its sizes; it is given again with each call, and must not be kept.
    """

    def __init__(self, config: RunConfig, net: ActorCritic) -> None:
        super().__init__()

    def begin(self, played: Environments, net: ActorCritic, generator: torch.Generator) -> None:
        """Take note of a rollout before the network learns from it; here buffers may change, and nowhere else.

        Args:
            played: all frames of the rollout.
            net: the network that played.
            generator: the one source of random numbers that a resumed run draws again.
        """

    @abstractmethod
    def forward(self, frames: Environments, outputs: Outputs, net: ActorCritic) -> Tensor:
        """The loss of some frames, a scalar of float32; threads may ask for those of several shares side by side.

        Args:
            frames: whole environments of the rollout: `batch`, and `stretches`, which tells where episodes start.
            outputs: what the network makes of them, with gradients.
            net: the network.
        """


def loss_of(aux: AuxiliaryLoss, frames: Environments, outputs: Outputs, net: ActorCritic) -> Tensor:
    """What an auxiliary loss returns. Raises ValueError unless it is a finite scalar."""
    loss: object = aux(frames, outputs, net)
    got = type(loss).__name__
    if isinstance(loss, Tensor):
        if loss.shape or loss.dtype != torch.float32:
            got = f"{loss.dtype} of the shape {tuple(loss.shape)}"
        elif bool(torch.isfinite(loss)):
            return loss
        else:
            got = f"{loss.item():g}"
    raise ValueError(f"aux: {type(aux).__name__} returned {got}, expected a finite scalar tensor of float32")


def build_auxiliary(config: RunConfig, net: ActorCritic) -> AuxiliaryLoss | None:
    """The auxiliary loss that a configuration names, with weights drawn from its seed; None for `none`.

    Raises:
        ValueError: it is not there, is no `AuxiliaryLoss`, lacks a method, or has parameters of the network.
    """
    if config.aux == "none":
        return None
    found = load_class(config.aux, "aux", SHIPPED, AuxiliaryLoss, config.code_folder)
    if not issubclass(found, AuxiliaryLoss):
        expected = "expected a subclass of socialai_dsl.trainer.auxiliary.AuxiliaryLoss"
        raise ValueError(f"aux: got {config.aux!r}, {expected}")
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        made: AuxiliaryLoss = found(config, net).to(config.device)
    if set(made.parameters()) & set(net.parameters()):
        raise ValueError(
            f"aux: {config.aux} keeps a part of the network, expected it to use the one it is called with"
        )
    return made
