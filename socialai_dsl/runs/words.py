"""Finds what players say in which situation, and leaves the figures in a folder if one is named."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from socialai_dsl.atomic import write_json
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.partners import partners_of
from socialai_dsl.episodes.players import Agent, require_trainer
from socialai_dsl.evaluation.words import Words, words_of
from socialai_dsl.frontend import load
from socialai_dsl.runs.evaluate import made_player
from socialai_dsl.runs.folder import WORDS, new_folders


def words(
    agent: Agent,
    scenario: str,
    episodes: int = 500,
    *,
    seats: Mapping[str, str] = MappingProxyType({}),
    out: str | Path | None = None,
    **options: Any,
) -> Words:
    """Find what each seat says in which situation, and how much that tells, as `socialai words` does.

    Args:
        agent: who plays: `random`, `oracle` (each seat's own script), a run or a checkpoint; see `evaluate`.
        scenario: a path or a name.
        episodes: of the test set, how many.
        seats: who has other seats, `{"helper": "runs/help"}`; the agent has all that are left.
        out: a folder that gets the figures as `words.json`; reports take it.
        options: of a trained agent and of `random`, see `evaluate`.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: it is a suite, or an agent cannot play here (a ValueError).
        OSError: a file cannot be written.
    """
    player, loaded = made_player(agent, [scenario], options, None), load(scenario)
    partners = partners_of(list(seats.items()), scenario, compiled(loaded)) if seats else {}
    if any(one.is_trained for one in (player, *partners.values())):
        require_trainer()
    if out is None:
        return words_of(player, partners, scenario, loaded, episodes)
    with new_folders(Path(out)):
        found = words_of(player, partners, scenario, loaded, episodes)
        write_json(Path(out) / WORDS, found.figures())
    return found
