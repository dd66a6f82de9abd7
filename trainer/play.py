"""Trained agents as policies."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from socialai_dsl.envs.factory import make
from socialai_dsl.episodes.policies import Observation, Streams
from trainer import actions as heads
from trainer import checkpoint as checkpoints
from trainer.checkpoint import CheckpointMeta
from trainer.config import scenario_in
from trainer.errors import CheckpointError
from trainer.features import Actor, Int64
from trainer.nets import ActorCritic, NetSpec
from trainer.nets.memory import emptied
from trainer.shipped import located

# Encodings kept before they are made anew, so that endless play does not fill the memory.
_REMEMBERED_FRAMES = 1 << 16
_WORDS_SHOWN = 6


class CheckpointPolicy:
    """A trained agent: a network with its memory, which plays one environment or many.

    It samples its actions, as in the paper, or takes the most probable ones if `greedy`. The network is in evaluation
    mode, so batch normalisation uses the statistics of training, and the actions in one environment do not depend on
    the others (except for the rounding of matrix products). `load` makes one.

    Attributes:
        net: the network, a `torch.nn.Module`.
    """

    def __init__(self, net: ActorCritic, greedy: bool = False, seed: int = 0) -> None:
        self.net = net.eval()
        self._greedy = greedy
        self._streams = Streams(seed)
        self._actor: Actor | None = None
        self._memory = net.memory.initial(1)
        self._last: tuple[torch.Tensor, torch.Tensor] | None = None

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
        """Load an agent to play `envs`; a `TransferWarning` lists how they differ from the ones it was trained on.

        Args:
            path: `shipped:NAME`, one checkpoint, or a folder of a run or of checkpoints, for its newest.
            envs: the environment, single or vector, wrapped or not; None: the scenario of the agent's training.
            greedy: take the most probable action instead of sampling.
            seed: of the sampling.
            device: PyTorch's name of the device that the network runs on.
            net: `module:Class` of a network of your own; no file chooses what is imported.
            folder: the folder whose `module.py` is tried first.

        Raises:
            CheckpointError: the file is missing, damaged or of another version of the trainer, or does not fit the
                environment; or `envs` is None and the checkpoint names no scenario.
            ValueError: no agent of this name ships.
        """
        checkpoint = checkpoints.read_agent(path)
        if envs is None:
            scenario = _scenario_of(located(path), checkpoint.meta.config.scenario)
            if not scenario:
                raise CheckpointError(f"{path}: does not say which scenario it is for, expected envs")
            envs = make(scenario)
        restored = checkpoints.restore_net(checkpoint, NetSpec.of(envs.unwrapped), net, folder)
        warn_of_differences(checkpoint.meta, envs.unwrapped.program)
        return cls(restored.to(device), greedy, seed)

    def reset(self, mask: NDArray[np.bool_] | None = None, episodes: Int64 | None = None) -> None:
        """Forget the past where a new episode begins, `mask` bool (E,), or everywhere; see `Policy.reset`."""
        if mask is None:
            mask = np.ones(len(self._memory), np.bool_)
        self._require(len(mask))
        self._memory = emptied(self._memory, torch.from_numpy(mask).to(self._memory.device))
        self._streams.begin(mask, episodes)

    @torch.no_grad()
    def act(self, observation: Observation) -> Int64:
        """Choose actions, int64 (E, heads), as `Policy.act` does; of a single observation one, int64 (heads,)."""
        alone = observation["tokens"].ndim == 1
        logits, _ = self._look(observation, alone)
        if not self._greedy:
            noise = torch.from_numpy(self._streams.gumbel(*logits.shape))
            logits = logits + noise.to(logits.device)
        chosen: Int64 = heads.choose(logits, self.net.spec.action_sizes).cpu().numpy()
        return chosen[0] if alone else chosen

    def thought(self) -> tuple[list[list[float]], float]:
        """What the agent made of the first room's last observation.

        Returns:
            For each head the probability of each of its choices, and the expected return.

        Raises:
            ValueError: `act` was not called yet.
        """
        if self._last is None:
            raise ValueError("thought: got a call before `act`; expected one after it")
        logits, values = self._last
        parts = torch.split(logits[0], list(self.net.spec.action_sizes))
        return [torch.softmax(part, -1).tolist() for part in parts], float(values[0])

    def _look(self, observation: Observation, alone: bool) -> tuple[torch.Tensor, torch.Tensor]:
        """Logits of all heads side by side (E, A), and values (E,); the memory goes on."""
        images, tokens = observation["image"], observation["tokens"]
        if alone:
            images, tokens = images[None], tokens[None]
        self._require(len(tokens))
        if self._actor is None or len(self._actor.pairs.data) > _REMEMBERED_FRAMES:
            self._actor = Actor(self.net, tokens.shape[1])
        _, features = self._actor.see(images, tokens)
        output, self._memory = self.net.memory.step(features, self._memory)
        self._last = self.net.heads(output)
        return self._last

    def _require(self, count: int) -> None:
        """Begin with an empty memory if another number of environments is played now."""
        if len(self._memory) != count:
            self._memory, self._actor = self.net.memory.initial(count), None


def _scenario_of(agent: Path, scenario: str) -> str:
    """The scenario of an agent's training: the copy in its folder, in which its checkpoint may lie deeper."""
    return next(
        (
            found
            for one in (agent, *agent.absolute().parents[:2])
            if (found := scenario_in(one, scenario)) != scenario
        ),
        scenario,
    )


class TransferWarning(UserWarning):
    """Warns that an agent plays another program than the one it was trained on."""


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
    both = enumerate(zip(old, new, strict=False))
    changed = [f'{i}: "{was}" is now "{now}"' for i, (was, now) in both if was != now]
    if len(old) != len(new):
        changed.append(f"{len(old)} are now {len(new)}")
    more = len(changed) - _WORDS_SHOWN
    return ", ".join(changed[:_WORDS_SHOWN]) + (f" and {more} more" if more > 0 else "")
