"""Published figures beside ours: Welch's test from means, deviations and numbers of seeds, and a verdict in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from socialai_dsl.experiments.record import Reference
from socialai_dsl.reporting.statistics import ALPHA, Sample, Test, bonferroni, welch

MARGIN: Final = 0.10
"""Two success rates match where the whole interval of their difference lies within so much of 0."""


class Figure(NamedTuple):
    """A published figure and ours.

    Attributes:
        group: the table or case study that it belongs to. condition: its name.
        test: the further test that the figure is of; empty for the condition's own scenario.
        ours: success on the test episodes, a value for each seed that is done.
        reference: what was published.
    """

    group: str | None
    condition: str
    test: str
    ours: Sequence[float]
    reference: Reference


def against_published(figures: Sequence[Figure]) -> list[dict[str, Any]]:
    """A row of figures for each: ours, theirs, difference (ours minus theirs) with interval, test, verdict.

    Args:
        figures: of one table; p is corrected for all of them that can be tested.
    """
    tests = [_test(figure) for figure in figures]
    corrected = bonferroni([test.p if test else None for test in tests])
    return [_row(*parts) for parts in zip(figures, tests, corrected, strict=True)]


def sample_of(reference: Reference) -> Sample:
    """A published figure as Welch's test takes it: a deviation of the population becomes one of the sample."""
    std, n = reference.std, reference.n
    if std is not None and n is not None and reference.deviation == "population":
        std *= math.sqrt(n / (n - 1))
    return Sample(reference.mean, std, n)


def _test(figure: Figure) -> Test | None:
    return welch(Sample.of(figure.ours), sample_of(figure.reference)) if len(figure.ours) else None


def _row(figure: Figure, test: Test | None, corrected: float | None) -> dict[str, Any]:
    ours, reference = Sample.of(figure.ours) if len(figure.ours) else None, figure.reference
    return {
        "group": figure.group,
        "condition": figure.condition,
        "test": figure.test or None,
        "seeds": len(figure.ours),
        "success_mean": ours.mean if ours else None,
        "success_std": ours.std if ours else None,
        "published_mean": reference.mean,
        "published_std": reference.std,
        "published_n": reference.n,
        "published_deviation": reference.deviation if reference.std is not None else None,
        "difference": test.difference if test else None,
        "difference_low": test.low if test else None,
        "difference_high": test.high if test else None,
        "welch_t": test.t if test else None,
        "degrees_of_freedom": test.degrees if test else None,
        "p": test.p if test else None,
        "p_bonferroni": corrected,
        "verdict": _verdict(figure, test, corrected),
        "source": reference.source,
        "note": reference.note,
    }


def _verdict(figure: Figure, test: Test | None, corrected: float | None) -> str:
    if test is None:
        return "no result"
    if corrected is None or test.low is None or test.high is None:
        return f"not testable: {_why_not(figure)}"
    differs, near = corrected < ALPHA, test.low >= -MARGIN and test.high <= MARGIN
    if differs:
        return f"differs, by less than {MARGIN:.2f}" if near else "differs"
    return f"matches within {MARGIN:.2f}" if near else "not shown to differ"


def _why_not(figure: Figure) -> str:
    """Why Welch's test says nothing."""
    if len(figure.ours) < 2:
        return "one seed of ours"
    if figure.reference.std is None:
        return "no standard deviation published"
    return "number of seeds not published" if figure.reference.n is None else "no spread in either"
