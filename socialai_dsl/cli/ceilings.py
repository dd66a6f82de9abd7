"""Baselines of a scenario: its script, chance, and an agent that meets no NPC."""

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.errors import UsageError
from socialai_dsl.run_folder import read_json, write_json

if TYPE_CHECKING:
    from socialai_dsl.reporting.analysis import Ceilings
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
    """What `baselines` measures, as reports take it.

    Raises:
        ScenarioError: the scenario has mistakes, or is no longer there.
    """
    from socialai_dsl.evaluation import baselines
    from socialai_dsl.reporting.analysis import Ceilings, Level

    found = baselines(scenario, _EPISODES, _ROOMS)
    script, chance, alone = (
        None if level is None else Level(level.value, level.error, level.sample)
        for level in (found.script, found.chance, found.without_npcs)
    )
    return Ceilings(oracle=script, random=chance, alone=alone, program_sha256=found.program_sha256)


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


def _error(rate: float, episodes: int) -> float:
    return float((rate * (1 - rate) / episodes) ** 0.5)
