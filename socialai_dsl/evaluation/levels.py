"""What a scenario's success is set beside: its script, chance, and an agent that meets no NPC."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from socialai_dsl.analysis.depth import without_npcs
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.atomic import write_json
from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.episodes.players import Player
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.test_set import play_test_set
from socialai_dsl.frontend import load


def baselines(scenario: str, episodes: int = 500, rooms: int = 32) -> Baselines:
    """Play the test episodes with the script and at random, and search for what is possible without the NPCs.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        episodes: of the test set, for script and chance.
        rooms: to search.

    Raises:
        ScenarioError: the scenario has mistakes.
    """
    loaded = load(scenario)
    try:
        script = _played(scenario, "oracle", episodes)
    except UsageError:
        script = None
    return Baselines(
        script=script,
        chance=_played(scenario, "random", episodes),
        without_npcs=_alone(loaded, rooms),
        program_sha256=compile_loaded(loaded).sha256,
    )


def read_baselines(file: Path) -> dict[str, Baselines]:
    """By scenario what `update_baselines` measured; nothing if the file is missing or damaged."""
    try:
        return TypeAdapter(dict[str, Baselines]).validate_json(file.read_bytes())
    except (OSError, ValidationError):
        return {}


def update_baselines(
    scenarios: Iterable[str], file: Path, tell: Callable[[str], None]
) -> tuple[dict[str, Baselines], list[str]]:
    """Measure the scenarios that the file does not have, or that have changed since, and keep them there.

    Args:
        scenarios: paths or names.
        file: is written after each scenario.
        tell: takes a line before each that is measured.

    Returns:
        By scenario its baselines, and a remark for each scenario that cannot be played.
    """
    known, remarks = read_baselines(file), []
    for scenario in scenarios:
        try:
            if scenario not in known or known[scenario].program_sha256 != _digest(scenario):
                tell(f"{scenario}: playing the script, at random, and without NPCs")
                known[scenario] = baselines(scenario)
                write_json(file, {name: asdict(one) for name, one in known.items()})
        except ScenarioError as error:
            known.pop(scenario, None)
            remarks.append(f"{scenario}: nothing to set beside it: {error.diagnostics[0].message}")
    return known, remarks


def _digest(scenario: str) -> str:
    return compile_loaded(load(scenario)).sha256


def _played(scenario: str, agent: str, episodes: int) -> Level:
    loaded = load(scenario)
    result = play_test_set(Player(agent), scenario, loaded, compile_loaded(loaded), episodes).result
    return Level(result.success_rate, result.success_rate_se, f"{episodes} test episodes")


def _alone(loaded: Loaded, rooms: int) -> Level | None:
    if isinstance(loaded, LoadedSuite):
        return None
    alone = without_npcs(loaded, Effort(rooms=rooms))
    if alone is None:
        return None
    undecided = f", {alone.undecided} undecided" if alone.undecided else ""
    return Level(alone.success, alone.error, f"{alone.rooms} rooms{undecided}")
