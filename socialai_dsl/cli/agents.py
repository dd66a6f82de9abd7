"""This module trains agents for the commands, by way of the trainer."""

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final, Literal

from socialai_dsl.cli.errors import RunFailed, UsageError
from socialai_dsl.diagnostics import did_you_mean

if TYPE_CHECKING:
    from socialai_dsl.cli.settings import Settings
    from trainer.config import TrainConfig
    from trainer.metrics import Tracker
    from trainer.nets import Precision
    from trainer.team import Team

_DEFAULT_EXPLO_C: Final = {"lang": 7.0, "cell": 3.0}


def require_trainer() -> None:
    """Say how to install the trainer if it is missing.

    Raises:
        UsageError: it is.
    """
    if find_spec("torch") is None:
        raise UsageError("training and evaluating need PyTorch: pip install 'socialai-dsl[train]'")


def resolve_device(device: str) -> str:
    """`auto` is a graphics card where there is one.

    Raises:
        UsageError: `cuda` was asked for and is not there.
    """
    import torch

    available = torch.cuda.is_available()
    if device == "cuda" and not available:
        raise UsageError("--device cuda: PyTorch finds no CUDA device on this machine")
    return "cuda" if device == "cuda" or (device == "auto" and available) else "cpu"


def resolve_precision(choice: str, net: str, device: str) -> "Precision":
    """`auto` is the type in which the device computes this network fastest.

    Raises:
        UsageError: there is no such network.
    """
    from trainer.config import configure
    from trainer.nets import best_precision

    if choice == "bfloat16":
        return "bfloat16"
    if choice == "float32":
        return "float32"
    try:
        return best_precision(configure(net).net, device)
    except ValueError as error:
        raise UsageError(str(error)) from None


def resolve_exploration(kind: str, scenario: str) -> tuple[Literal["none", "lang", "cell"], float]:
    """Kind and scale of the exploration bonus; `auto` looks the scenario up in the paper's table."""
    import yaml

    import trainer
    from socialai_dsl.cli.run_folder import base_name

    table_file = Path(trainer.__file__).with_name("exploration.yaml")
    table = yaml.safe_load(table_file.read_text(encoding="utf-8"))
    listed = table.get(base_name(scenario), {"kind": "none"})
    if kind == "auto":
        kind = listed["kind"]
    scale = listed["c"] if kind == listed["kind"] and kind != "none" else _DEFAULT_EXPLO_C.get(kind, 0.0)
    if kind == "lang":
        return "lang", float(scale)
    return ("cell" if kind == "cell" else "none"), float(scale)


_BY_OPTION: Final = {
    "frames": "frames",
    "seed": "seed",
    "num_envs": "envs",
    "net": "net",
    "explo": "explo",
    "precision": "precision",
    "compile": "compile",
    "curriculum": "curriculum",
    "device": "device",
    "threads": "threads",
    "checkpoint_every": "checkpoint_every",
}
"""Fields of the trainer's configuration that have an option of their own, and its name."""


def resolve_hyper(given: Sequence[str]) -> dict[str, bool | int | float | str]:
    """Hyper-parameters given as NAME=VALUE, by name; whether their values are possible is the trainer's to say.

    Raises:
        UsageError: something else is given, or there is no such hyper-parameter.
    """
    from trainer.config import TrainConfig

    found: dict[str, bool | int | float | str] = {}
    free = [name for name in TrainConfig.model_fields if name not in (*_BY_OPTION, "tensorboard")]
    for text in given:
        name, equals, written = text.partition("=")
        if not equals or not written:
            raise UsageError(f"--hyper: got {text!r}, expected NAME=VALUE, such as lr=1e-4")
        if name in _BY_OPTION:
            raise UsageError(
                f"--hyper: {name} has an option of its own, --{_BY_OPTION[name].replace('_', '-')}"
            )
        if name not in free:
            near = did_you_mean(name, free)
            hint = f"did you mean {near}?" if near else f"expected one of {', '.join(free)}"
            raise UsageError(f"--hyper: got {name!r}; {hint}")
        if name in found:
            raise UsageError(f"--hyper: {name} is given twice")
        found[name] = _plain_value(name, written)
    return found


def _plain_value(name: str, written: str) -> bool | int | float | str:
    """A number, true or false as JSON writes them; else the word itself."""
    try:
        value = json.loads(written)
    except ValueError:
        return written
    if not isinstance(value, bool | int | float | str):
        raise UsageError(f"--hyper: got {name}={written}, expected a number, a word, true or false")
    return value


def default_envs(net: str) -> int:
    """How many environments an agent trains on unless told otherwise."""
    from trainer.config import configure

    return configure(net).num_envs


def train_config(settings: "Settings") -> "TrainConfig":
    """The trainer's configuration of a run.

    Raises:
        UsageError: a value is out of range.
    """
    from pydantic import ValidationError

    from trainer.config import PRESETS, configure

    given = {name: getattr(settings, option) for name, option in _BY_OPTION.items() if name != "net"}
    # A small batch of environments cannot be cut into as many parts as the default has; a preset's number is its own.
    parts = {} if settings.net in PRESETS else {"minibatches": min(4, settings.envs)}
    try:
        return configure(
            settings.net, **(parts | given | {"explo_c": settings.explo_c} | dict(settings.hyper))
        )
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"{place}: {first['msg']}, got {first['input']!r}") from None


@contextlib.contextmanager
def joined_team(settings: "Settings") -> Iterator["Team"]:
    """The processes that torchrun started to train together, or this one alone.

    Raises:
        UsageError: there are several, but nothing to train.
        RunFailed: another process is gone.
    """
    from trainer.errors import TrainingStopped
    from trainer.team import joined, started_together

    if started_together()[0] > 1 and settings.agent != "ppo":
        raise UsageError(f"the agent {settings.agent!r} is not trained, so torchrun can do nothing for it")
    try:
        with joined(settings.device) as team:
            yield team
    except TrainingStopped as error:
        raise RunFailed(str(error)) from error


def resolve_threads(threads: int) -> int:
    """So many CPU threads, or for 0 as many as the cores of this process's share of the machine, at most 4."""
    from trainer.crew import automatic_threads
    from trainer.team import started_together

    return threads or automatic_threads(started_together()[1])


def train_agent(settings: "Settings", folder: Path, resume: bool, stream: IO[str], team: "Team") -> Path:
    """Train, show the progress on `stream`, and return the path of the final checkpoint.

    All processes of the team call it; the one that writes shows the progress.

    Raises:
        UsageError: the run cannot start, or its folder cannot be written.
        RunFailed: training broke down.
        KeyboardInterrupt: with a message that says how to go on.
    """
    import socialai_dsl
    from socialai_dsl.cli.progress import TrainingProgress
    from trainer.errors import TrainingStopped
    from trainer.train import Progress, train

    config = train_config(settings)
    try:
        share = team.share(settings.envs)
    except ValueError as error:
        raise UsageError(f"--envs: {error}") from None
    envs = socialai_dsl.make_vec(settings.scenario, num_envs=share, copy=False, autoreset_mode="SameStep")
    total = config.updates * config.frames_per_update
    try:
        if not team.writes:
            return train(config, envs, folder, resume=resume, team=team)
        with TrainingProgress(total, stream) as shown:

            def report(progress: Progress) -> None:
                shown.update(progress.frames, progress.success_rate, progress.frames_per_second)

            tracker = _tracker(settings, config, folder)
            return train(config, envs, folder, progress=report, resume=resume, team=team, tracker=tracker)
    except TrainingStopped as error:
        if isinstance(error.__cause__, OSError):
            raise UsageError(str(error)) from error
        raise RunFailed(str(error)) from error
    except (
        ValueError
    ) as error:  # what the trainer says about a configuration or a checkpoint that does not fit
        raise UsageError(str(error)) from error
    except KeyboardInterrupt:
        command = f"socialai-run --resume {folder}"
        if team.size > 1:
            command = f"torchrun --nproc-per-node {team.here} --no-python {command}"
        raise KeyboardInterrupt(f"interrupted; go on with: {command}") from None
    finally:
        envs.close()


def _tracker(settings: "Settings", config: "TrainConfig", folder: Path) -> "Tracker | None":
    """Where the figures go besides the folder, if anywhere."""
    if settings.wandb is None:
        return None
    from socialai_dsl.cli.run_folder import scenario_folder_name
    from trainer.tracking import WandbTracker

    asked = asdict(settings) | {"trainer": config.model_dump()}
    name = f"{scenario_folder_name(settings.scenario)} {folder.name}"
    return WandbTracker(settings.wandb, folder, asked, name)
