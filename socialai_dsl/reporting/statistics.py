"""The statistics of a report: Welch's test, effect sizes, interquartile means, intervals.

Sources: B. L. Welch (1947) for the test; L. V. Hedges (1981) for the unbiased effect size; R. Agarwal et al. (2021),
"Deep reinforcement learning at the edge of the statistical precipice", for interquartile means over tasks and seeds
with intervals of a stratified bootstrap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import gammaln

from socialai_dsl.baselines import effective_trials, wilson

Float = NDArray[np.float64]

RESAMPLES: Final = 10_000
LEVEL: Final = 0.95
ALPHA: Final = 0.05


class Estimate(NamedTuple):
    """A figure with its interval, `LEVEL` of it."""

    value: float
    low: float
    high: float


class Sample(NamedTuple):
    """What Welch's test needs to know of a group of seeds.

    Attributes:
        mean: of their figures.
        std: their sample standard deviation, which divides by n - 1; None where it is unknown, as for one seed.
        n: how many; None where it is unknown.
    """

    mean: float
    std: float | None
    n: int | None

    @classmethod
    def of(cls, values: Sequence[float]) -> Sample:
        """The sample that these values are, at least one."""
        if len(values) < 2:
            return cls(float(np.mean(values)), None, len(values))
        alike = len(set(values)) == 1  # of which NumPy's deviation need not be 0
        return cls(float(np.mean(values)), 0.0 if alike else float(np.std(values, ddof=1)), len(values))


class Test(NamedTuple):
    """A comparison of two groups of seeds.

    All but `difference` are None where the test says nothing: a group of fewer than two or of unknown spread, or no
    spread in either.

    Attributes:
        difference: of the means, first minus second.
        t, degrees, p: Welch's statistic, its degrees of freedom, the two-sided p.
        low, high: the interval of the difference, `LEVEL` of it.
        g: Hedges' g.
    """

    difference: float
    t: float | None = None
    degrees: float | None = None
    p: float | None = None
    low: float | None = None
    high: float | None = None
    g: float | None = None


def compare(first: Sequence[float], second: Sequence[float]) -> Test:
    """Welch's t-test and Hedges' g of two groups.

    Raises:
        ValueError: a group is empty.
    """
    if not len(first) or not len(second):
        raise ValueError(f"got groups of {len(first)} and {len(second)}, expected at least one value in each")
    return welch(Sample.of(first), Sample.of(second))


def welch(first: Sample, second: Sample) -> Test:
    """Welch's t-test and Hedges' g of two groups of which mean, deviation and size are known."""
    difference = first.mean - second.mean
    spreads = [(one.std, one.n) for one in (first, second) if one.std is not None and one.n is not None]
    errors = [std**2 / n for std, n in spreads]
    variance = sum(errors)
    if len(spreads) < 2 or not variance:
        return Test(difference)
    shares = [(error / variance, n - 1) for error, (_, n) in zip(errors, spreads, strict=True)]
    degrees = 1 / sum(share**2 / freedom for share, freedom in shares)
    t = difference / math.sqrt(variance)
    p = 2 * float(stats.t.sf(abs(t), degrees))
    half = float(stats.t.ppf((1 + LEVEL) / 2, degrees)) * math.sqrt(variance)
    g = _hedges_g(difference, spreads)
    return Test(difference, t, degrees, p, difference - half, difference + half, g)


def _hedges_g(difference: float, spreads: Sequence[tuple[float, int]]) -> float:
    """Difference of the means in pooled standard deviations, times the factor that makes it unbiased (Hedges 1981).

    The factor is J(m) = Γ(m/2) / (√(m/2) Γ((m-1)/2)), with m = n1 + n2 - 2 degrees of freedom.
    """
    degrees = sum(n - 1 for _, n in spreads)
    pooled = math.sqrt(sum((n - 1) * std**2 for std, n in spreads) / degrees)
    factor = math.exp(gammaln(degrees / 2) - gammaln((degrees - 1) / 2)) / math.sqrt(degrees / 2)
    return float(difference / pooled * factor)


def bonferroni(ps: Sequence[float | None]) -> list[float | None]:
    """Each p times the number of tests that gave one, at most 1; so none of them is found by chance too often."""
    tests = sum(p is not None for p in ps)
    return [None if p is None else min(1.0, p * tests) for p in ps]


def interquartile_mean(scores: Sequence[Sequence[float]]) -> float:
    """Mean of the middle half of all scores together; the lowest and the highest quarter are left out.

    Args:
        scores: for each task those of its seeds.

    Raises:
        ValueError: there are none.
    """
    together = [score for task in scores for score in task]
    if not together:
        raise ValueError("scores: got none, expected at least one")
    return float(stats.trim_mean(together, 0.25))


def bootstrapped_iqm(
    scores: Sequence[Sequence[float]], resamples: int = RESAMPLES, seed: int = 0
) -> Estimate:
    """The interquartile mean with its percentile interval of a stratified bootstrap.

    Each resample draws, within each task, as many seeds as the task has, with replacement (Agarwal et al. 2021).

    Args:
        scores: for each task those of its seeds, at least one each.
        resamples: how many.
        seed: of the drawing.
    """
    generator = np.random.default_rng(seed)
    tasks = [np.asarray(task, np.float64) for task in scores]
    drawn = [task[generator.integers(0, len(task), (resamples, len(task)))] for task in tasks]
    means = stats.trim_mean(np.concatenate(drawn, axis=1), 0.25, axis=1)
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(interquartile_mean(scores), float(low), float(high))


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Student's interval, `LEVEL` of it, of the mean of what more seeds would give; None with fewer than two."""
    if len(values) < 2:
        return None
    half = stats.t.ppf((1 + LEVEL) / 2, len(values) - 1) * stats.sem(values)
    return float(np.mean(values) - half), float(np.mean(values) + half)


def paired_difference(first: Sequence[float], second: Sequence[float]) -> Estimate:
    """Mean difference of successes in the same rooms, first minus second, with its interval.

    The interval is that of Bonett and Price (2012): two rooms are added, one that the first alone solves and one that
    the second alone solves. So it is of use for few rooms, too, and where all differences are alike.

    Args:
        first: success in each room, 0 to 1.
        second: in the same rooms.

    Raises:
        ValueError: there is no room, or not as many on both sides.
    """
    if len(first) != len(second) or not len(first):
        raise ValueError(f"got {len(first)} and {len(second)} rooms, expected as many, at least one")
    differences = np.asarray(first, np.float64) - np.asarray(second, np.float64)
    added = np.append(differences, [1.0, -1.0])
    half = stats.norm.ppf((1 + LEVEL) / 2) * np.std(added) / math.sqrt(len(added))
    low, high = max(-1.0, np.mean(added) - half), min(1.0, np.mean(added) + half)
    return Estimate(float(np.mean(differences)), float(low), float(high))


def clustered_rate(successes: Sequence[float], episodes: Sequence[float]) -> Estimate | None:
    """A success rate with its interval where episodes come in clusters, such as those of a person; None of one cluster.

    It is Wilson's interval with the effective number of episodes, see `baselines.effective_trials`.

    Args:
        successes: of each cluster.
        episodes: of each cluster, at least one.

    Raises:
        ValueError: there is no cluster, or there are not as many on both sides.
    """
    effective = effective_trials(successes, episodes)
    if len(episodes) < 2:
        return None
    rate = sum(successes) / sum(episodes)
    return Estimate(rate, *wilson(rate, effective))


def frames_to(frames: Float, success: Float, threshold: float) -> float | None:
    """The end of the first bin in which a run's success reached a threshold; None if it never did.

    Args:
        frames: (B,) ends of the bins.
        success: (B,), nan where no episode ended.
        threshold: 0 to 1.
    """
    reached = np.flatnonzero(success >= threshold)  # which nan never is
    return float(frames[reached[0]]) if len(reached) else None


def area_under(success: Float) -> float | None:
    """Mean success over the frames of a run: the area under its curve, divided by its frames.

    Args:
        success: (B,) in bins of equal width; nan where no episode ended, which are left out.
    """
    known = success[~np.isnan(success)]
    return float(known.mean()) if len(known) else None
