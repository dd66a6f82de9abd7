"""Baselines of a scenario: its script, chance, and an agent that meets no NPC."""

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.errors import UsageError
from socialai_dsl.cli.run_folder import read_json, write_json

if TYPE_CHECKING:
    from socialai_dsl.checking.loaded import Loaded
    from socialai_dsl.reporting.analysis import Ceilings, Level
    from socialai_dsl.reporting.collect import Experiment

FILE: Final = "ceilings.json"
_EPISODES: Final = 500
_ROOMS: Final = 32
_BUILT_IN: Final = ("oracle", "random")


def known_ceilings(experiment: "Experiment") -> "dict[str, Ceilings]":
    """The baselines, by scenario, from conditions of the experiment that play the script or chance."""
    from socialai_dsl.reporting.analysis import Ceilings, Level

    told: dict[str, dict[str, Level]] = {}
    for condition in experiment.conditions:
        entry = condition.entry
        rates = [run.figures for run in condition.done if run.figures is not None]
        if entry.agent in _BUILT_IN and rates:
            value = sum(one.success_rate for one in rates) / len(rates)
            episodes = sum(one.episodes for one in rates)
            level = Level(value, _error(value, episodes), f"{entry.name}, {episodes:,} episodes")
            told.setdefault(entry.scenario, {})[entry.agent] = level
    return {s: Ceilings(oracle=one.get("oracle"), random=one.get("random")) for s, one in told.items()}


def measured_ceilings(scenario: str) -> "Ceilings":
    """Play the test episodes with the script and at random, and search for what is possible without the NPCs.

    Raises:
        ScenarioError: the scenario has mistakes, or is no longer there.
    """
    import socialai_dsl
    from socialai_dsl.checking.loaded import LoadedScenario
    from socialai_dsl.reporting.analysis import Ceilings

    loaded = socialai_dsl.load(scenario)
    return Ceilings(
        oracle=_played(scenario, "oracle"),
        random=_played(scenario, "random"),
        alone=_alone(loaded) if isinstance(loaded, LoadedScenario) else None,
        program_sha256=socialai_dsl.compile(loaded).sha256,
    )


def read_ceilings(path: Path) -> "dict[str, Ceilings]":
    """The baselines that an earlier report of the same folder measured; none if their file is missing or damaged."""
    from pydantic import TypeAdapter, ValidationError

    from socialai_dsl.reporting.analysis import Ceilings

    try:
        return TypeAdapter(dict[str, Ceilings]).validate_python(read_json(path))
    except (OSError, UsageError, ValidationError):
        return {}


def write_ceilings(path: Path, ceilings: "dict[str, Ceilings]") -> None:
    """Keep what was measured for the next report."""
    write_json(path, {scenario: asdict(one) for scenario, one in ceilings.items()})


def is_current(scenario: str, ceilings: "Ceilings") -> bool:
    """Whether the scenario compiles to the program that was measured.

    Raises:
        ScenarioError: the scenario has mistakes, or is no longer there.
    """
    import socialai_dsl

    return socialai_dsl.compile(socialai_dsl.load(scenario)).sha256 == ceilings.program_sha256


def scenarios_of(experiment: "Experiment") -> Iterable[str]:
    """The scenarios of its conditions, each once."""
    return dict.fromkeys(condition.entry.scenario for condition in experiment.conditions)


def _played(scenario: str, agent: str) -> "Level | None":
    """None where the scenario has no script."""
    from socialai_dsl.cli.evaluation import evaluate_agent
    from socialai_dsl.cli.player import Player
    from socialai_dsl.reporting.analysis import Level

    try:
        result = evaluate_agent(Player(agent), scenario, _EPISODES).result
    except UsageError:
        return None
    return Level(result.success_rate, result.success_rate_se, f"{_EPISODES} test episodes")


def _alone(loaded: "Loaded") -> "Level | None":
    """None where there is no NPC."""
    from socialai_dsl.analysis.depth import without_npcs
    from socialai_dsl.analysis.effort import Effort
    from socialai_dsl.checking.loaded import LoadedScenario
    from socialai_dsl.reporting.analysis import Level

    assert isinstance(loaded, LoadedScenario), "internal: a suite is no room"
    alone = without_npcs(loaded, Effort(rooms=_ROOMS))
    if alone is None:
        return None
    undecided = f", {alone.undecided} undecided" if alone.undecided else ""
    return Level(alone.success, alone.error, f"{alone.rooms} rooms{undecided}")


def _error(rate: float, episodes: int) -> float:
    return float((rate * (1 - rate) / episodes) ** 0.5)
