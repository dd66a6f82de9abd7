"""The figure of several conditions' learning curves, side by side, each with its seeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, PercentFormatter

from socialai_dsl.reporting.curve import BLUE, RED, draw_outcomes
from socialai_dsl.reporting.seeds import Seeds, mean_over_seeds

_RULES_SHOWN: Final = 6
_WIDTH: Final = 4.6  # inches a condition


@dataclass(frozen=True)
class Condition:
    """One column of the picture.

    Attributes:
        title: what was run, without the seed.
        seeds: what was measured while it learned.
        successes: which outcomes are successes. words: outcome -> what the scenario says of it.
        tests: frames and success rate of each seed's evaluation.
    """

    title: str
    seeds: Seeds
    successes: frozenset[str]
    words: Mapping[str, str]
    tests: Sequence[tuple[float, float]]


def draw_conditions(conditions: Sequence[Condition], path: Path) -> None:
    """Write the picture: success above, how episodes ended below it, which rules fired at the bottom."""
    figure = Figure(figsize=(_WIDTH * len(conditions) + 0.6, 8.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(3, len(conditions), squeeze=False, height_ratios=(3, 2, 2))
    for column, condition in zip(grid.T, conditions, strict=True):
        success, outcomes, rules = column
        success.set_title(condition.title, fontsize=10, loc="left", weight="bold")
        _draw_success(success, condition)
        means = condition.seeds.means("outcomes")
        draw_outcomes(outcomes, condition.seeds.frames, means, condition.successes, condition.words, _BELOW)
        _draw_rules(rules, condition.seeds)
        for axes in column:
            if condition.seeds.shortest < condition.seeds.frames[-1]:
                axes.axvline(condition.seeds.shortest, color="#888888", linewidth=1, linestyle=":")
            axes.set_xlim(0, float(condition.seeds.frames[-1]) * 1.02)
            axes.xaxis.set_major_formatter(EngFormatter(sep=""))
            axes.spines[["top", "right"]].set_visible(False)
            axes.tick_params(labelsize=8)
        for axes in (success, outcomes):
            axes.set_ylim(0, 1)
            axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        rules.set_xlabel("frames", fontsize=9)
    for axes, label in zip(
        grid[:, 0], ("success", "episodes ended by", "firings per episode, by rule"), strict=True
    ):
        axes.set_ylabel(label, fontsize=9)
    figure.savefig(path)


_BELOW: Final = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.1), "ncols": 1}


def _draw_success(axes: Axes, condition: Condition) -> None:
    seeds = condition.seeds
    for one in seeds.success:
        axes.plot(seeds.frames, one, color=BLUE, alpha=0.35, linewidth=0.9)
    label = (
        f"training, mean of {len(seeds.success)} seeds" if len(seeds.success) > 1 else "training, one seed"
    )
    of_all = seeds.frames <= seeds.shortest
    axes.plot(
        seeds.frames[of_all], mean_over_seeds(seeds.success)[of_all], color=BLUE, linewidth=2, label=label
    )
    if not of_all.all():
        axes.plot([], [], color="#888888", linewidth=1, linestyle=":", label="from here on fewer seeds")
    if condition.tests:
        frames, rates = zip(*condition.tests, strict=True)
        axes.plot(frames, rates, "o", color=RED, markersize=5, clip_on=False, zorder=3, label="test set")
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.legend(loc="best", fontsize=8, frameon=False)


def _draw_rules(axes: Axes, seeds: Seeds) -> None:
    """The rules that fired most, one line each."""
    means = seeds.means("rules")
    peaks = {name: float(np.nanmax(rate, initial=0.0)) for name, rate in means.items()}
    names = [name for name in sorted(peaks, key=lambda name: -peaks[name]) if peaks[name] > 0][:_RULES_SHOWN]
    for name in names:
        axes.plot(seeds.frames, means[name], linewidth=1.4, label=name)
    axes.set_ylim(bottom=0)
    if names:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), fontsize=7, frameon=False)
