"""Learning curves of several seeds on one grid of frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import ValidationError

from socialai_dsl.reporting.records import UpdateRecord, described

Float = NDArray[np.float64]
_MOMENTS: Final = 8
_WORTH_SHOWING: Final = 0.005


@dataclass(frozen=True)
class Seeds:
    """What several runs of one condition measured while they learned, in bins of frames.

    A bin holds the episodes that ended in it: rates are those of all its episodes, not means of rates.

    Attributes:
        frames: (B,) end of each bin, frames.
        success: (S, B) share of successes by seed; nan where no episode ended, as after the end of a run.
        rates: name -> (S, B), how often an episode ended in this outcome, or this rule fired in an episode.
            Outcomes first; names are prefixed with `outcomes/` or `rules/`.
    """

    frames: Float
    success: Float
    rates: Mapping[str, Float]

    def table(self) -> tuple[list[str], list[tuple[float, list[float]]]]:
        """A few moments of the curves.

        Returns:
            What is shown: success of each seed, then the mean of each rate that is worth showing. For each moment its
            frames and these values; nan where no episode ended.
        """
        step = max(1, len(self.frames) // _MOMENTS)
        names, curves = [f"run {number + 1}" for number in range(len(self.success))], [*self.success]
        for name, rate in self.rates.items():
            mean = mean_over_seeds(rate)
            if np.nanmax(mean, initial=0.0) >= _WORTH_SHOWING:
                names.append(name.partition("/")[2])
                curves.append(mean)
        moments = range(step - 1, len(self.frames), step)
        return names, [(float(self.frames[at]), [float(curve[at]) for curve in curves]) for at in moments]

    def means(self, kind: str) -> dict[str, Float]:
        """Mean over the seeds of the rates of `outcomes` or of `rules`, by their own names, (B,) each."""
        start = f"{kind}/"
        return {
            name.removeprefix(start): mean_over_seeds(rate)
            for name, rate in self.rates.items()
            if name.startswith(start)
        }


def read_updates(metrics: Path) -> list[UpdateRecord]:
    """The updates of a `metrics.jsonl`; a last line that was never finished is left out.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is empty, or holds something else.
    """
    lines = metrics.read_text(encoding="utf-8").split("\n")[:-1]
    if not lines:
        raise ValueError(f"{metrics}: expected at least one update, got an empty file")
    updates = []
    for number, line in enumerate(lines, start=1):
        try:
            updates.append(UpdateRecord.model_validate_json(line))
        except ValidationError as error:
            what = described(error)
            raise ValueError(f"{metrics}:{number}: expected an update as JSON, {what}") from None
    return updates


def align(runs: Sequence[Sequence[UpdateRecord]], bins: int = 40) -> Seeds:
    """Put runs on one grid of frames; a shorter one is unknown at the end.

    Args:
        runs: of each the updates, at least one.
        bins: the most bins; there are no more than the longest run has updates.
    """
    end = max(updates[-1].frames for updates in runs)
    edges = np.linspace(0, end, min(bins, max(len(updates) for updates in runs)) + 1)
    rates = [pd.DataFrame([_flat(update) for update in updates]) for updates in runs]
    names = list(dict.fromkeys(name for table in rates for name in table))
    binned = [
        _binned(updates, table.reindex(columns=names), edges)
        for updates, table in zip(runs, rates, strict=True)
    ]
    by_name = {name: np.stack([table[name].to_numpy() for table in binned]) for name in names}
    return Seeds(edges[1:], by_name.pop("success"), by_name)


def mean_over_seeds(rates: Float) -> Float:
    """Mean over the seeds that had an episode, (S, B) to (B,); nan where none had."""
    return np.asarray(pd.DataFrame(rates).mean())


def _flat(update: UpdateRecord) -> dict[str, float | None]:
    outcomes = {f"outcomes/{name}": rate for name, rate in update.outcomes.items()}
    return {"success": update.success, **outcomes, **{f"rules/{n}": rate for n, rate in update.rules.items()}}


def _binned(updates: Sequence[UpdateRecord], rates: pd.DataFrame, edges: Float) -> pd.DataFrame:
    """Rates per episode in each bin, from the rates per episode of each update."""
    place = np.searchsorted(edges[1:], [update.frames for update in updates])
    episodes = pd.Series([update.episodes for update in updates], dtype=float)
    counts = rates.astype(float).fillna(0.0).mul(episodes, axis=0).groupby(place).sum()
    total = episodes.groupby(place).sum()
    return counts.div(total.where(total > 0), axis=0).reindex(range(len(edges) - 1))
