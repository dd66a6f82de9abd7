"""What minds of every kind did, by condition and trial: success, endings, whom they asked, and how long people took.

Everything here is counted from the lists of episodes and answers, which have one form for all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import pandas as pd

from socialai_dsl.reporting.collect import Condition, RunRecord
from socialai_dsl.reporting.episodes import NO_ANSWERS, NO_EPISODES, NO_REACTIONS
from socialai_dsl.reporting.statistics import Estimate, clustered_rate

NOBODY: Final = "(nobody)"
"""Whom those asked first whom nobody answered."""

BEHIND: Final = " > "
"""Stands between persons in the order in which they answered first."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Rate:
    """A success rate with what it is of.

    Attributes:
        episodes: how many. clusters: how many persons, sessions or seeds they are of.
        success: the share of them. interval: None of one cluster.
        steps: the mean length of an episode; nan where lists do not say it.
    """

    episodes: int
    clusters: int
    success: float
    interval: Estimate | None
    steps: float

    def row(self) -> Row:
        """As a part of a row of a table."""
        return {
            "episodes": self.episodes,
            "clusters": self.clusters,
            "success": self.success,
            "success_low": self.interval.low if self.interval else None,
            "success_high": self.interval.high if self.interval else None,
            "mean_steps": None if np.isnan(self.steps) else self.steps,
        }


class Mind:
    """A condition, by its single episodes.

    Attributes:
        condition: what it is. kind: of mind, as results say it; empty where none does.
        episodes: those of all its runs, with `run`, the place of the run. answers: likewise. reactions: likewise.
        of: what the episodes come in: `people`, those who play together as one; `seeds` of an agent that has learned;
            `sessions` that are remembered, or have the same draws; or nothing, `episodes`.
    """

    def __init__(self, condition: Condition) -> None:
        self.condition = condition
        runs = condition.done
        results = [run.result for run in runs if run.result is not None]
        self.kind = results[0].kind if results else ""
        self.episodes = _together(runs, "episodes", NO_EPISODES)
        self.answers = _together(runs, "answers", NO_ANSWERS)
        self.reactions = _together(runs, "reactions", NO_REACTIONS)
        self.of = _come_in(self.kind, len(runs), max((result.session for result in results), default=1))
        if not condition.study:  # else the lists say who played together
            place = self.episodes.run.astype(str)
            within = {"sessions": "cluster", "episodes": "episode"}.get(self.of)
            self.episodes["cluster"] = (
                place if within is None else place + " " + self.episodes[within].astype(str)
            )

    @property
    def trials(self) -> list[int]:
        """The trials that were played, from 1."""
        return sorted(self.episodes.trial.unique().tolist())

    def rate(self, trial: int | None = None) -> Rate:
        """Success in a trial, or in all episodes."""
        some = self.episodes if trial is None else self.episodes[self.episodes.trial == trial]
        by = some.groupby("cluster").success.agg(["sum", "count"])
        steps = some.steps.astype(float).mean()
        interval = clustered_rate(by["sum"].tolist(), by["count"].tolist())
        return Rate(len(some), len(by), float(some.success.mean()), interval, float(steps))

    @cached_property
    def endings(self) -> dict[str, float]:
        """Outcome -> share of the episodes, where lists say it."""
        known = self.episodes.outcome.dropna()
        return {str(name): float(share) for name, share in known.value_counts(normalize=True).items()}

    @property
    def knows_answers(self) -> bool:
        """Whether the lists say how often the player spoke; older ones do not, and then lack answers, too."""
        return len(self.episodes) > 0 and bool(self.episodes.utterances.notna().all())

    @cached_property
    def orders(self) -> pd.Series:
        """Of each episode, by run and number, the persons in the order in which each of them answered first."""
        first = self.answers.drop_duplicates(["run", "episode", "by"])
        joined = first.groupby(["run", "episode"]).by.agg(BEHIND.join)
        places = pd.MultiIndex.from_frame(self.episodes[["run", "episode"]])
        return joined.reindex(places).fillna(NOBODY)

    def asked(self) -> list[Row]:
        """Of each who answered: in which share of the episodes, in which share as the first, and how often."""
        count, orders = len(self.episodes), self.orders
        firsts = orders.str.split(BEHIND, regex=False).str[0]
        rows = []
        for name, some in self.answers.groupby("by"):
            episodes = len(some.drop_duplicates(["run", "episode"]))
            rows.append(
                {
                    "by": name,
                    "share_of_episodes": episodes / count,
                    "first": float((firsts == name).mean()),
                    "answers_per_episode": len(some) / count,
                }
            )
        return sorted(rows, key=lambda row: (-row["first"], -row["share_of_episodes"], row["by"]))

    def sequences(self) -> list[Row]:
        """Each order of distinct persons with its share of the episodes, the most frequent first."""
        counts = self.orders.value_counts()
        ordered = sorted(counts.items(), key=lambda one: (-one[1], str(one[0])))
        return [{"order": name, "episodes": n, "share": n / len(self.orders)} for name, n in ordered]

    def exchanges(self) -> list[Row]:
        """Each utterance with each answer of somebody, and how often an episode, the most frequent first."""
        counts = self.answers.groupby(["said", "by", "answer"]).size()
        ordered = sorted(counts.items(), key=lambda one: (-one[1], one[0]))
        names = ("said", "by", "answer")
        return [
            {**dict(zip(names, key, strict=True)), "times": n, "per_episode": n / len(self.episodes)}
            for key, n in ordered
        ]

    def reaction_times(self) -> Iterator[Row]:
        """Median and quartiles of a person's times, in milliseconds: over all acts, then by trial."""
        if len(self.reactions):
            yield {"trial": None, **_quartiles(self.reactions.ms)}
            for trial, some in self.reactions.groupby("trial"):
                yield {"trial": int(trial), **_quartiles(some.ms)}


def _come_in(kind: str, runs: int, session: int) -> str:
    """What the episodes of a kind of mind come in, see `Mind.of`."""
    if kind == "person":
        return "people"
    if kind in ("network", "") and runs > 1:
        return "seeds"
    return "episodes" if session == 1 else "sessions"


def _together(runs: Sequence[RunRecord], name: str, nothing: pd.DataFrame) -> pd.DataFrame:
    """The tables of this name of all runs that have one, with the place of the run."""
    tables = [getattr(run, name).assign(run=place) for place, run in enumerate(runs)]
    tables = [table for table in tables if len(table)]
    return pd.concat(tables, ignore_index=True) if tables else nothing.assign(run=[])


def _quartiles(times: pd.Series) -> Row:
    low, middle, high = np.quantile(times.astype(float), [0.25, 0.5, 0.75])
    return {"acts": len(times), "q1_ms": float(low), "median_ms": float(middle), "q3_ms": float(high)}
