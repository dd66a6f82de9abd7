"""The figures of a report: spread over seeds, comparisons, aggregates, and runs that are too short."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Final

import numpy as np

from socialai_dsl.reporting.collect import Condition, Experiment
from socialai_dsl.reporting.records import Figures, Reference
from socialai_dsl.reporting.seeds import Seeds, align, mean_over_seeds
from socialai_dsl.reporting.statistics import (
    Estimate,
    Spread,
    Test,
    area_under,
    bonferroni,
    bootstrapped_iqm,
    compare,
    frames_to,
    paired_difference,
)

THRESHOLDS: Final = (0.25, 0.5, 0.75, 0.9)
RISING: Final = 0.05
"""A curve still rises if the last fifth of its training lies so far above the fifth before."""

SOLVED: Final = 0.95
"""With such a success on the test episodes it does not matter whether a curve still rises."""

_TABLES: Final = ("table2", None)
"""Groups that are tables; any other is a case study, whose rows are compared as well as its columns."""

TOGETHER: Final = 4
"""So many conditions of a case study are drawn in one panel; more get a panel for each column."""


@dataclass(frozen=True)
class Level:
    """The success rate of somebody who does not learn.

    Attributes:
        value: 0 to 1. error: its standard error. source: how it is known, in a phrase.
    """

    value: float
    error: float
    source: str


@dataclass(frozen=True)
class Ceilings:
    """What a scenario's success can be set beside; None what is not known.

    Attributes:
        oracle: the scenario's own script. random: uniform choice. alone: at least possible without the NPCs.
        program_sha256: of the program on which it was measured; empty if runs of the experiment told.
    """

    oracle: Level | None = None
    random: Level | None = None
    alone: Level | None = None
    program_sha256: str = ""


@dataclass(frozen=True)
class Efficiency:
    """How fast the seeds of a condition learned.

    Attributes:
        reached: for each of `THRESHOLDS` the frames of each seed, None where it never got there.
        areas: of each seed the area under its curve.
    """

    reached: tuple[tuple[float | None, ...], ...]
    areas: tuple[float, ...]


@dataclass(frozen=True)
class Summary:
    """What is known of a condition.

    Attributes:
        condition: whose. success: on the test episodes, over the seeds that are done.
        tests: the same of its further tests, by scenario.
        seeds: learning curves; None if no run has one.
        short: why it is too early to judge it, in phrases; nothing if it is not.
    """

    condition: Condition
    success: Spread
    tests: Mapping[str, Spread]
    seeds: Seeds | None
    short: tuple[str, ...]

    @property
    def name(self) -> str:
        """The condition's."""
        return self.condition.entry.name

    @property
    def reference(self) -> Reference | None:
        """The published figure."""
        return self.condition.entry.reference

    @cached_property
    def successes(self) -> frozenset[str]:
        """Which outcomes are successes, as far as results tell; by their names where they are older."""
        told = {e.outcome for f in self._figures for e in f.endings if e.success}
        known = {e.outcome for f in self._figures for e in f.endings}
        named = self.seeds.part("outcomes") if self.seeds is not None else {}
        guessed = {name for name in named if name not in known and _own(name).startswith("success")}
        return frozenset(told | guessed)

    @property
    def efficiency(self) -> Efficiency | None:
        """How fast its seeds learned; None without curves."""
        if self.seeds is None:
            return None
        curves, frames = self.seeds.success, self.seeds.frames
        areas = [area_under(curve) for curve in curves]
        return Efficiency(
            tuple(tuple(frames_to(frames, curve, level) for curve in curves) for level in THRESHOLDS),
            tuple(area for area in areas if area is not None),
        )

    @property
    def _figures(self) -> list[Figures]:
        return [run.result.eval for run in self.condition.done if run.result is not None]


def _own(outcome: str) -> str:
    """`dance: success@12` -> `success@12`."""
    return outcome.rpartition(": ")[2]


@dataclass(frozen=True)
class Comparison:
    """Two conditions side by side, with p after correction for all comparisons of their section."""

    first: str
    second: str
    test: Test
    adjusted: float | None


@dataclass(frozen=True)
class Pairing:
    """Two conditions in the same rooms.

    Attributes:
        first, second: names of the conditions.
        rooms: how many both played. ahead, behind: in how many of them the first, or the second, did better.
        difference: of the success, first minus second.
    """

    first: str
    second: str
    rooms: int
    ahead: int
    behind: int
    difference: Estimate


@dataclass(frozen=True)
class Aggregate:
    """Interquartile mean of a column.

    Attributes:
        column: which. rows: how many rows have results there. estimate: over these.
        common: over the rows in which every column has results; None if there are none.
    """

    column: str
    rows: int
    scores: int
    estimate: Estimate
    common: Estimate | None


@dataclass(frozen=True)
class Section:
    """A table of conditions, or a case study.

    Attributes:
        group: as the experiment calls it. summaries: in order.
        comparisons: of the columns of each row; in a case study also of the rows of each column.
        pairings: those of them that played the same test episodes, as far as runs list them.
        common_rows: see `Aggregate`.
    """

    group: str | None
    summaries: tuple[Summary, ...]
    comparisons: tuple[Comparison, ...]
    pairings: tuple[Pairing, ...] = ()
    aggregates: tuple[Aggregate, ...] = ()
    common_rows: int = 0

    @property
    def is_table(self) -> bool:
        """Whether it has rows and columns."""
        return self.group in _TABLES

    @property
    def rows(self) -> dict[str, list[Summary]]:
        """The conditions by row."""
        return self._by(row_of)

    @property
    def panels(self) -> dict[str, list[Summary]]:
        """The conditions that a figure shows together: those of a row; of a case study all, or those of a column."""
        if self.is_table or len(self.rows) == 1:
            return self.rows
        return (
            {self.group or "": list(self.summaries)}
            if len(self.summaries) <= TOGETHER
            else self._by(column_of)
        )

    @property
    def columns(self) -> list[str]:
        """Names of the columns, in order."""
        return list(dict.fromkeys(column_of(summary) for summary in self.summaries))

    def label(self, summary: Summary) -> str:
        """What tells a condition from the others of its panel."""
        if self.is_table or len(self.rows) == 1:
            return column_of(summary)
        return summary.name if len(self.summaries) <= TOGETHER else row_of(summary)

    def pairs(self) -> list[tuple[Summary, Summary]]:
        """The conditions that are compared: those that share a row, and in a case study those that share a column."""
        groups = [*self.rows.values(), *([] if self.is_table else self._by(column_of).values())]
        return [pair for members in groups for pair in combinations(members, 2)]

    def _by(self, key: Callable[[Summary], str]) -> dict[str, list[Summary]]:
        grouped: dict[str, list[Summary]] = {}
        for summary in self.summaries:
            grouped.setdefault(key(summary), []).append(summary)
        return grouped


@dataclass(frozen=True)
class Analysis:
    """All that a report says, as figures.

    Attributes:
        experiment: as it was read. sections: tables first.
        ceilings: by scenario. notes: what is to be known about how it was made.
    """

    experiment: Experiment
    sections: tuple[Section, ...]
    ceilings: Mapping[str, Ceilings]
    notes: tuple[str, ...] = field(default_factory=tuple)

    @property
    def summaries(self) -> list[Summary]:
        """Of all conditions."""
        return [summary for section in self.sections for summary in section.summaries]


def row_of(summary: Summary) -> str:
    """The row of a condition's table."""
    return summary.condition.entry.row or summary.name


def column_of(summary: Summary) -> str:
    """The column of a condition's table."""
    return summary.condition.entry.column or summary.condition.entry.agent


def analyse(experiment: Experiment, ceilings: Mapping[str, Ceilings], notes: Sequence[str] = ()) -> Analysis:
    """Compute all figures of a report. The learning curves are read here, one condition after the other."""
    summaries = [_summarise(condition) for condition in experiment.conditions]
    groups = list(dict.fromkeys(summary.condition.entry.group for summary in summaries))
    groups.sort(key=lambda group: group not in _TABLES)
    sections = tuple(
        _section(group, [one for one in summaries if one.condition.entry.group == group]) for group in groups
    )
    return Analysis(experiment, sections, ceilings, tuple(notes))


def _summarise(condition: Condition) -> Summary:
    success = Spread(tuple(run.figures.success_rate for run in condition.done if run.figures is not None))
    tests = {
        test: Spread(tuple(run.tests[test].success_rate for run in condition.runs if test in run.tests))
        for test in condition.entry.tests
    }
    curves = [updates for run in condition.runs if (updates := run.updates()) is not None]
    seeds = align(curves) if curves else None
    return Summary(condition, success, tests, seeds, tuple(_too_short(condition, success, seeds)))


def _too_short(condition: Condition, success: Spread, seeds: Seeds | None) -> list[str]:
    reasons = []
    missing = len(condition.runs) - len(condition.done)
    if missing:
        reasons.append(f"{missing} of {len(condition.runs)} seeds without a result")
    asked = condition.entry.frames
    if asked is not None and any(run.frames < asked for run in condition.done):
        least = min(run.frames for run in condition.done)
        reasons.append(f"a seed stopped at {least:,} of {asked:,} frames")
    rise = still_rising(seeds) if seeds is not None else None
    solved = success.n > 0 and success.mean >= SOLVED
    if rise is not None and rise > RISING and not solved:
        reasons.append(f"success still rises, by {rise:.2f} in the last fifth of training")
    return reasons


def still_rising(seeds: Seeds) -> float | None:
    """By how much the mean success of the last fifth of the bins exceeds that of the fifth before; None if unknown."""
    mean = mean_over_seeds(seeds.success)
    part = len(mean) // 5
    if part == 0:
        return None
    last, before = mean[-part:], mean[-2 * part : -part]
    if np.isnan(last).all() or np.isnan(before).all():
        return None
    return float(np.nanmean(last) - np.nanmean(before))


def _section(group: str | None, summaries: Sequence[Summary]) -> Section:
    bare = Section(group, tuple(_in_places_of_their_own(summaries)), ())
    found = [
        (first.name, second.name, compare(first.success.values, second.success.values))
        for first, second in bare.pairs()
        if first.success.n and second.success.n
    ]
    adjusted = bonferroni([test.p for *_, test in found])
    comparisons = tuple(Comparison(*one, p) for one, p in zip(found, adjusted, strict=True))
    pairings = tuple(pairing for pair in bare.pairs() if (pairing := pair_by_room(*pair)) is not None)
    if not bare.is_table:
        return Section(group, bare.summaries, comparisons, pairings)
    aggregates, common = _aggregates(bare)
    return Section(group, bare.summaries, comparisons, pairings, aggregates, common)


def pair_by_room(first: Summary, second: Summary) -> Pairing | None:
    """Compare two conditions in the test episodes that both list; None without such.

    The same number is the same room only in the same program.
    """
    digests = {
        run.result.program_sha256
        for summary in (first, second)
        for run in summary.condition.done
        if run.result is not None
    }
    one, other = first.condition.rooms, second.condition.rooms
    common = sorted(one.keys() & other.keys())
    if len(digests) != 1 or not common:
        return None
    here, there = [one[number] for number in common], [other[number] for number in common]
    return Pairing(
        first.name,
        second.name,
        len(common),
        sum(a > b for a, b in zip(here, there, strict=True)),
        sum(a < b for a, b in zip(here, there, strict=True)),
        paired_difference(here, there),
    )


def _in_places_of_their_own(summaries: Sequence[Summary]) -> list[Summary]:
    """Conditions that would share a place in the table get rows of their own, by their names."""
    taken = Counter((row_of(summary), column_of(summary)) for summary in summaries)
    return [
        summary if taken[row_of(summary), column_of(summary)] == 1 else _in_row(summary, summary.name)
        for summary in summaries
    ]


def _in_row(summary: Summary, row: str) -> Summary:
    entry = summary.condition.entry.model_copy(update={"row": row})
    return replace(summary, condition=replace(summary.condition, entry=entry))


def _aggregates(section: Section) -> tuple[tuple[Aggregate, ...], int]:
    """Interquartile means of the columns, and in how many rows all of them have results."""
    scores: dict[str, dict[str, tuple[float, ...]]] = {}
    for summary in section.summaries:
        if summary.success.n:
            scores.setdefault(column_of(summary), {})[row_of(summary)] = summary.success.values
    common = [row for row in section.rows if scores and all(row in rows for rows in scores.values())]
    return (
        tuple(
            Aggregate(
                column,
                len(rows),
                sum(map(len, rows.values())),
                bootstrapped_iqm(list(rows.values())),
                bootstrapped_iqm([rows[row] for row in common]) if common else None,
            )
            for column, rows in scores.items()
        ),
        len(common),
    )
