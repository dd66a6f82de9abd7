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
from trainer.streams import Streams
from trainer.transfer import warn_of_differences

Observation = Mapping[str, NDArray[Any]]

# Encodings kept before they are made anew, so that endless play does not fill the memory.
_REMEMBERED_FRAMES = 1 << 16


class Policy(Protocol):
    """Plays E environments together."""

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Forget the past of the environments where `mask`, bool (E,), is true: a new episode begins there.

        Where `episodes`, int64 (E,), gives the episode's number, whatever is drawn in it depends on that alone.
        """

    def act(self, observation: Observation) -> Int64:
        """Actions, int64 (E, 4), for `image` (E, H, W, C) and `tokens` (E, L)."""


class RandomPolicy:
    """Chooses uniformly in every head; so it speaks half of the time."""

    def __init__(self, action_sizes: tuple[int, ...], seed: int = 0) -> None:
        self._sizes = np.array(action_sizes)
        self._streams = Streams(seed)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        self._streams.begin(mask, episodes)

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        drawn = self._streams.uniform(len(observation["tokens"]), len(self._sizes))
        chosen: Int64 = (drawn * self._sizes).astype(np.int64)
        return chosen


class ScriptedPolicy:
    """Does what the scenario's own script for the agent would do now."""

    def __init__(self, envs: Any) -> None:
        self._envs = envs

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget; the script's state is the environments'."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        return np.array(self._envs.scripted_actions(), np.int64)


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
        envs: Any,
        greedy: bool = False,
        seed: int = 0,
        device: str = "cpu",
        net: str | None = None,
    ) -> CheckpointPolicy:
        """Load an agent for playing `envs`; where they are not what it was trained on, a warning lists the differences.

        Args:
            path: a run's folder, its folder of checkpoints (of both the newest is taken), or one checkpoint.
            envs: the environment, single or vector, wrapped or not.
            greedy: take the most probable action instead of sampling.
            seed: of the sampling.
            device: where the network runs.
            net: name of the network, needed if it is not a shipped one: no file chooses what is imported.

        Raises:
            CheckpointError: see `checkpoint.read` and `checkpoint.restore_net`.
        """
        path, program = Path(path), envs.unwrapped.program
        folder = path / checkpoints.FOLDER
        checkpoint = checkpoints.read(folder if folder.is_dir() else path)
        restored = checkpoints.restore_net(
            checkpoint, net_spec(envs.unwrapped), list(program.vocabulary), net
        )
        warn_of_differences(checkpoint.meta, program)
        return cls(restored.to(device), greedy, seed)

    def reset(self, mask: NDArray[np.bool_] | None = None, episodes: Int64 | None = None) -> None:
        """Forget the past of the environments where `mask`, bool (E,), is true; without it, that of all."""
        if mask is None:
            mask = np.ones(self._memory.shape[1], np.bool_)
        self._require(len(mask))
        self._memory[:, torch.from_numpy(mask).to(self._memory.device)] = 0
        self._streams.begin(mask, episodes)

    @torch.no_grad()
    def act(self, observation: Observation) -> Int64:
        """Actions, int64 (E, 4), for `image` (E, H, W, C) and `tokens` (E, L), or (4,) for a single observation."""
        images, tokens = observation["image"], observation["tokens"]
        if tokens.ndim == 1:
            alone: Int64 = self._act(images[None], tokens[None])[0]
            return alone
        return self._act(images, tokens)

    def _act(self, images: NDArray[np.uint8], tokens: NDArray[np.int16]) -> Int64:
        if self._actor is None or self._actor.pairs.size > _REMEMBERED_FRAMES:
            self._actor = Actor(self.net, tokens.shape[1])
        self._require(len(tokens))
        _, features = self._actor.see(images, tokens)
        self._memory = self.net.memory.step(features, self._memory)
        logits, _ = self.net.heads(self._memory[0])
        if not self._greedy:
            noise = torch.from_numpy(self._streams.gumbel(len(tokens), logits.shape[1]))
            logits = logits + noise.to(logits.device)
        chosen: Int64 = heads.choose(logits, self.net.spec.action_sizes).cpu().numpy()
        return chosen

    def _require(self, count: int) -> None:
        """Begin with an empty memory if another number of environments is played now."""
        if self._memory.shape[1] != count:
            self._memory = self.net.memory.initial(count)
