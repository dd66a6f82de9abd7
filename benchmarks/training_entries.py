"""The trainers that `make bench ARGS=--train` measures: ours, and the peers where they are installed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import torch

import socialai_dsl
from benchmarks.training import PEERS, LongDialogue
from socialai_dsl.trainer.config import RunConfig, configure
from socialai_dsl.trainer.ppo import update
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session, threads_of


@dataclass(frozen=True)
class Update:
    """What our trainer tells of a rollout and its update.

    Attributes:
        rollout_seconds: wall time of the rollout.
        learnt_frames: frames that the network computed with gradients, all epochs together.
    """

    rollout_seconds: float
    learnt_frames: int


@dataclass(frozen=True)
class Entry:
    """A trainer to measure.

    Attributes:
        name: as `--only` takes it.
        what: trainer and network, in a few words.
        num_envs, horizon, minibatches, epochs: sizes of its rollouts and updates.
        words: how it encodes histories.
        start: called with a scenario and a number of threads; each `next` is one rollout with its update.
        precision: number type of the bulk of its arithmetic.
    """

    name: str
    what: str
    num_envs: int
    horizon: int
    minibatches: int
    epochs: int
    words: str
    start: Callable[[str, int], Iterator[Update | None]]
    precision: str = "float32"

    @property
    def frames(self) -> int:
        """Frames of one update."""
        return self.num_envs * self.horizon


def entries() -> list[Entry]:
    """Our trainers, then the peers; only the repository has those, no wheel does."""
    reference = configure(net="paper-reference")
    narrow = reference.model_copy(update={"net": "paper", "update": "environments"})
    own = [
        _own("fast", "ours, fast", configure()),
        _own("paper", "ours, paper", narrow),
        _own(
            "paper-bfloat16", "ours, paper in bfloat16", narrow.model_copy(update={"precision": "bfloat16"})
        ),
        _own("paper-wide", "ours, paper, as --net paper runs it", configure(net="paper")),
        _own("paper-every-frame", "ours, paper, duplicates kept", narrow, every_frame=True),
        _own("paper-reference", "ours, paper-reference", reference),
    ]
    long = _own("fast-long", "ours, fast, long dialogue", configure(), LongDialogue)
    return [own[0], long, *own[1:], *(_peer(peer) for peer in PEERS)]


def _own(
    name: str,
    what: str,
    config: RunConfig,
    wrap: Callable[[Any], Any] | None = None,
    every_frame: bool = False,
) -> Entry:
    def start(scenario: str, threads: int) -> Iterator[Update]:
        envs = socialai_dsl.make_vec(scenario, num_envs=config.envs, copy=False, autoreset_mode="SameStep")
        settings = config.model_copy(update={"threads": threads})
        return own_updates(settings, wrap(envs) if wrap else envs, every_frame)

    words = "streamed" if wrap is None else "streamed, to 64"
    sizes = config.envs, config.horizon, config.minibatches, config.epochs
    return Entry(name, what, *sizes, words, start, config.precision)


def own_updates(config: RunConfig, envs: Any, every_frame: bool) -> Iterator[Update]:
    """Our training loop without its log and its checkpoints; each `next` is one rollout with its update.

    Args:
        config: its numbers; `frames` is not heeded.
        envs: vector environment with same-step auto-reset.
        every_frame: compute each frame by itself, also where an equal one was computed before.
    """
    session = Session.start(config, envs)
    net = session.actor.net
    with threads_of(session) as mapper:
        net.distinct = net.distinct and not every_frame
        count = _Count(net.perceive)
        net.perceive = count  # type: ignore[method-assign]
        while True:
            began = time.perf_counter()
            rollout = collect(session)
            seconds = time.perf_counter() - began
            update(session, rollout, mapper)
            session.update += 1
            yield Update(seconds, count.take())


class _Count:
    """`perceive` of a network, counting the frames it computes with gradients."""

    def __init__(self, perceive: Callable[..., Any]) -> None:
        self._perceive = perceive
        self._counts: list[int] = []

    def __call__(self, prepared: Any, text: Any, image_index: Any, text_index: Any) -> Any:
        if torch.is_grad_enabled():
            self._counts.append(len(image_index))
        return self._perceive(prepared, text, image_index, text_index)

    def take(self) -> int:
        """What was computed since the last call."""
        total = sum(self._counts)
        self._counts.clear()
        return total


def _peer(peer: Any) -> Entry:
    settings = peer.settings

    def start(scenario: str, threads: int) -> Iterator[None]:
        torch.set_num_threads(threads)
        torch.manual_seed(0)
        envs = socialai_dsl.make_vec(scenario, num_envs=settings.num_envs, autoreset_mode="SameStep")
        trained: Iterator[None] = peer.train(envs, settings)
        return trained

    words = f"padded to {settings.words}" if settings.words else "to longest of batch"
    sizes = settings.num_envs, settings.horizon, settings.minibatches, settings.epochs
    return Entry(peer.name, peer.what, *sizes, words, start)
