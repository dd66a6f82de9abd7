"""How sure a success rate is, and what it is set beside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

MOST_EPISODES: Final = 1_000_000
"""The most test episodes of an evaluation: more than anybody waits for, few enough that their results fit in memory."""
_Z: Final = 1.959963984540054
"""The two-sided 95 % quantile of the normal distribution."""


def wilson(rate: float, trials: float) -> tuple[float, float]:
    """The 95 % confidence interval of a rate (Wilson 1927, the score interval without correction).

    Unlike rate ± 2 standard errors it stays within 0 and 1, and it has a width where all trials had one result.

    Args:
        rate: from 0 to 1.
        trials: above 0; any number, as an effective number of trials may be.
    """
    spread = _Z * _Z / trials
    centre = (rate + spread / 2) / (1 + spread)
    half = math.sqrt(rate * (1 - rate) * spread + spread * spread / 4) / (1 + spread)
    # At the ends the formula gives 0 and 1 but for rounding.
    return (0.0 if rate == 0 else centre - half), (1.0 if rate == 1 else centre + half)


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
    """Reference levels for the success in a scenario; None where one is not known.

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
