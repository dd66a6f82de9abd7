"""A run's learning curve."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, PercentFormatter
from numpy.typing import NDArray

from socialai_dsl.reporting.style import COLOURS, colour, shown

BLUE: Final = "#2f62b8"
RED: Final = "#c23b33"
_GREYS: Final = ("#8d939d", "#b3b7be", "#d3d6da", "#e6e7ea")
# Blue and orange, which colour-blind people tell apart.
_SUCCESSES: Final = ("#0072b2", "#569fcd", "#a3cce6")
_FAILURES: Final = ("#d55e00", "#e88c47", "#f2b586", "#f8dac3")
_PALETTES: Final = (_SUCCESSES, _FAILURES, _GREYS)
"""The colours of each rank, see `_rank`."""


Test = tuple[float, float, float, float]


@dataclass(frozen=True)
class Curve:
    """What was measured while a run learned, one entry per update.

    Attributes:
        frames: frames seen so far.
        success: share of the training episodes that ended in this update and succeeded; nan where none ended.
        outcomes: outcome -> its share of those episodes.
        successes: which outcomes are successes. words: outcome -> what the scenario says of it.
        test: frames, success rate and both ends of its 95 % interval; None if it was not evaluated.
        agreement: share of the steps of a guide in which the agent would have done the same; nan where none led.
    """

    frames: Sequence[float]
    success: Sequence[float]
    outcomes: Mapping[str, Sequence[float]]
    successes: frozenset[str]
    words: Mapping[str, str] = field(default_factory=dict)
    test: Test | None = None
    agreement: Sequence[float] = ()


def read_curve(metrics: Path, endings: Sequence[Mapping[str, Any]], test: Test | None) -> Curve:
    """The curve that a run's `metrics.jsonl` describes.

    Args:
        metrics: the file.
        endings: how episodes can end, as `result.json` lists it: `outcome`, `success`, `text`.
        test: see `Curve`.
    """
    rows = [json.loads(line) for line in metrics.read_text(encoding="utf-8").splitlines()]
    names = list(dict.fromkeys(name for row in rows for name in row["outcomes"]))
    return Curve(
        [float(row["frames"]) for row in rows],
        [_number(row["success"]) for row in rows],
        {name: [_number(row["outcomes"].get(name)) for row in rows] for name in names},
        frozenset(ending["outcome"] for ending in endings if ending["success"]),
        {ending["outcome"]: ending["text"] for ending in endings},
        test,
        [_number(row.get("agreement")) for row in rows],
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def draw_learning_curve(curve: Curve, title: str, path: Path) -> None:
    """Write the picture: success over frames, and below how episodes ended; of a suite, the success of each member."""
    figure = Figure(figsize=(7.2, 6.2), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    figure.suptitle(title, fontsize=11, x=0.01, ha="left", weight="bold")
    _draw_success(above, curve)
    members = member_success(curve)
    if 0 < len(members) <= len(COLOURS):
        _draw_members(below, curve, members)
    else:
        shares = {name: smooth(values, _window(curve)) for name, values in curve.outcomes.items()}
        draw_outcomes(below, curve.frames, shares, curve.successes, curve.words, _BELOW)
        below.set_ylabel("episodes ended by", fontsize=9)
    for axes in (above, below):
        axes.set_ylim(0, 1)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    below.set_xlim(0, max(curve.frames, default=1) * 1.02)
    below.xaxis.set_major_formatter(EngFormatter(sep=""))
    below.set_xlabel("frames", fontsize=9)
    figure.savefig(path)


def smooth(values: Sequence[float] | NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Mean over the last `width` values that are not nan; nan where there are none."""
    array = np.asarray(values, np.float64)
    known = ~np.isnan(array)
    sums = np.concatenate([[0.0], np.cumsum(np.where(known, array, 0.0))])
    counts = np.concatenate([[0], np.cumsum(known)])
    end = np.arange(1, len(array) + 1)
    start = np.maximum(end - width, 0)
    number = counts[end] - counts[start]
    return np.where(number > 0, (sums[end] - sums[start]) / np.maximum(number, 1), np.nan)


def _window(curve: Curve) -> int:
    return max(1, len(curve.frames) // 25)


def _draw_success(axes: Axes, curve: Curve) -> None:
    axes.plot(curve.frames, curve.success, color=BLUE, alpha=0.25, linewidth=0.8)
    axes.plot(
        curve.frames,
        smooth(curve.success, _window(curve)),
        color=BLUE,
        linewidth=1.8,
        label="training episodes",
    )
    led = [
        frames
        for frames, agrees in zip(curve.frames, curve.agreement, strict=False)
        if not math.isnan(agrees)
    ]
    if led:
        axes.axvspan(0, led[-1], color="#f3efe2", zorder=0)
        axes.plot(
            curve.frames,
            curve.agreement,
            color="#8a7434",
            linewidth=1.4,
            label="agrees with the script that leads",
        )
    if curve.test is not None:
        frames, rate, low, high = curve.test
        axes.errorbar(
            [frames],
            [rate],
            [[rate - low], [high - rate]],
            fmt="o",
            color=RED,
            markersize=6,
            capsize=4,
            clip_on=False,
            label=f"test set: {rate:.1%} ({low:.1%} to {high:.1%})",
            zorder=3,
        )
    axes.set_ylabel("success", fontsize=9)
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.8)
    axes.set_axisbelow(True)
    ends_above = bool(led) or (curve.test is not None and curve.test[1] > 0.5)
    axes.legend(loc="lower right" if ends_above else "upper left", fontsize=8, frameon=False)


def member_success(curve: Curve) -> dict[str, NDArray[np.float64]]:
    """Member of a suite -> success in its latest episodes, (B,), nan before its first one; nothing for a scenario."""
    ended: dict[str, NDArray[np.float64]] = {}
    won: dict[str, NDArray[np.float64]] = {}
    for outcome, values in curve.outcomes.items():
        member, of_suite, _ = outcome.rpartition(": ")
        if of_suite:
            shares = np.nan_to_num(values)
            ended[member] = ended.get(member, 0.0) + shares
            won[member] = won.get(member, 0.0) + shares * (outcome in curve.successes)
    rates = {}
    for member, shares in ended.items():
        latest = smooth(shares, _window(curve))
        played = np.where(latest > 0, latest, np.nan)
        rates[member] = smooth(won[member], _window(curve)) / played
    return rates


def _draw_members(axes: Axes, curve: Curve, members: Mapping[str, NDArray[np.float64]]) -> None:
    for index, (member, rates) in enumerate(members.items()):
        axes.plot(curve.frames, rates, color=colour(index), linewidth=1.4, label=shown(member, 64))
    axes.set_ylabel("success of each", fontsize=9)
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.8)
    axes.legend(fontsize=7, frameon=False, ncols=2, **_BELOW)


_BELOW: Final[Mapping[str, Any]] = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.28)}


def draw_outcomes(
    axes: Axes,
    frames: Sequence[float] | NDArray[np.float64],
    shares: Mapping[str, NDArray[np.float64]],
    successes: frozenset[str],
    words: Mapping[str, str],
    legend: Mapping[str, Any],
) -> None:
    """Stack the ways episodes ended, successes at the bottom.

    Args:
        axes: where to draw.
        frames: (B,), frames seen so far.
        shares: outcome -> (B,), its share of the episodes.
        successes: which outcomes are successes.
        words: outcome -> what the scenario says of it; others are called by their kind and line.
        legend: where it stands, as options of matplotlib's.
    """
    parts = _few({name: np.nan_to_num(values) for name, values in shares.items()}, successes)
    drawn = [part for part in parts if part[2].any()]
    if not drawn:
        return
    axes.stackplot(
        frames,
        [values for _, _, values in drawn],
        colors=[colour for colour, _, _ in drawn],
        labels=[shown(words.get(name, name.replace("@", ", line ")), 64) for _, name, _ in drawn],
        linewidth=0,
    )
    axes.legend(fontsize=7, frameon=False, **legend)


def _few(
    shares: Mapping[str, NDArray[np.float64]], successes: frozenset[str]
) -> list[tuple[str, str, NDArray[np.float64]]]:
    """Colour, name and share of each outcome, in order; where a rank has more than colours, its rarer ones are one.

    An outcome's colour does not depend on how often it happened, so two runs of a scenario have the same colours.
    """
    drawn: list[tuple[str, str, NDArray[np.float64]]] = []
    for rank, called in enumerate(("successes", "failures", "time-outs")):
        names, palette = [name for name in shares if _rank(name, successes) == rank], _PALETTES[rank]
        alone = len(names)
        if alone > len(palette):
            names.sort(key=lambda name: -float(shares[name].mean()))
            alone = len(palette) - 1
        drawn += [(colour, name, shares[name]) for colour, name in zip(palette, names[:alone], strict=False)]
        if rest := names[alone:]:
            together = np.sum([shares[name] for name in rest], axis=0)
            drawn.append((palette[alone], f"{len(rest)} more {called}", together))
    return drawn


def _rank(name: str, successes: frozenset[str]) -> int:
    """Successes first, time-outs last."""
    return 0 if name in successes else 2 if name.rpartition(": ")[2] == "timeout" else 1
