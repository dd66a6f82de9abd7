"""Lets everybody play with everybody, and leaves a folder of figures and a picture if one is named."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.episodes.players import Agent, require_trainer
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.evaluation.crossplay import CrossPlay, cross_play
from socialai_dsl.evaluation.sessions import recordings_of, who_has_played
from socialai_dsl.frontend import load
from socialai_dsl.runs.evaluate import made_player
from socialai_dsl.runs.folder import CROSSPLAY, new_folders
from socialai_dsl.runs.report import require_libraries
from socialai_dsl.trainer.config import MODEL_PREFIX

PICTURE: Final = "crossplay"
"""The name of the picture, without its endings."""


def crossplay(
    agents: Sequence[Agent],
    scenario: str,
    episodes: int = 100,
    *,
    out: str | Path | None = None,
    **options: Any,
) -> CrossPlay:
    """Let everybody play with everybody, and with themselves, as `socialai crossplay` does.

    Args:
        agents: `random`, `oracle` (each seat's own script), runs, checkpoints, `llm:MODEL`, and `rival:NAME`, which
            plays the agent alone; see `evaluate`. The folder of a person's session there is the pair that it holds.
        scenario: a path or a name, with several seats.
        episodes: of each pair.
        out: a folder that gets the figures as `crossplay.json`, and a picture of them as PNG and SVG; reports take it.
            Language models need one: each pair with one has its transcripts there, in a folder of its own.
        options: of language models, see `evaluate`; a budget is that of a pair.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: it has one seat, or an agent cannot play here, or a library is missing (a ValueError).
        RunFailed: a language model has spent its budget of a pair.
        OSError: a file cannot be written.
    """
    models = [isinstance(agent, str) and agent.startswith(MODEL_PREFIX) for agent in agents]
    if options and not any(models):
        raise OptionError(min(options), "it is for language models, and none plays")
    players = [
        who_has_played(agent, scenario) or made_player(agent, [scenario], options if is_model else {}, None)
        for agent, is_model in zip(agents, models, strict=True)
    ]
    if any(player.is_person and player.run is None for player in players):
        raise UsageError(
            "crossplay: got a person, expected random, oracle, a rival, a run, a checkpoint, a language model, or what "
            "a person has played by `socialai evaluate human`"
        )
    if any(player.is_trained for player in players):
        require_trainer()
    recordings = recordings_of(players, scenario, episodes)
    if out is None:
        return cross_play(players, scenario, load(scenario), episodes, recordings=recordings)
    require_libraries("matplotlib")
    with new_folders(Path(out)):
        found = cross_play(players, scenario, load(scenario), episodes, Path(out), recordings)
        write(found, Path(out))
    return found


def write(found: CrossPlay, out: Path) -> None:
    """Write the figures and the picture of them into a folder that is there."""
    from socialai_dsl.reporting.crossplay import matrices_figure  # it loads Matplotlib
    from socialai_dsl.reporting.records import CrossPlayRecord
    from socialai_dsl.reporting.style import saved

    write_json(out / CROSSPLAY, found.figures())
    figure = matrices_figure(CrossPlayRecord.model_validate(found.figures()))
    for form in ("png", "svg"):
        (out / f"{PICTURE}.{form}").write_bytes(saved(figure, form))
