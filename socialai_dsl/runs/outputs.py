"""What a run leaves behind: films, transcripts, a page of episodes, a learning curve, a model card."""

import json
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.checking.loaded import Loaded, about_of
from socialai_dsl.evaluation.test_set import Evaluation
from socialai_dsl.runs.folder import (
    CARD,
    CURVE,
    FAILURE,
    FILM,
    METRICS,
    REPLAY,
    TRANSCRIPT,
    scenario_folder_name,
)
from socialai_dsl.runs.model_card import model_card
from socialai_dsl.runs.recordings import write_tables
from socialai_dsl.traces.page import replay_page
from socialai_dsl.trainer.config import RunConfig

_FAILURE: Final = (f"{FAILURE}.gif", f"{FAILURE}.txt")
"""Film and transcript of a failure."""

_REPLAYED: Final = 5
"""The number of failures, and of successes, that the page of a run replays."""


def record_run(evaluation: Evaluation, folder: Path, label: str) -> None:
    """Film the first success, or the first episode if there is none, and where there are both, the first failure.

    What an earlier test of the run left of a failure goes: it is of another agent.

    A page replays some successes and failures, and tables list all episodes, and whom the player asked.
    """
    write_tables(evaluation, folder)
    write_text(folder / REPLAY, replay_page(evaluation.traces(evaluation.to_replay(_REPLAYED))))
    success = evaluation.result.success
    shown = {(FILM, TRANSCRIPT): int(success.argmax())}
    if success.any() and not success.all():
        shown[_FAILURE] = int(success.argmin())
    for name in _FAILURE:
        (folder / name).unlink(missing_ok=True)
    for (film, transcript), number in shown.items():
        episode = evaluation.record(number, label)
        write_text(folder / transcript, episode.transcript())
        episode.save_film(folder / film)


def draw_curve(config: RunConfig, folder: Path, result: dict[str, Any]) -> None:
    """Draw the learning curve of a run into its folder."""
    from socialai_dsl.reporting.curve import draw_learning_curve, read_curve  # they load Matplotlib

    test = (result["frames"], result["eval"]["success_rate"], *result["eval"]["success_interval"])
    curve = read_curve(folder / METRICS, result["eval"]["endings"], test)
    title = f"{scenario_folder_name(config.scenario)}, {config.player}, seed {config.seed}"
    draw_learning_curve(curve, title, folder / CURVE)


def write_card(
    config: RunConfig, loaded: Loaded, folder: Path, weights: Path, result: dict[str, Any]
) -> None:
    """Write the model card of a run into its folder."""
    place = weights.relative_to(folder).as_posix()
    write_text(folder / CARD, model_card(config.within(Path()), result, about_of(loaded), ".", place))


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
