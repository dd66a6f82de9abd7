"""This module holds what can play a scenario: chance, the scenario's own script, and a trained network."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from trainer import actions as heads
from trainer import checkpoint as checkpoints
from trainer.actor import Actor
from trainer.distinct import Int64
from trainer.nets import ActorCritic
from trainer.session import net_spec

Observation = Mapping[str, NDArray[Any]]

# Encodings kept before they are made anew, so that endless play does not fill the memory.
_REMEMBERED_FRAMES = 1 << 16


class Policy(Protocol):
    """Plays E environments together."""

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Forget the past of the environments where `mask`, bool (E,), is true: a new episode begins there."""

    def act(self, observation: Observation) -> Int64:
        """Actions, int64 (E, 4), for `image` (E, H, W, C) and `tokens` (E, L)."""


class RandomPolicy:
    """Chooses uniformly in every head; so it speaks half of the time."""

    def __init__(self, action_sizes: tuple[int, ...], seed: int = 0) -> None:
        self._sizes = np.array(action_sizes)
        self._generator = np.random.default_rng(seed)

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        count = len(observation["tokens"])
        return self._generator.integers(0, self._sizes, (count, len(self._sizes)), dtype=np.int64)


class ScriptedPolicy:
    """Does what the scenario's own script for the agent would do now."""

    def __init__(self, envs: Any) -> None:
        self._envs = envs

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Nothing to forget; the script's state is the environments'."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        return np.array(self._envs.scripted_actions(), np.int64)


class CheckpointPolicy:
    """A network with its memory; samples its actions, or takes the most probable ones if `greedy`."""

    def __init__(self, net: ActorCritic, greedy: bool = False, seed: int = 0) -> None:
        self.net = net.eval()
        self._greedy = greedy
        self._generator = torch.Generator().manual_seed(seed)
        self._actor: Actor | None = None
        self._memory = net.memory.initial(0)

    @classmethod
    def load(
        cls,
        path: Path,
        envs: Any,
        greedy: bool = False,
        seed: int = 0,
        device: str = "cpu",
        net: str | None = None,
    ) -> CheckpointPolicy:
        """Read a checkpoint, or the newest of a directory, for playing `envs`.

        Raises:
            CheckpointError: see `checkpoint.read` and `checkpoint.restore_net`.
        """
        restored = checkpoints.restore_net(
            checkpoints.read(path), net_spec(envs), list(envs.program.vocabulary), net
        )
        return cls(restored.to(device), greedy, seed)

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Empty the memory where `mask`."""
        if self._memory.shape[1] != len(mask):
            self._memory = self.net.memory.initial(len(mask))
        self._memory[:, torch.from_numpy(mask).to(self._memory.device)] = 0

    @torch.no_grad()
    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        images, tokens = observation["image"], observation["tokens"]
        if self._actor is None or self._actor.pairs.size > _REMEMBERED_FRAMES:
            self._actor = Actor(self.net, tokens.shape[1])
        if self._memory.shape[1] != len(tokens):
            self._memory = self.net.memory.initial(len(tokens))
        _, features = self._actor.see(images, tokens)
        self._memory = self.net.memory.step(features, self._memory)
        logits, _ = self.net.heads(self._memory[0])
        if not self._greedy:
            logits = logits + heads.gumbel_noise(tuple(logits.shape), self._generator).to(logits.device)
        chosen: Int64 = heads.choose(logits, self.net.spec.action_sizes).cpu().numpy()
        return chosen
