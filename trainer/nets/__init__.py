"""Networks by name: the shipped ones, or a class of the user's as `mine:Net`."""

from __future__ import annotations

from pathlib import Path

import torch

from socialai_dsl.trainer.extensions import load_class
from socialai_dsl.trainer.nets.base import ActorCritic, NetSpec, Precision
from socialai_dsl.trainer.nets.fast import FastNet
from socialai_dsl.trainer.nets.memory import Memory
from socialai_dsl.trainer.nets.paper import PaperNet, PaperReferenceNet
from socialai_dsl.trainer.nets.relations import RelationsNet, SpeakersNet

__all__ = [
    "ActorCritic",
    "FastNet",
    "Memory",
    "NetSpec",
    "RelationsNet",
    "SpeakersNet",
    "build_net",
    "net_class",
]

_SHIPPED: dict[str, type[ActorCritic]] = {
    "fast": FastNet,
    "relations": RelationsNet,
    "speakers": SpeakersNet,
    "paper": PaperNet,
    "paper-reference": PaperReferenceNet,
    "paper-reference-tuned": PaperReferenceNet,
}


def net_class(name: str, folder: Path = Path()) -> type[ActorCritic]:
    """Find a network class: a shipped one, or `mine:Net` of the user's, looked for in `folder` first.

    Raises:
        ValueError: there is no such network, or it is not an `ActorCritic`.
    """
    if name in _SHIPPED:
        return _SHIPPED[name]
    found: type = load_class(name, "net", tuple(_SHIPPED), ActorCritic, folder)
    if not issubclass(found, ActorCritic):
        raise ValueError(f"net: got {name!r}, expected a subclass of socialai_dsl.trainer.nets.ActorCritic")
    return found


def build_net(
    name: str, spec: NetSpec, seed: int, precision: Precision = "float32", folder: Path = Path()
) -> ActorCritic:
    """Build a network with weights drawn from `seed`, leaving torch's global generator as it was.

    Raises:
        ValueError: the network cannot compute in this precision; see also `net_class`.
    """
    found = net_class(name, folder)
    if precision != "float32" and not found.reducible:
        raise ValueError(f"precision: got {precision} for the network {name}, which computes in float32 only")
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        net = found(spec)  # type: ignore[call-arg]
    net.precision = precision
    return net
