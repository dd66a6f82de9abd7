"""A trained agent as a folder that can be given to others."""

import shutil
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.atomic import read_json, write_json, write_text
from socialai_dsl.checking.loaded import Loaded, about_of
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.episodes.players import folder_of, require_trainer
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import load
from socialai_dsl.runs.copies import MovedScenario
from socialai_dsl.runs.folder import (
    CONFIG,
    FILM,
    LOCK_FILES,
    RESULT,
    only_writer,
    read_config,
    scenario_folder_name,
)
from socialai_dsl.runs.model_card import model_card
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.shipped import WEIGHTS

if TYPE_CHECKING:
    from socialai_dsl.trainer.checkpoint import Checkpoint

CARD: Final = "README.md"
VOCABULARY: Final = "vocabulary.json"
_EXPORTS: Final = Path("exports")


def export(agent: str | Path, out: Path | None = None) -> Path:
    """Write the folder of a trained agent, which is returned.

    Args:
        agent: the folder of a finished run, or `shipped:NAME`.
        out: the folder to write (default: `exports/<scenario>-<network>-s<seed>`).

    Raises:
        UsageError: there is no such agent, the run is not finished, or the folder is there already.
        OSError: a file cannot be written.
    """
    require_trainer()
    run = folder_of(str(agent))
    config, loaded, checkpoint = finished_agent(run)
    if compile_loaded(loaded).sha256 != checkpoint.meta.program_sha256:
        warnings.warn("the scenario has changed since the agent was trained on it", stacklevel=2)
    place = out or _EXPORTS / _name(config)
    if place.exists() and not place.is_dir():
        raise OptionError("out", f"{place} is a file; choose another folder")
    with only_writer(place):
        if any(file.name not in LOCK_FILES for file in place.iterdir()):
            raise OptionError("out", f"{place} is there already; choose another folder")
        if (run / FILM).is_file():
            shutil.copyfile(run / FILM, place / FILM)
        write_agent(place, config, loaded, checkpoint, read_json(run / RESULT))
    return place


def _name(config: RunConfig) -> str:
    net = config.net.replace(":", ".")
    return f"{scenario_folder_name(config.scenario)}-{net}-s{config.seed}"


def finished_agent(run: Path) -> "tuple[RunConfig, Loaded, Checkpoint]":
    """The configuration, the scenario and the network of a run's or an agent's folder.

    Raises:
        UsageError: it is not such a folder, it is not finished, or its agent was not trained.
    """
    from socialai_dsl.trainer import checkpoint as checkpoints
    from socialai_dsl.trainer.errors import CheckpointError

    config = read_config(run)
    if not config.trains:
        raise UsageError(f"{run}: the agent {config.agent!r} is not trained, there is nothing to export")
    if not (run / RESULT).is_file():
        raise UsageError(f"{run}: expected a finished run, it has no {RESULT}")
    loaded = load(config.played)
    try:
        return config, loaded, checkpoints.read_agent(run).network
    except CheckpointError as error:
        raise UsageError(str(error)) from error


def write_agent(
    out: Path,
    config: RunConfig,
    loaded: Loaded,
    checkpoint: "Checkpoint",
    result: Mapping[str, Any],
    agent: str = ".",
) -> None:
    """Write the folder of an agent: its weights, what they are for, its card, and the scenario unless that ships.

    Args:
        out: the folder, which is there.
        config: of the run.
        loaded: its scenario.
        checkpoint: its network.
        result: content of the run's `result.json`.
        agent: by which name `CheckpointPolicy.load` finds the agent, for its card.
    """
    from socialai_dsl.trainer import checkpoint as checkpoints

    moved = MovedScenario.of(loaded, config.played)
    moved.copy(out)
    # Paths of this machine stay here.
    kept = {"scenario": moved.scenario, "curriculum": _without_place(config.curriculum), "wandb": None}
    written = config.model_copy(update=kept).within(Path())
    for option in config.own_files.keys() & {"net", "algorithm"}:
        code = config.own_files[option]
        there = out / written.code_folder / code.relative_to(config.code_folder.resolve())
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(code, there)
    meta = checkpoint.meta.model_copy(update={"config": written})
    checkpoints.write_file(out / WEIGHTS, checkpoints.Checkpoint(meta, checkpoint.tensors))
    words = {name: getattr(meta, name) for name in ("vocabulary", "actions", "templates", "nouns")}
    write_json(out / VOCABULARY, words)
    result = moved.told({**result, "scenario": moved.scenario})
    write_text(out / CARD, model_card(written, result, about_of(loaded), agent, WEIGHTS))
    write_json(out / CONFIG, written.model_dump())
    write_json(out / RESULT, result)  # last, so that its presence means a complete folder


def _without_place(text: str) -> str:
    """A file's name without its folders; anything else as it is."""
    return Path(text).name if text.endswith((".yaml", ".yml")) else text
