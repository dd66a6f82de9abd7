"""Players: random actions, a script, a person, a language model or a trained network."""

import warnings
from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from socialai_dsl.cli.language_model import PREFIX

if TYPE_CHECKING:
    from socialai_dsl.evaluation import Policy


@dataclass(frozen=True)
class Player:
    """A player and its options.

    Attributes:
        agent: `random`, `oracle`, `human`, `llm:MODEL`, `shipped:NAME`, or the path of a run, of a folder of
            checkpoints or of one.
        device: where a network runs.
        greedy: whether a network takes its most probable action instead of sampling.
        seed: of what a network or `random` draws; rooms do not depend on it.
        net: name of a network that does not ship, whose code is imported if a checkpoint asks for it.
        folder: where the file of such a network is looked for first.
        out, options: where the transcripts of a language model go, and how it is asked.
    """

    agent: str
    device: str = "cpu"
    greedy: bool = False
    seed: int = 0
    net: str | None = None
    folder: Path = Path()
    out: Path = Path()
    options: Namespace | None = None

    @property
    def is_trained(self) -> bool:
        """Whether a network plays."""
        return self.agent not in ("random", "oracle", "human") and not self.agent.startswith(PREFIX)

    @property
    def manner(self) -> str:
        """How actions come about, in a phrase; empty where there is nothing to say."""
        if self.options is not None:
            return f"{self.options.style} and {self.options.mode}, {self.options.history} observations"
        if self.agent in ("oracle", "human"):
            return ""
        return "most probable actions" if self.greedy else f"sampled actions, seed {self.seed}"


def make_policy(player: Player, envs: Any) -> "tuple[Policy, list[str]]":
    """The policy of a player, and remarks about it, such as another scenario in training.

    Raises:
        ValueError: the checkpoint does not fit the environments.
    """
    from socialai_dsl.evaluation import RandomPolicy, ScriptedPolicy

    if player.agent == "random":
        return RandomPolicy(tuple(int(n) for n in envs.single_action_space.nvec), player.seed), []
    if player.agent == "oracle":
        return ScriptedPolicy(envs), []
    from trainer.play import CheckpointPolicy

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        policy = CheckpointPolicy.load(
            player.agent, envs, player.greedy, player.seed, player.device, player.net, player.folder
        )
    return policy, [str(warning.message) for warning in caught]
