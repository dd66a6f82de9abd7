"""This module puts the learning curves of several seeds on one grid of frames."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

_RATES: Final = ("outcomes", "rules")


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

    def part(self, kind: str) -> dict[str, Float]:
        """The rates of `outcomes` or of `rules`, by their own names."""
        start = f"{kind}/"
        return {name.removeprefix(start): rate for name, rate in self.rates.items() if name.startswith(start)}


def read_seeds(metrics: Sequence[Path], bins: int = 40) -> Seeds:
    """Read the `metrics.jsonl` of runs that differ in nothing but their seed; a shorter one is unknown at the end.

    Raises:
        ValueError: a file is empty.
    """
    runs = [[json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] for path in metrics]
    for path, rows in zip(metrics, runs, strict=True):
        if not rows:
            raise ValueError(f"{path}: expected at least one update, got an empty file")
    end = max(rows[-1]["frames"] for rows in runs)
    edges = np.linspace(0, end, min(bins, max(len(rows) for rows in runs)) + 1)
    flat = [[_flat(row) for row in rows] for rows in runs]
    names = list(dict.fromkeys(name for rows in flat for row in rows for name in row))
    return Seeds(
        edges[1:],
        np.stack([_binned(rows, [row["success"] for row in rows], edges) for rows in runs]),
        {
            name: np.stack(
                [
                    _binned(rows, [row.get(name) for row in some], edges)
                    for rows, some in zip(runs, flat, strict=True)
                ]
            )
            for name in names
        },
    )


def mean_over_seeds(rates: Float) -> Float:
    """Mean over the seeds that had an episode, (S, B) to (B,); nan where none had."""
    known = ~np.isnan(rates)
    total = np.where(known, rates, 0.0).sum(0)
    return np.where(known.any(0), total / np.maximum(known.sum(0), 1), np.nan)


def _flat(row: Mapping[str, Any]) -> dict[str, float | None]:
    return {f"{kind}/{name}": rate for kind in _RATES for name, rate in row[kind].items()}


def _binned(rows: Sequence[Mapping[str, Any]], rates: Sequence[float | None], edges: Float) -> Float:
    """Rates per episode in each bin (B,), from the rates per episode of each update."""
    place = np.searchsorted(edges[1:], [row["frames"] for row in rows])
    kept = place < len(edges) - 1
    episodes = np.array([row["episodes"] for row in rows], np.float64)
    counts = episodes * np.array([rate or 0.0 for rate in rates])
    total = np.bincount(place[kept], episodes[kept], len(edges) - 1)
    count = np.bincount(place[kept], counts[kept], len(edges) - 1)
    return np.where(total > 0, count / np.maximum(total, 1), np.nan)
