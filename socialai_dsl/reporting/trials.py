"""The figure of success by trial: what minds of every kind learn within a session."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from socialai_dsl.reporting.minds import Mind
from socialai_dsl.reporting.style import colour, marker, new_axes, rates, shown

_APART = 0.05
"""Trials between the marks of two minds, so that their intervals do not hide each other."""


def trials_figure(title: str, minds: Sequence[tuple[str, int, Mind]]) -> Figure:
    """Success in each trial with its interval, a line for each mind.

    Args:
        title: the scenario.
        minds: of each what it is called, the index of its colour, and its episodes.
    """
    figure, axes = new_axes(3.4)
    for place, (name, index, mind) in enumerate(minds):
        shift = (place - (len(minds) - 1) / 2) * _APART
        found = {trial: mind.rate(trial) for trial in mind.trials}
        at = [trial + shift for trial in found]
        style = "--" if mind.condition.simulated else "-"
        axes.plot(
            at,
            [rate.success for rate in found.values()],
            marker(index) + style,
            color=colour(index),
            markersize=4,
            linewidth=1.4,
            label=shown(name),
        )
        for x, rate in zip(at, found.values(), strict=True):
            if rate.interval is not None:
                axes.vlines(
                    x, rate.interval.low, rate.interval.high, color=colour(index), alpha=0.45, linewidth=1.2
                )
    rates(axes)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title(shown(title, 40))
    axes.set_xlabel("trial")
    axes.set_ylabel("success")
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=2)
    return figure
