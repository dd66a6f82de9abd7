"""Trained agents at play."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import socialai_dsl
from socialai_dsl.evaluation import Observation, Streams
from trainer import actions as heads
from trainer import checkpoint as checkpoints
from trainer.checkpoint import CheckpointMeta
from trainer.errors import CheckpointError
from trainer.features import Actor, Int64
from trainer.nets import ActorCritic, NetSpec
from trainer.nets.memory import emptied

# Encodings kept before they are made anew, so that endless play does not fill the memory.
_REMEMBERED_FRAMES = 1 << 16
_WORDS_SHOWN = 6


class CheckpointPolicy:
    """A trained agent: a network with its memory.

    It samples its actions, as in the paper, or takes the most probable ones if `greedy`. The network is in
    evaluation mode, so batch normalisation uses the statistics of training, and what one environment gets does not
    depend on the others (but for the rounding of matrix products).

    Plays one environment as well as many: `act` answers an observation in the form in which it is asked.
    """

    def __init__(self, net: ActorCritic, greedy: bool = False, seed: int = 0) -> None:
        self.net = net.eval()
        self._greedy = greedy
        self._streams = Streams(seed)
        self._actor: Actor | None = None
        self._memory = net.memory.initial(1)

    @classmethod
    def load(
        cls,
        path: Path | str,
        envs: Any = None,
        greedy: bool = False,
        seed: int = 0,
        device: str = "cpu",
        net: str | None = None,
        folder: Path = Path(),
    ) -> CheckpointPolicy:
        """Load an agent for playing `envs`; where they are not what it was trained on, a warning lists the differences.

        Args:
            path: `shipped:NAME`, a run's folder, its folder of checkpoints (of both the newest is taken), or one
                checkpoint.
            envs: the environment, single or vector, wrapped or not; None: the agent plays the scenario on which it
                was trained.
            greedy: take the most probable action instead of sampling.
            seed: of the sampling.
            device: where the network runs.
            net: name of the network, needed if it is not a shipped one: no file chooses what is imported.
            folder: where the file of such a network is looked for first.

        Raises:
            CheckpointError: see `checkpoint.read_agent` and `checkpoint.restore_net`; or `envs` is None and the
                checkpoint does not say which scenario it is for.
            ValueError: no agent of this name ships.
        """
        checkpoint = checkpoints.read_agent(path)
        if envs is None:
            scenario = checkpoint.meta.config.scenario
            if not scenario:
                raise CheckpointError(f"{path}: does not say which scenario it is for, expected envs")
            envs = socialai_dsl.make(scenario)
        restored = checkpoints.restore_net(checkpoint, NetSpec.of(envs.unwrapped), net, folder)
        warn_of_differences(checkpoint.meta, envs.unwrapped.program)
        return cls(restored.to(device), greedy, seed)

    def reset(self, mask: NDArray[np.bool_] | None = None, episodes: Int64 | None = None) -> None:
        """Forget the past of the environments where `mask`, bool (E,), is true; without it, that of all."""
        if mask is None:
            mask = np.ones(len(self._memory), np.bool_)
        self._require(len(mask))
        self._memory = emptied(self._memory, torch.from_numpy(mask).to(self._memory.device))
        self._streams.begin(mask, episodes)

    @torch.no_grad()
    def act(self, observation: Observation) -> Int64:
        """Actions, int64 (E, 4), for `image` (E, H, W, C) and `tokens` (E, L), or (4,) for a single observation."""
        images, tokens = observation["image"], observation["tokens"]
        if tokens.ndim == 1:
            alone: Int64 = self._act(images[None], tokens[None])[0]
            return alone
        return self._act(images, tokens)

    @torch.no_grad()
    def think(self, observation: Observation) -> tuple[list[list[float]], float]:
        """What the agent makes of a single observation, which it remembers as after `act`.

        Returns:
            The probabilities of each head's choices, and the return that it expects.
        """
        logits, values = self._look(observation["image"][None], observation["tokens"][None])
        heads_of = torch.split(logits[0], list(self.net.spec.action_sizes))
        return [torch.softmax(head, -1).tolist() for head in heads_of], float(values[0])

    def _act(self, images: NDArray[np.uint8], tokens: NDArray[np.int16]) -> Int64:
        logits, _ = self._look(images, tokens)
        if not self._greedy:
            noise = torch.from_numpy(self._streams.gumbel(len(tokens), logits.shape[1]))
            logits = logits + noise.to(logits.device)
        chosen: Int64 = heads.choose(logits, self.net.spec.action_sizes).cpu().numpy()
        return chosen

    def _look(
        self, images: NDArray[np.uint8], tokens: NDArray[np.int16]
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Logits of all heads side by side, and values; the memory goes on."""
        if self._actor is None or self._actor.pairs.size > _REMEMBERED_FRAMES:
            self._actor = Actor(self.net, tokens.shape[1])
        self._require(len(tokens))
        _, features = self._actor.see(images, tokens)
        output, self._memory = self.net.memory.step(features, self._memory)
        found: tuple[torch.Tensor, torch.Tensor] = self.net.heads(output)
        return found

    def _require(self, count: int) -> None:
        """Begin with an empty memory if another number of environments is played now."""
        if len(self._memory) != count:
            self._memory = self.net.memory.initial(count)


class TransferWarning(UserWarning):
    """An agent plays something else than it was trained on."""


def warn_of_differences(meta: CheckpointMeta, program: Any) -> None:
    """Warn if a checkpoint is played on another program than it was made for: what the agent's choices mean there.

    Words of the dialogue are left out: `checkpoint.restore_net` moves them, and warns by itself.
    """
    if meta.program_sha256 == program.sha256:
        return
    parts = [
        f"the agent was trained on {meta.scenario} (program {meta.program_sha256[:8]}) "
        f"and plays {program.name} ({program.sha256[:8]})"
    ]
    for what in ("actions", "templates", "nouns"):
        old, new = list(getattr(meta, what)), list(getattr(program, what))
        if old != new:
            parts.append(f"{what}: {_changes(old, new)}")
    warnings.warn("; ".join(parts), TransferWarning, stacklevel=3)


def _changes(old: Sequence[str], new: Sequence[str]) -> str:
    """`2: "Hello" is now "Good day", ...`, the first few."""
    changed = [
        f'{i}: "{before}" is now "{after}"'
        for i, (before, after) in enumerate(zip(old, new, strict=False))
        if before != after
    ]
    if len(old) != len(new):
        changed.append(f"{len(old)} are now {len(new)}")
    more = len(changed) - _WORDS_SHOWN
    return ", ".join(changed[:_WORDS_SHOWN]) + (f" and {more} more" if more > 0 else "")
