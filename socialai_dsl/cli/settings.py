"""This module is what a run was asked for, as its folder remembers it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from socialai_dsl.cli.errors import UsageError
from socialai_dsl.cli.run_folder import SETTINGS, read_json


@dataclass(frozen=True)
class Settings:
    """What a run was asked for, kept in its folder so that it can be resumed.

    Attributes:
        scenario: path or name, with variants and parameters.
        agent: `ppo`, `random`, `oracle`, `human`, or the path of a checkpoint or run folder.
        seed: of training, or of what an agent draws that is not trained; the test set is always the same.
        frames: to train for, 0 for agents that are not trained here.
        envs: environments stepped together while training.
        net: the network or preset, as the trainer names it.
        explo: exploration bonus, `none`, `lang` or `cell`, with `auto` resolved.
        explo_c: scale of the bonus.
        device: where the network runs.
        precision: number type of the network's bulk of arithmetic, with `auto` resolved.
        compile: whether torch.compile makes the part of the network that reads images and dialogue.
        hyper: hyper-parameters of the trainer that are not as its network or preset has them, by name.
        curriculum: who chooses the members of a suite while training, as the trainer names it; `none`: chance.
        threads: CPU threads that train, in each process; bits depend on them, so "one per core" is resolved. 0 for
            agents that are not trained here.
        checkpoint_every: updates between checkpoints.
        wandb: project of Weights & Biases that is sent the figures; None: they stay here.
        eval_episodes: how many episodes of the test set are played, from the first on.
    """

    scenario: str
    agent: str
    seed: int
    frames: int
    envs: int
    net: str
    explo: Literal["none", "lang", "cell"]
    explo_c: float
    device: str
    eval_episodes: int
    precision: Literal["float32", "bfloat16"] = "float32"
    compile: bool = False
    hyper: Mapping[str, bool | int | float | str] = field(default_factory=dict)
    curriculum: str = "none"
    threads: int = 0
    checkpoint_every: int = 50
    wandb: str | None = None


def read_settings(folder: Path) -> Settings:
    """What the run of a folder was asked for.

    Raises:
        UsageError: it is not a run's folder, or its settings are damaged.
    """
    from pydantic import TypeAdapter, ValidationError

    if not (folder / SETTINGS).is_file():
        raise UsageError(f"{folder} is not a run's folder, it has no {SETTINGS}")
    content = read_json(folder / SETTINGS)
    content.pop("trainer", None)
    try:
        # As JSON, because strict validation of a dataclass takes no dict from Python.
        return TypeAdapter(Settings).validate_json(json.dumps(content), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"{folder / SETTINGS}: {place}: {first['msg']}") from None
