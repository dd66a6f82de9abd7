"""What a scenario's success is set beside: its script, chance, and an agent that meets no NPC."""

from __future__ import annotations

from dataclasses import dataclass

import socialai_dsl
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.players import Player
from socialai_dsl.evaluation.testing import evaluate_agent


@dataclass(frozen=True)
class Level:
    """A share of successes.

    Attributes:
        value: the share. error: its standard error. sample: of what, in words.
    """

    value: float
    error: float
    sample: str


@dataclass(frozen=True)
class Baselines:
    """What a scenario's success is set beside.

    Attributes:
        script: the scenario's own script; None where it has none.
        chance: uniformly random actions.
        without_npcs: the least that an agent can get which neither sees nor hears an NPC; None of suites, and where
            there is no NPC.
        program_sha256: digest of the program that was played.
    """

    script: Level | None
    chance: Level
    without_npcs: Level | None
    program_sha256: str


def baselines(scenario: str, episodes: int = 500, rooms: int = 32) -> Baselines:
    """Play the test episodes with the script and at random, and search for what is possible without the NPCs.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        episodes: of the test set, for script and chance.
        rooms: to search.

    Raises:
        ScenarioError: the scenario has mistakes.
    """
    loaded = socialai_dsl.load(scenario)
    try:
        script = _played(scenario, "oracle", episodes)
    except UsageError:
        script = None
    return Baselines(
        script=script,
        chance=_played(scenario, "random", episodes),
        without_npcs=_alone(loaded, rooms),
        program_sha256=socialai_dsl.compile(loaded).sha256,
    )


def _played(scenario: str, agent: str, episodes: int) -> Level:
    result = evaluate_agent(Player(agent), scenario, episodes).result
    return Level(result.success_rate, result.success_rate_se, f"{episodes} test episodes")


def _alone(loaded: socialai_dsl.LoadedScenario | socialai_dsl.LoadedSuite, rooms: int) -> Level | None:
    from socialai_dsl.analysis.depth import without_npcs
    from socialai_dsl.analysis.effort import Effort

    if isinstance(loaded, socialai_dsl.LoadedSuite):
        return None
    alone = without_npcs(loaded, Effort(rooms=rooms))
    if alone is None:
        return None
    undecided = f", {alone.undecided} undecided" if alone.undecided else ""
    return Level(alone.success, alone.error, f"{alone.rooms} rooms{undecided}")
