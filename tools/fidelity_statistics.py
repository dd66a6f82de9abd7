"""Tests whether two samples of episodes can be of one environment."""

import math
from dataclasses import dataclass
from typing import Final

from socialai_dsl.evaluation.chance import Sample

LIMIT: Final = 3.5
"""How many combined standard errors two mean lengths may lie apart."""

LEAST_P: Final = 5e-4
"""The least p of Fisher's test that passes; about as rare as `LIMIT` standard errors."""

_ROUNDING: Final = 0.01 / math.sqrt(12)
"""Standard error that giving a mean to two decimals adds."""


@dataclass(frozen=True)
class Published:
    """Figures of another implementation.

    Attributes:
        episodes, successes: counts.
        mean_length: in steps, to two decimals.
        sd_length: None where it is not known.
        mean_reward: None where it is not known.
    """

    episodes: int
    successes: int
    mean_length: float
    sd_length: float | None = None
    mean_reward: float | None = None


@dataclass(frozen=True)
class Comparison:
    """Two samples side by side.

    Attributes:
        published, ours: what is compared.
        distance: of the mean lengths, in combined standard errors.
        p: of Fisher's two-sided exact test on the successes.
    """

    published: Published
    ours: Sample
    distance: float
    p: float

    @property
    def agrees(self) -> bool:
        """Whether nothing speaks against one and the same environment."""
        return abs(self.distance) <= LIMIT and self.p >= LEAST_P


def compare(published: Published, ours: Sample) -> Comparison:
    """Compare lengths and successes. An unknown standard deviation is taken to be ours."""
    theirs = published.sd_length if published.sd_length is not None else ours.sd_length
    error = math.sqrt(theirs**2 / published.episodes + ours.sd_length**2 / ours.episodes + _ROUNDING**2)
    p = fisher_exact(published.successes, published.episodes, ours.successes, ours.episodes)
    return Comparison(published, ours, (ours.mean_length - published.mean_length) / error, p)


def fisher_exact(successes: int, trials: int, other_successes: int, other_trials: int) -> float:
    """Two-sided p of Fisher's exact test: the probability, margins given, of tables no likelier than this one.

    Raises:
        ValueError: a count of successes is negative or greater than its trials.
    """
    for count, of in ((successes, trials), (other_successes, other_trials)):
        if not 0 <= count <= of:
            raise ValueError(f"successes: got {count} of {of}, expected a number from 0 to {of}")
    both, everything = successes + other_successes, trials + other_trials

    def log_probability(first: int) -> float:
        ways = _log_choose(trials, first) + _log_choose(other_trials, both - first)
        return ways - _log_choose(everything, both)

    observed = log_probability(successes)
    possible = range(max(0, both - other_trials), min(trials, both) + 1)
    # Equally likely tables differ in the last digits of the logarithms.
    likely = (log_probability(first) for first in possible)
    return min(1.0, math.fsum(math.exp(chance) for chance in likely if chance <= observed + 1e-7))


def _log_choose(n: int, k: int) -> float:
    return math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1)
