"""The trainers that `python -m benchmarks --train` runs beside ours, each with its settings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from benchmarks.training import clean_loop, plain_loop
from benchmarks.training.long_dialogue import LongDialogue
from benchmarks.training.networks import CellTrunk, PaperTrunk
from benchmarks.training.settings import Settings

__all__ = ["PEERS", "LongDialogue", "Peer", "Settings"]


@dataclass(frozen=True)
class Peer:
    """A trainer to compare with.

    Attributes:
        name: as `--only` takes it.
        what: who trains which network, in a few words.
        settings: sizes of its rollouts and how it treats histories.
        train: called with a vector environment and the settings; each `next` is one rollout with its update.
    """

    name: str
    what: str
    settings: Settings
    train: Callable[[Any, Settings], Iterator[None]]


_PAPER = Settings(num_envs=16, horizon=40, minibatches=1, words=0)
_CLEAN_PAPER = Settings(num_envs=16, horizon=40, minibatches=4, words=64)
_RECURRENT_PAPER = Settings(num_envs=16, horizon=20, minibatches=4, words=64)
_RECURRENT_CELLS = Settings(num_envs=32, horizon=32, minibatches=4, words=64)
_CELLS = Settings(num_envs=64, horizon=32, minibatches=4, words=64)


def _clean(trunk: Callable[..., Any]) -> Callable[[Any, Settings], Iterator[None]]:
    return lambda envs, settings: clean_loop.train(envs, settings, trunk)


def _recurrent(trunk: Callable[..., Any]) -> Callable[[Any, Settings], Iterator[None]]:
    def train(envs: Any, settings: Settings) -> Iterator[None]:
        from benchmarks.training import recurrent_ppo

        return recurrent_ppo.train(envs, settings, trunk)

    return train


PEERS: tuple[Peer, ...] = (
    Peer("plain-loop", "the paper's loop, step by step", _PAPER, plain_loop.train),
    Peer("clean-paper", "CleanRL-style loop, paper's network", _CLEAN_PAPER, _clean(PaperTrunk)),
    Peer("clean-fast", "CleanRL-style loop, fast's network", _CELLS, _clean(CellTrunk)),
)
if find_spec("sb3_contrib"):
    PEERS += (
        Peer("sb3-paper", "RecurrentPPO, paper's network", _RECURRENT_PAPER, _recurrent(PaperTrunk)),
        Peer("sb3-fast", "RecurrentPPO, fast's network", _RECURRENT_CELLS, _recurrent(CellTrunk)),
    )
