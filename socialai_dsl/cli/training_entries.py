"""This module lists the trainers that `socialai bench --train` measures: ours, and the peers where they are at hand."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import torch

import socialai_dsl
from socialai_dsl.cli.roofline import Work
from trainer.config import TrainConfig, paper_preset
from trainer.crew import Crew
from trainer.nets import best_precision
from trainer.ppo import update
from trainer.ppo_chunks import update_chunks
from trainer.session import Session


@dataclass(frozen=True)
class Update:
    """What our trainer tells of a rollout and its update.

    Attributes:
        rollout_seconds: wall time of the rollout.
        work: what the network computed.
    """

    rollout_seconds: float
    work: Work


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
        paper: whether its network is the paper's.
        floor: frames/s by number of cores below which ratios to it are scaled.
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
    paper: bool = False
    floor: dict[int, float] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Frames of one update."""
        return self.num_envs * self.horizon


def entries() -> list[Entry]:
    """Our trainers, then the peers; only the repository has those, no wheel does."""
    paper = paper_preset(net="paper", update="environments")
    own = [
        _own("fast", "ours, fast", TrainConfig()),
        _own("paper", "ours, paper", paper),
        _own("paper-wide", "ours, paper, as --net paper runs it", TrainConfig(net="paper")),
        _own("paper-every-frame", "ours, paper, duplicates kept", paper, every_frame=True),
        _own("paper-reference", "ours, paper-reference", paper_preset()),
    ]
    try:
        from benchmarks.training import PEERS, LongDialogue
    except ImportError:
        return own
    long = _own("fast-long", "ours, fast, long dialogue", TrainConfig(), LongDialogue)
    return [own[0], long, *own[1:], *(_peer(peer) for peer in PEERS)]


def _own(
    name: str,
    what: str,
    config: TrainConfig,
    wrap: Callable[[Any], Any] | None = None,
    every_frame: bool = False,
) -> Entry:
    precision = best_precision(config.net, "cpu")

    def start(scenario: str, threads: int) -> Iterator[Update]:
        envs = socialai_dsl.make_vec(
            scenario, num_envs=config.num_envs, copy=False, autoreset_mode="SameStep"
        )
        settings = config.model_copy(update={"threads": threads, "precision": precision})
        return own_updates(settings, wrap(envs) if wrap else envs, every_frame)

    words = "streamed" if wrap is None else "streamed, to 64"
    sizes = config.num_envs, config.horizon, config.minibatches, config.epochs
    return Entry(name, what, *sizes, words, start, precision, paper=config.net.startswith("paper"))


def own_updates(config: TrainConfig, envs: Any, every_frame: bool) -> Iterator[Update]:
    """Our training loop without its log and its checkpoints; each `next` is one rollout with its update.

    Args:
        config: hyper-parameters; `frames` is not heeded.
        envs: vector environment with same-step auto-reset.
        every_frame: compute each frame by itself, also where an equal one was computed before.
    """
    session = Session.start(config, envs)
    net = session.actor.net
    divisible = net.distinct
    net.distinct = net.distinct and not every_frame
    net.train()
    count = _Count(net.perceive)
    net.perceive = count  # type: ignore[method-assign]
    learn = update_chunks if config.update == "chunks" else update
    with Crew(config.threads, divisible) as crew:
        while True:
            began = time.perf_counter()
            rollout = session.play(crew)
            seconds = time.perf_counter() - began
            learn(session.actor, session.optimizer, rollout, config, session.generator, crew)
            session.update += 1
            yield Update(seconds, count.take())


class _Count:
    """`perceive` of a network, counting what it is asked to compute."""

    def __init__(self, perceive: Callable[..., Any]) -> None:
        self._perceive = perceive
        self._calls: list[tuple[bool, int, int]] = []

    def __call__(self, prepared: Any, text: Any, image_index: Any, text_index: Any) -> Any:
        self._calls.append((torch.is_grad_enabled(), int(image_index.max()) + 1, len(image_index)))
        return self._perceive(prepared, text, image_index, text_index)

    def take(self) -> Work:
        """What was computed since the last call."""
        sums = [
            sum(c[part] for c in self._calls if c[0] == learnt) for learnt in (False, True) for part in (1, 2)
        ]
        self._calls.clear()
        return Work(*sums)


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
    return Entry(peer.name, peer.what, *sizes, words, start, floor=peer.floor)
