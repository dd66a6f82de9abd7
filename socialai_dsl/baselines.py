"""How sure a success rate is, and what it is set beside."""

from __future__ import annotations

import math
from collections.abc import Sequence
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


def effective_trials(successes: Sequence[float], trials: Sequence[float]) -> float:
    """How many independent trials tell as much as trials that come in clusters, such as those of a person or a session.

    p (1 - p) over the variance of the ratio estimator between clusters, times (t of all trials / t of the clusters)
    squared for the degrees of freedom (Korn and Graubard 1998; with Wilson's interval: Franco, Little, Louis and Slud
    2019). There are never more than there are trials. Where all trials ended alike, so that no variance is known, each
    cluster counts once; so does a single one. Clusters of one trial each are trials.

    Args:
        successes: of each cluster.
        trials: of each cluster, at least one.

    Raises:
        ValueError: there is no cluster, or there are not as many on both sides.
    """
    if len(successes) != len(trials) or not len(trials):
        raise ValueError(f"got {len(successes)} and {len(trials)} clusters, expected as many, at least one")
    clusters, total = len(trials), float(sum(trials))
    rate = sum(successes) / total
    if total == clusters or clusters == 1 or rate in (0, 1):
        return float(clusters)
    squares = ((won - rate * played) ** 2 for won, played in zip(successes, trials, strict=True))
    variance = clusters / (clusters - 1) * math.fsum(squares) / total**2
    if not variance:
        return total
    freedom = (_quantile_of_t(round(total) - 1) / _quantile_of_t(clusters - 1)) ** 2
    return min(total, rate * (1 - rate) / variance * freedom)


def _quantile_of_t(freedom: int) -> float:
    """The two-sided 95 % quantile of Student's t, without SciPy, which only the extra `report` installs.

    The probability is a finite sum (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4).
    """
    low, high = 0.0, math.pi / 2
    for _ in range(53):
        angle = (low + high) / 2
        cosine, term, total = math.cos(angle), 1.0, 0.0
        for k in range(2 + freedom % 2, freedom + 1, 2):
            total += term
            term *= (k - 1) / k * cosine * cosine
        if freedom % 2:
            total *= math.cos(angle)
            inside = 2 / math.pi * (angle + math.sin(angle) * total)
        else:
            inside = math.sin(angle) * total
        low, high = (angle, high) if inside < 0.95 else (low, angle)
    return math.sqrt(freedom) * math.tan(low)


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
