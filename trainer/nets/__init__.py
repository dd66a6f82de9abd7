"""This module builds networks by name: the shipped ones, or a class of the user's as `my.module:MyNet`."""

from __future__ import annotations

import importlib
from collections.abc import Callable

import torch

from trainer.nets.base import HEADS, ActorCritic, NetSpec
from trainer.nets.fast import FastNet
from trainer.nets.paper import PaperNet, PaperReferenceNet

__all__ = ["HEADS", "ActorCritic", "NetSpec", "build_net", "net_class"]

NetClass = Callable[[NetSpec], ActorCritic]

_SHIPPED: dict[str, NetClass] = {
    "fast": FastNet,
    "paper": PaperNet,
    "paper-reference": PaperReferenceNet,
}


def net_class(name: str) -> NetClass:
    """Find a network class: `fast`, `paper`, `paper-reference`, or `my.module:MyNet`.

    Raises:
        ValueError: there is no such network, or it is not an `ActorCritic`.
    """
    if name in _SHIPPED:
        return _SHIPPED[name]
    module_name, colon, class_name = name.partition(":")
    if not (colon and module_name and class_name):
        raise ValueError(f"net: got {name!r}, expected one of {', '.join(_SHIPPED)}, or my.module:MyNet")
    try:
        found = getattr(importlib.import_module(module_name), class_name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"net: cannot load {name!r}: {error}") from error
    if not (isinstance(found, type) and issubclass(found, ActorCritic)):
        raise ValueError(f"net: got {name!r}, expected a subclass of trainer.nets.ActorCritic")
    return found


def build_net(name: str, spec: NetSpec, seed: int) -> ActorCritic:
    """Build a network with weights drawn from `seed`, leaving torch's global generator as it was.

    Raises:
        ValueError: see `net_class`.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return net_class(name)(spec)
