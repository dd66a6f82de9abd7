"""Trained agents as policies."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.factory import make
from socialai_dsl.episodes.policies import Observation, Policy
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.checkpoint import CheckpointMeta
from socialai_dsl.trainer.config import scenario_in
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.features import Int64
from socialai_dsl.trainer.nets import NetSpec
from socialai_dsl.trainer.shipped import located
from socialai_dsl.trainer.training import restore_algorithm

_WORDS_SHOWN = 6


class CheckpointPolicy:
    """A trained agent, played as its algorithm prescribes; `load` makes one.

    That of PPO samples its actions, as in the paper, or takes the most probable ones if `greedy`; see
    `socialai_dsl.trainer.policy.NetPolicy`.

    Attributes:
        policy: what plays.
    """

    def __init__(self, policy: Policy) -> None:
        self.policy = policy

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
        algorithm: str | None = None,
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
            algorithm: `module:Class` of an algorithm of your own, for which the same holds.

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
        found = restore_algorithm(checkpoint, algorithm, folder)
        warn_of_differences(checkpoint.meta, envs.unwrapped.program)
        return cls(found.policy(restored.to(device), greedy, seed))

    def reset(self, mask: NDArray[np.bool_] | None = None, episodes: Int64 | None = None) -> None:
        """Forget the past where a new episode begins, `mask` bool (E,), or everywhere; see `Policy.reset`."""
        self.policy.reset(mask, episodes)  # type: ignore[arg-type]

    def act(self, observation: Observation) -> Int64:
        """Choose actions, int64 (E, heads), as `Policy.act` does; of a single observation one, int64 (heads,)."""
        return self.policy.act(observation)  # type: ignore[return-value]

    def __getattr__(self, name: str) -> Any:
        """Whatever else the policy has, such as `thought` and `net` of a network's."""
        if name == "policy":  # of a copy that has no attributes yet
            raise AttributeError(name)
        return getattr(self.policy, name)


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
