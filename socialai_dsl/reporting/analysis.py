"""The tables of a report: spread over seeds, comparisons, aggregates, and runs that are too short."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Final

import numpy as np
import pandas as pd

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.reporting.collect import Condition, Experiment, RunRecord
from socialai_dsl.reporting.minds import Mind
from socialai_dsl.reporting.published import Figure, against_published
from socialai_dsl.reporting.records import EndingRecord
from socialai_dsl.reporting.seeds import Seeds, align, mean_over_seeds
from socialai_dsl.reporting.statistics import (
    Estimate,
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

TABLES: Final = ("table2", None)
"""Groups that are tables; any other is a case study, whose rows are compared as well as its columns."""

TOGETHER: Final = 4
"""The most conditions of a case study in one panel; more get a panel for each column."""


class Summary:
    """What is known of a condition.

    Attributes:
        condition: its entry and runs. name, row, column: where it stands.
        success: on the test episodes, a value for each seed that is done.
        tests: the same of its further tests, by scenario. seats: the same of each seat, if there are several.
        seeds: learning curves; None if no run has one.
        short: why it is too early to judge it, in phrases; nothing if it is not.
    """

    def __init__(self, condition: Condition) -> None:
        entry, done = condition.entry, [run.figures for run in condition.done if run.figures is not None]
        curves = [updates for run in condition.runs if (updates := run.updates()) is not None]
        self.condition, self.name = condition, entry.name
        self.row, self.column = entry.row or entry.name, entry.column or entry.agent
        self.success = pd.Series([figures.success_rate for figures in done], dtype=float)
        self.tests = {
            test: pd.Series(
                [run.tests[test].success_rate for run in condition.runs if test in run.tests], dtype=float
            )
            for test in entry.tests
        }
        played = [run.result.by_seat for run in condition.done if run.result is not None]
        self.seats = {
            seat: pd.Series([seats[seat].success_rate for seats in played if seat in seats], dtype=float)
            for seat in dict.fromkeys(seat for seats in played for seat in seats)
        }
        self.seeds = align(curves) if curves else None
        self.short = _too_short(condition, self.success, self.seeds)
        self.endings: dict[str, EndingRecord] = {e.outcome: e for figures in done for e in figures.endings}

    @cached_property
    def mind(self) -> Mind:
        """The condition by its single episodes."""
        return Mind(self.condition)

    @property
    def successes(self) -> frozenset[str]:
        """Which outcomes are successes, as far as results tell; by their names where they are older."""
        seen = self.seeds.means("outcomes") if self.seeds is not None else {}
        guessed = {name for name in seen if name.rpartition(": ")[2].startswith("success")}
        told = {name for name, ending in self.endings.items() if ending.success}
        return frozenset(told | (guessed - self.endings.keys()))

    def carried(self, test: str) -> pd.Series:
        """Of each seed the success on a further test, in proportion to that on its own test episodes."""
        both = [
            (run.tests[test].success_rate, run.figures.success_rate)
            for run in self.condition.done
            if test in run.tests and run.figures is not None
        ]
        return pd.Series([there / own for there, own in both if own > 0], dtype=float)

    @property
    def areas(self) -> pd.Series:
        """Of each seed the area under its curve, divided by its frames."""
        curves = self.seeds.success if self.seeds is not None else ()
        return pd.Series([area_under(curve) for curve in curves], dtype=float).dropna()

    @property
    def figures(self) -> list[Figure]:
        """Each published figure of the condition and of its tests, with ours."""
        entry = self.condition.entry
        own = [] if entry.reference is None else [("", self.success, entry.reference)]
        further = [(test, self.tests.get(test, ()), told) for test, told in entry.test_references.items()]
        return [Figure(entry.group, self.name, test, list(ours), told) for test, ours, told in own + further]

    def reached(self, threshold: float) -> list[float | None]:
        """The frames after which each seed's curve had reached so much; None where it never did."""
        if self.seeds is None:
            return []
        return [frames_to(self.seeds.frames, curve, threshold) for curve in self.seeds.success]


@dataclass(frozen=True)
class Section:
    """A table of conditions, or a case study.

    Attributes:
        group: as the experiment calls it. summaries: in order.
        comparisons: of the columns of each row; in a case study also of the rows of each column. p_bonferroni is
            corrected for all of them.
        published: of each published figure how ours compares with it. p_bonferroni is corrected for all of them.
        rooms: those of the pairs that played the same test episodes, as far as runs list them.
        columns: of a table, interquartile mean of each column, over its rows and over those that all columns have.
        common_rows: in how many rows every column has results.
    """

    group: str | None
    summaries: Sequence[Summary]
    comparisons: Sequence[dict[str, Any]] = ()
    published: Sequence[dict[str, Any]] = ()
    rooms: Sequence[dict[str, Any]] = ()
    columns: Sequence[dict[str, Any]] = ()
    common_rows: int = 0

    @property
    def is_table(self) -> bool:
        """Whether it has rows and columns."""
        return self.group in TABLES

    def by(self, key: str) -> dict[str, list[Summary]]:
        """The conditions by `row` or `column`, in order."""
        grouped: dict[str, list[Summary]] = {}
        for summary in self.summaries:
            grouped.setdefault(getattr(summary, key), []).append(summary)
        return grouped

    @property
    def panels(self) -> dict[str, list[Summary]]:
        """The conditions that a figure shows together: those of a row; of a case study all, or those of a column."""
        if self.is_table or len(self.by("row")) == 1:
            return self.by("row")
        if len(self.summaries) <= TOGETHER:
            return {self.group or "": list(self.summaries)}
        return self.by("column")

    def label(self, summary: Summary) -> str:
        """What tells a condition from the others of its panel."""
        if self.is_table or len(self.by("row")) == 1:
            return summary.column
        return summary.name if len(self.summaries) <= TOGETHER else summary.row

    def pairs(self) -> list[tuple[Summary, Summary]]:
        """The conditions that are compared: those that share a row, and in a case study those that share a column."""
        keys = ["row"] if self.is_table else ["row", "column"]
        return [
            pair for key in keys for members in self.by(key).values() for pair in combinations(members, 2)
        ]


@dataclass(frozen=True)
class Analysis:
    """All that a report says, as figures.

    Attributes:
        experiment: as it was read. sections: tables first.
        baselines: by scenario. notes: what is to be known about how it was made.
    """

    experiment: Experiment
    sections: Sequence[Section]
    baselines: Mapping[str, Baselines]
    notes: Sequence[str] = ()

    @property
    def summaries(self) -> list[Summary]:
        """Of all conditions."""
        return [summary for section in self.sections for summary in section.summaries]


def analyse(experiment: Experiment, measured: Mapping[str, Baselines], notes: Sequence[str] = ()) -> Analysis:
    """Compute all figures of a report. The learning curves are read here, one condition after the other.

    Args:
        experiment: what was read.
        measured: baselines by scenario; script and chance count only where no condition of the experiment plays them.
        notes: for `Analysis`.
    """
    grouped: dict[str | None, list[Summary]] = {}
    for condition in experiment.conditions:
        grouped.setdefault(condition.entry.group, []).append(Summary(condition))
    groups = sorted(grouped, key=lambda group: group not in TABLES)
    sections = [_section(group, grouped[group]) for group in groups]
    return Analysis(experiment, sections, _baselines(experiment, measured), notes)


def _baselines(experiment: Experiment, measured: Mapping[str, Baselines]) -> dict[str, Baselines]:
    """By scenario what conditions tell that play the script or chance, and else what was measured."""
    found = {}
    for scenario in experiment.scenarios:
        conditions = [one for one in experiment.conditions if one.entry.scenario == scenario]
        script, chance = (_told(conditions, agent) for agent in ("oracle", "random"))
        known = measured.get(scenario, Baselines())
        found[scenario] = replace(known, script=script or known.script, chance=chance or known.chance)
    return found


def _told(conditions: Sequence[Condition], agent: str) -> Level | None:
    """The last of these conditions that this agent played."""
    for condition in reversed(conditions):
        rates = [run.figures for run in condition.done if run.figures is not None]
        if condition.entry.agent == agent and rates:
            value, episodes = np.mean([one.success_rate for one in rates]), sum(one.episodes for one in rates)
            error = np.sqrt(value * (1 - value) / episodes)
            return Level(float(value), float(error), f"{condition.entry.name}, {episodes:,} episodes")
    return None


def _too_short(condition: Condition, success: pd.Series, seeds: Seeds | None) -> list[str]:
    reasons = []
    missing = len(condition.runs) - len(condition.done)
    if missing:
        reasons.append(f"{missing} of {len(condition.runs)} seeds without a result")
    asked, least = condition.entry.frames, min((run.frames for run in condition.done), default=0)
    if asked is not None and condition.done and least < asked:
        reasons.append(f"a seed stopped at {least:,} of {asked:,} frames")
    rise = still_rising(seeds) if seeds is not None else None
    if rise is not None and rise > RISING and not success.mean() >= SOLVED:
        reasons.append(f"success still rises, by {rise:.2f} in the last fifth of training")
    return reasons


def still_rising(seeds: Seeds) -> float | None:
    """By how much the mean success of the last fifth of the bins exceeds that of the fifth before; None if unknown."""
    mean = mean_over_seeds(seeds.success)
    part = len(mean) // 5
    last, before = pd.Series(mean[-part:]).mean(), pd.Series(mean[-2 * part : -part]).mean()
    return None if part == 0 or np.isnan(last - before) else float(last - before)


def _section(group: str | None, summaries: Sequence[Summary]) -> Section:
    places = pd.Series([(summary.row, summary.column) for summary in summaries])
    for summary, shared in zip(summaries, places.duplicated(keep=False), strict=True):
        if shared:  # conditions that would share a place in the table get rows of their own
            summary.row = summary.name
    section = Section(group, summaries)
    pairs = [
        pair for pair in section.pairs() if all(len(one.success) for one in pair) and not _same_people(*pair)
    ]
    comparisons = [_comparison(*pair) for pair in pairs]
    for one, p in zip(comparisons, bonferroni([one["p"] for one in comparisons]), strict=True):
        one["p_bonferroni"] = p
    published = against_published([figure for summary in summaries for figure in summary.figures])
    rooms = [row for pair in section.pairs() if (row := pair_by_room(*pair)) is not None]
    columns, common = _columns(section) if section.is_table else ([], 0)
    return Section(group, summaries, comparisons, published, rooms, columns, common)


def _same_people(first: Summary, second: Summary) -> bool:
    """Whether both are of one study, whose people are not independent samples."""
    return first.condition.study != "" and first.condition.study == second.condition.study


def _comparison(first: Summary, second: Summary) -> dict[str, Any]:
    test = compare(list(first.success), list(second.success))
    return {
        "group": first.condition.entry.group,
        "first": first.name,
        "second": second.name,
        "difference": test.difference,
        "welch_t": test.t,
        "degrees_of_freedom": test.degrees,
        "p": test.p,
        "p_bonferroni": None,
        "hedges_g": test.g,
    }


def pair_by_room(first: Summary, second: Summary) -> dict[str, Any] | None:
    """Compare two conditions in the test episodes that both list, on the same seat; None without such.

    The same number is the same room only in the same program and the same set of rooms.
    """
    runs: list[RunRecord] = [*first.condition.done, *second.condition.done]
    results = [run.result for run in runs if run.result is not None]
    played = {(result.program_sha256, result.seat, result.eval.rooms) for result in results}
    rooms = pd.concat([first.condition.rooms, second.condition.rooms], axis=1, join="inner")
    if len(played) != 1 or rooms.empty:
        return None
    here, there = rooms.iloc[:, 0], rooms.iloc[:, 1]
    # Episodes of a session are not independent, so each session counts once.
    alike = rooms.groupby(rooms.index // max(result.session for result in results)).mean()
    difference = paired_difference(alike.iloc[:, 0], alike.iloc[:, 1])
    return {
        "group": first.condition.entry.group,
        "first": first.name,
        "second": second.name,
        "rooms": len(rooms),
        "first_better": int((here > there).sum()),
        "second_better": int((here < there).sum()),
        "difference": difference.value,
        "difference_low": difference.low,
        "difference_high": difference.high,
    }


def _columns(section: Section) -> tuple[list[dict[str, Any]], int]:
    """Interquartile means of the columns, and in how many rows all of them have results."""
    scores: dict[str, dict[str, list[float]]] = {}
    for summary in section.summaries:
        if len(summary.success) and not summary.condition.study:  # people are no seeds
            scores.setdefault(summary.column, {})[summary.row] = list(summary.success)
    common = [row for row in section.by("row") if scores and all(row in rows for rows in scores.values())]
    found = []
    for column, rows in scores.items():
        shared: Estimate | None = bootstrapped_iqm([rows[row] for row in common]) if common else None
        estimate = bootstrapped_iqm(list(rows.values()))
        runs = sum(map(len, rows.values()))
        found.append({"column": column, "rows": len(rows), "runs": runs, "iqm": estimate, "common": shared})
    return found, len(common)
