"""This module builds networks by name: the shipped ones, or a class of the user's as `my.module:MyNet`."""

from __future__ import annotations

import importlib
from typing import Protocol, cast

import torch

from trainer.nets.base import HEADS, ActorCritic, NetSpec, Precision
from trainer.nets.fast import FastNet
from trainer.nets.paper import PaperNet, PaperReferenceNet

__all__ = ["HEADS", "ActorCritic", "NetSpec", "Precision", "best_precision", "build_net", "net_class"]


class NetClass(Protocol):
    """What builds a network: a subclass of `ActorCritic` whose constructor takes the spec alone."""

    reducible: bool

    def __call__(self, spec: NetSpec, /) -> ActorCritic:
        """A network with fresh weights."""


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
    return cast(NetClass, found)


def best_precision(name: str, device: str) -> Precision:
    """`bfloat16` where the network can use it and the device computes with it natively, else `float32`.

    Raises:
        ValueError: see `net_class`.
    """
    if device.startswith("cuda"):
        native = torch.cuda.is_bf16_supported(including_emulation=False)
    else:
        native = device == "cpu" and bool(torch.cpu.get_capabilities().get("avx512_bf16"))
    return "bfloat16" if native and net_class(name).reducible else "float32"


def build_net(name: str, spec: NetSpec, seed: int, precision: Precision = "float32") -> ActorCritic:
    """Build a network with weights drawn from `seed`, leaving torch's global generator as it was.

    Raises:
        ValueError: the network cannot compute in this precision; see also `net_class`.
    """
    found = net_class(name)
    if precision != "float32" and not found.reducible:
        raise ValueError(f"precision: got {precision} for the network {name}, which computes in float32 only")
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        net = found(spec)
    net.precision = precision
    return net
