"""What the success of a scenario is set beside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

MOST_EPISODES: Final = 1_000_000
"""The most test episodes of an evaluation: more than anybody waits for, few enough that their results fit in memory."""


@dataclass(frozen=True)
class Level:
    """The success rate of a policy that does not learn.

    Attributes:
        value: from 0 to 1. error: its standard error. sample: of what, in words.
    """

    value: float
    error: float
    sample: str


@dataclass(frozen=True)
class Baselines:
    """What a scenario's success is set beside; None what is not known.

    Attributes:
        script: the scenario's own script; None where it has none.
        chance: uniformly random actions.
        without_npcs: the least that an agent can get which neither sees nor hears an NPC; None of suites, and where
            there is no NPC.
        program_sha256: digest of the program that was played; empty where runs of an experiment told.
    """

    script: Level | None = None
    chance: Level | None = None
    without_npcs: Level | None = None
    program_sha256: str = ""
