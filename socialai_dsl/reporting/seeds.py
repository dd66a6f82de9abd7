"""Learning curves of several seeds on one grid of frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from socialai_dsl.reporting.records import UpdateRecord

Float = NDArray[np.float64]


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

    @property
    def shortest(self) -> float:
        """Frames of the run that ended first; what is known beyond is of the others alone."""
        bins = np.arange(len(self.frames))
        return float(self.frames[np.where(np.isnan(self.success), 0, bins).max(1).min()])

    def part(self, kind: str) -> dict[str, Float]:
        """The rates of `outcomes` or of `rules`, by their own names."""
        start = f"{kind}/"
        return {name.removeprefix(start): rate for name, rate in self.rates.items() if name.startswith(start)}


def read_seeds(metrics: Sequence[Path], bins: int = 40) -> Seeds:
    """Read the `metrics.jsonl` of runs that differ in nothing but their seed; see `read_updates` and `align`.

    Raises:
        ValueError: a file is empty or damaged.
    """
    return align([read_updates(path) for path in metrics], bins)


def read_updates(metrics: Path) -> list[UpdateRecord]:
    """The updates of a `metrics.jsonl`; a last line that was never finished is left out.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is empty, or holds something else.
    """
    text = metrics.read_text(encoding="utf-8")
    lines = text.splitlines()
    if text and not text.endswith("\n"):
        lines.pop()
    if not lines:
        raise ValueError(f"{metrics}: expected at least one update, got an empty file")
    updates = []
    for number, line in enumerate(lines, start=1):
        try:
            updates.append(UpdateRecord.model_validate_json(line))
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            what = f"{place}: {first['msg']}" if place else first["msg"]
            raise ValueError(f"{metrics}:{number}: expected an update as JSON, {what}") from None
    return updates


def align(runs: Sequence[Sequence[UpdateRecord]], bins: int = 40) -> Seeds:
    """Put runs on one grid of frames; a shorter one is unknown at the end.

    Args:
        runs: of each the updates, at least one.
        bins: at most so many, and no more than the longest run has updates.
    """
    end = max(updates[-1].frames for updates in runs)
    edges = np.linspace(0, end, min(bins, max(len(updates) for updates in runs)) + 1)
    flat = [[_flat(update) for update in updates] for updates in runs]
    names = list(dict.fromkeys(name for updates in flat for update in updates for name in update))
    return Seeds(
        edges[1:],
        np.stack([_binned(updates, [update.success for update in updates], edges) for updates in runs]),
        {
            name: np.stack(
                [
                    _binned(updates, [rates.get(name) for rates in some], edges)
                    for updates, some in zip(runs, flat, strict=True)
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


def _flat(update: UpdateRecord) -> dict[str, float | None]:
    return {
        f"{kind}/{name}": rate
        for kind, rates in (("outcomes", update.outcomes), ("rules", update.rules))
        for name, rate in rates.items()
    }


def _binned(updates: Sequence[UpdateRecord], rates: Sequence[float | None], edges: Float) -> Float:
    """Rates per episode in each bin (B,), from the rates per episode of each update."""
    place = np.searchsorted(edges[1:], [update.frames for update in updates])
    kept = place < len(edges) - 1
    episodes = np.array([update.episodes for update in updates], np.float64)
    counts = episodes * np.array([rate or 0.0 for rate in rates])
    total = np.bincount(place[kept], episodes[kept], len(edges) - 1)
    count = np.bincount(place[kept], counts[kept], len(edges) - 1)
    return np.where(total > 0, count / np.maximum(total, 1), np.nan)
