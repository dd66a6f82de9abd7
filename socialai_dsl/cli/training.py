"""From a run's configuration to a trained agent, with its progress on the terminal."""

import contextlib
import json
import shutil
import traceback
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import socialai_dsl
from socialai_dsl.atomic import write_text
from socialai_dsl.checking.loaded import Loaded, about_of
from socialai_dsl.cli.learnt import Learnt
from socialai_dsl.cli.progress import TrainingProgress
from socialai_dsl.cli.stopping import Stop
from socialai_dsl.envs.factory import compiled
from socialai_dsl.errors import RunFailed, UsageError
from socialai_dsl.evaluation.model_card import model_card
from socialai_dsl.evaluation.scripts import script_of, with_script
from socialai_dsl.evaluation.testing import Evaluation
from socialai_dsl.program_suite import Playable
from socialai_dsl.replay.endings import endings_of
from socialai_dsl.replay.page import replay_page
from socialai_dsl.runs.folder import (
    CARD,
    CHECKPOINTS,
    CONFIG,
    CURVE,
    FAILURE,
    FILM,
    LOCK_FILES,
    METRICS,
    REPLAY,
    TRANSCRIPT,
    scenario_folder_name,
)
from trainer.config import RunConfig
from trainer.files import checkpoint_files

if TYPE_CHECKING:
    from socialai_dsl.cli.tracking import WandbTracker


def discard_unstarted(folder: Path, copied: Iterable[Path]) -> None:
    """Take back the folder of a run that could not even begin, so that the same command can be given again.

    Args:
        folder: of the run.
        copied: what was copied into it, which is removed.
    """
    checkpoints = folder / CHECKPOINTS
    if not checkpoint_files(checkpoints):
        for copy in copied:
            shutil.rmtree(copy) if copy.is_dir() else copy.unlink()
        for file in (CONFIG, *LOCK_FILES):
            (folder / file).unlink(missing_ok=True)
        for empty in (checkpoints, folder):
            with contextlib.suppress(OSError):  # it is not there, or holds files of the user's
                empty.rmdir()


def training_figures(folder: Path) -> dict[str, Any]:
    """Frames, seconds and speed of the whole run, all its parts together if it was resumed."""
    lines = (folder / METRICS).read_text(encoding="utf-8").splitlines()
    seconds, frames = 0.0, 0
    for row in map(json.loads, lines):
        seconds += (row["frames"] - frames) / row["frames_per_second"]
        frames = row["frames"]
    return {
        "frames": frames,
        "train_seconds": round(seconds, 3),
        "frames_per_second": round(frames / seconds, 1),
    }


def train_agent(
    config: RunConfig, loaded: Loaded, program: Playable, folder: Path, resume: bool, stream: IO[str]
) -> Path:
    """Train, show the progress on `stream`, and return the path of the final checkpoint.

    Args:
        config: of the run.
        loaded: its scenario.
        program: the same, compiled.
        folder: of the run.
        resume: go on where the run was stopped.
        stream: where the progress is shown.

    Raises:
        UsageError: the run cannot start, or its folder cannot be written.
        RunFailed: training broke down.
        KeyboardInterrupt: with a message that says how to go on.
    """
    from trainer.errors import TrainingStopped
    from trainer.ppo import train

    played = _played(config, loaded)
    scenario = program if played is loaded else compiled(played)
    envs = socialai_dsl.make_vec(scenario, num_envs=config.envs, copy=False, autoreset_mode="SameStep")
    total = config.updates * config.frames_per_update
    learnt = Learnt(loaded, endings_of(loaded, program))
    try:
        with Stop() as stop:
            with TrainingProgress(total, stream) as shown:

                def report(row: Mapping[str, Any]) -> None:
                    shown.update(
                        row["frames"], row["success"], row["frames_per_second"], learnt.sentence(row)
                    )

                tracker = _tracker(config, folder)
                trained = train(config, envs, folder, report, resume, tracker, program, stop.wished)
            stop.heed()
            return trained
    except TrainingStopped as error:
        raise RunFailed(str(error)) from error
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; go on with: socialai-run --resume {folder}") from None
    except Exception as error:
        if (place := _place_in_own_code(config, error)) is not None:
            raise UsageError(f"{place}: {type(error).__name__}: {error}") from error
        if isinstance(
            error, ValueError
        ):  # what the trainer says about options or a checkpoint that do not fit
            raise UsageError(str(error)) from error
        raise
    finally:
        envs.close()


def _played(config: RunConfig, loaded: Loaded) -> Loaded:
    """What is played while training: where a guide leads, the variant with the script that it may follow."""
    if config.guide == "none":
        return loaded
    if config.guide == "script":
        return with_script(config.played, loaded).loaded
    scripted = script_of(config.played, loaded)
    return loaded if scripted is None else scripted.loaded


def _place_in_own_code(config: RunConfig, error: BaseException) -> str | None:
    """`file:line` where the user's network, bonus, curriculum or guide raised an error; None if none of them did."""
    files = {str(file) for file in config.own_files.values()}
    places = [
        f"{frame.filename}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename in files
    ]
    return places[-1] if places else None


def _tracker(config: RunConfig, folder: Path) -> "WandbTracker | None":
    """Where the figures go besides the folder, if anywhere."""
    if config.wandb is None:
        return None
    from socialai_dsl.cli.tracking import WandbTracker

    name = f"{scenario_folder_name(config.scenario)} {folder.name}"
    return WandbTracker(config.wandb, folder, config.model_dump(), name)


def draw_curve(config: RunConfig, folder: Path, result: dict[str, Any]) -> None:
    """Draw the learning curve of a run into its folder."""
    from socialai_dsl.reporting.curve import draw_learning_curve, read_curve

    test = (result["frames"], result["eval"]["success_rate"], *result["eval"]["success_interval"])
    curve = read_curve(folder / METRICS, result["eval"]["endings"], test)
    title = f"{scenario_folder_name(config.scenario)}, {config.agent}, seed {config.seed}"
    draw_learning_curve(curve, title, folder / CURVE)


def write_card(
    config: RunConfig, loaded: Loaded, folder: Path, weights: Path, result: dict[str, Any]
) -> None:
    """Write the model card of a run into its folder."""
    place = weights.relative_to(folder).as_posix()
    write_text(folder / CARD, model_card(config.within(Path()), result, about_of(loaded), ".", place))


_REPLAYED: Final = 5
"""The number of failures, and of successes, that a run films."""


def record_run(evaluation: Evaluation, folder: Path, label: str) -> None:
    """Film the first success, or the first episode if there is none, and where there are both, the first failure.

    A page replays some successes and failures.
    """
    write_text(folder / REPLAY, replay_page(evaluation.traces(evaluation.to_replay(_REPLAYED))))
    success = evaluation.result.success
    shown = {(FILM, TRANSCRIPT): int(success.argmax())}
    if success.any() and not success.all():
        shown[f"{FAILURE}.gif", f"{FAILURE}.txt"] = int(success.argmin())
    for (film, transcript), number in shown.items():
        episode = evaluation.record(number, label)
        write_text(folder / transcript, episode.transcript())
        episode.save_film(folder / film)
