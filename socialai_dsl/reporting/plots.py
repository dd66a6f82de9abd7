"""The figures of a report: success, also by trial, learning curves, endings, interquartile means.

Each is one panel as wide as a telephone; the page sets them side by side where there is room.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import fill
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from socialai_dsl.baselines import Baselines
from socialai_dsl.reporting.analysis import Analysis, Section, Summary
from socialai_dsl.reporting.crossplay import matrix_figure
from socialai_dsl.reporting.curve import draw_outcomes
from socialai_dsl.reporting.dilemma import dilemma_figure
from socialai_dsl.reporting.seeds import Seeds
from socialai_dsl.reporting.style import (
    INK,
    MUTED,
    WIDTH,
    colour,
    frames,
    lanes,
    marker,
    new_axes,
    rates,
    scenario_name,
    shown,
    styled,
)
from socialai_dsl.reporting.trials import trials_figure

_LEVELS: Final = (
    ("script", "own script", "-"),
    ("chance", "random", ":"),
    ("without_npcs", "without NPCs", "--"),
)
_LEGEND: Final[dict[str, Any]] = {"loc": "outside upper left", "ncols": 2}
_RULES_SHOWN: Final = 6
_TITLE: Final = 40  # characters of a line, of which a title has up to three
_BETWEEN: Final = 0.08  # of an axis, so that two names do not overlap


def figures(analysis: Analysis) -> dict[str, Figure]:
    """Name -> figure: for each part of the report its success, also by trial, curves, endings and interquartile means;
    for each cross-play its matrices, for each dilemma its diagram.
    """
    with styled():
        found = {
            f"part{number}-{name}": figure
            for number, section in enumerate(analysis.sections, start=1)
            for name, figure in _figures(section, analysis.baselines)
        }
        for number, crossplay in enumerate(analysis.experiment.crossplays, start=1):
            for place, seats in enumerate(crossplay.alike, start=1):
                found[f"crossplay{number}-{place}"] = matrix_figure(crossplay, seats)
        for number, dilemma in enumerate(analysis.experiment.dilemmas, start=1):
            found[f"dilemma{number}"] = dilemma_figure(dilemma.scenario, dilemma.schelling)
    return found


def _figures(section: Section, baselines: Mapping[str, Baselines]) -> Iterator[tuple[str, Figure]]:
    yield "success", success_figure(section, baselines)
    if any(column["rows"] > 1 for column in section.columns):
        yield "iqm", iqm_figure(section)
    columns = list(section.by("column"))
    for place, (row, members) in enumerate(section.by("row").items(), start=1):
        minds = [(s.column, columns.index(s.column), s.mind) for s in members if len(s.mind.episodes)]
        if any(len(mind.trials) > 1 for _, _, mind in minds):
            yield f"trials{place}", trials_figure(row, minds)
    for place, (row, members) in enumerate(section.panels.items(), start=1):
        if learning := [summary for summary in members if summary.seeds is not None]:
            yield f"curves{place}", curves_figure(section, row, learning, baselines)
        for number, summary in enumerate(members, start=1):
            if summary.seeds is not None:
                yield f"endings{place}-{number}", endings_figure(summary, section.label(summary))


def success_figure(section: Section, baselines: Mapping[str, Baselines]) -> Figure:
    """Test success of every condition: a dot for each seed, mean and standard deviation, published figures beside."""
    rows, columns = section.by("row"), list(section.by("column"))
    figure, axes = new_axes(1.1 + 0.27 * (len(section.summaries) + 0.9 * len(rows)))
    place, ticks = 0.0, []
    for index, column in enumerate(columns):
        axes.plot([], [], marker(index), color=colour(index), label=shown(column))
    for members in rows.values():
        top = place
        for summary in members:
            _dots(axes, summary, place, columns.index(summary.column))
            place += 1
        ticks.append((top + place - 1) / 2)
        for name, level, style in _levels(members, baselines):
            axes.plot([level] * 2, [top - 0.45, place - 0.55], style, color=MUTED, linewidth=1.1, label=name)
        place += 0.9
    lanes(axes, ticks, list(rows), place - 1.1, "success on the test episodes")
    _legend(figure, axes)
    return figure


def _dots(axes: Axes, summary: Summary, place: float, index: int) -> None:
    success, reference = summary.success, summary.condition.entry.reference
    if reference is not None:
        axes.errorbar(
            [reference.mean], [place], xerr=reference.std, fmt="D", markersize=7, markerfacecolor="none",
            markeredgecolor=INK, ecolor=INK, elinewidth=0.8, zorder=4, label="published",
        )  # fmt: skip
    if len(success):
        axes.plot(
            success, [place] * len(success), marker(index), color=colour(index), alpha=0.35, markersize=4
        )
        std = success.std() if len(success) > 1 else None
        axes.errorbar(
            [success.mean()], [place], xerr=std, fmt=marker(index), color=colour(index), markersize=6,
            elinewidth=2, capsize=3, zorder=3,
        )  # fmt: skip


def _levels(
    members: Sequence[Summary], baselines: Mapping[str, Baselines]
) -> Iterator[tuple[str, float, str]]:
    """Name, success and line style of what does not learn, in the scenario of these conditions."""
    known = baselines.get(members[0].condition.entry.scenario)
    for name, label, style in _LEVELS:
        level = getattr(known, name, None)
        if level is not None:
            yield label, level.value, style


def _legend(figure: Figure, axes: Axes) -> None:
    """Each name once."""
    handles, names = axes.get_legend_handles_labels()
    known = dict(zip(names, handles, strict=True))
    if known:
        figure.legend(list(known.values()), list(known), **_LEGEND)


def curves_figure(
    section: Section, title: str, members: Sequence[Summary], baselines: Mapping[str, Baselines]
) -> Figure:
    """Learning curves of conditions that belong together: seeds thin, the mean thick, its spread shaded."""
    figure, axes = new_axes(3.4)
    labels = list(dict.fromkeys(section.label(summary) for summary in section.summaries))
    end = max(float(summary.seeds.frames[-1]) for summary in members if summary.seeds is not None)
    for summary in members:
        index = labels.index(section.label(summary))
        _curve(axes, summary, index, labels[index])
        _ends(axes, summary, index, end * 1.03)
        for name, spread in summary.tests.items():
            if len(spread):
                axes.axhline(spread.mean(), color=colour(index), linestyle="-.", linewidth=1.3, zorder=2)
                _name_line(axes, name, spread.mean(), end, colour(index))
    for name, level, style in _levels(members, baselines):
        axes.axhline(level, color=MUTED, linestyle=style, linewidth=1, zorder=1, label=name)
    rates(axes)
    frames(axes, end * 1.03)
    axes.set_title(shown(title, 40))
    axes.set_xlabel("frames")
    axes.set_ylabel("success")
    _legend(figure, axes)
    return figure


def _name_line(axes: Axes, name: str, height: float, end: float, ink: str) -> None:
    """Write over a line whose it is, unless a line beside it has its name there."""
    if all(abs(text.get_position()[1] - height) > _BETWEEN for text in axes.texts):
        axes.text(
            end * 0.02,
            height + 0.015,
            shown(f"on {scenario_name(name)}", 30),
            fontsize=7.5,
            color=ink,
            va="bottom",
        )


def _curve(axes: Axes, summary: Summary, index: int, label: str) -> None:
    seeds = summary.seeds
    assert seeds is not None, "internal: only conditions with curves are drawn"
    success, ink = pd.DataFrame(seeds.success), colour(index)
    mean, std = success.mean(), success.std()
    axes.plot(seeds.frames, success.T, color=ink, alpha=0.3, linewidth=0.7, zorder=2)
    axes.fill_between(seeds.frames, mean - std, mean + std, color=ink, alpha=0.15, linewidth=0, zorder=1.5)
    axes.plot(seeds.frames, mean, "--", color=ink, linewidth=1.2, zorder=3)
    axes.plot(
        seeds.frames, mean.where(success.notna().all()), color=ink, linewidth=2, label=shown(label), zorder=3
    )


def _ends(axes: Axes, summary: Summary, index: int, place: float) -> None:
    """What the test episodes gave, and what was published, beyond the right end."""
    look: dict[str, Any] = {"clip_on": False, "zorder": 5, "linestyle": "none"}
    reference = summary.condition.entry.reference
    if reference is not None:
        axes.plot([place], [reference.mean], "D", mfc="none", mec=colour(index), markersize=6, **look)
    if len(summary.success):
        axes.plot([place], [summary.success.mean()], marker(index), color=colour(index), markersize=5, **look)


def endings_figure(summary: Summary, label: str) -> Figure:
    """How training episodes of a condition ended over frames, mean over seeds, in the words of the scenario."""
    figure, axes = new_axes(3.4)
    axes.set_title(shown(label, 40))
    _endings(axes, summary)
    return figure


def _endings(axes: Axes, summary: Summary) -> None:
    seeds = summary.seeds
    assert seeds is not None, "internal: only conditions with curves are drawn"
    words = {name: ending.text for name, ending in summary.endings.items()}
    below = {"loc": "upper left", "bbox_to_anchor": (-0.08, -0.1)}
    draw_outcomes(axes, seeds.frames, seeds.means("outcomes"), summary.successes, words, below)
    rates(axes)
    axes.set_ylim(0, 1)
    frames(axes, float(seeds.frames[-1]))


def conditions_figure(summaries: Sequence[Summary]) -> Figure:
    """Conditions that have learned, side by side: success above, endings of episodes, the rules that fired most."""
    with styled():
        figure = Figure(figsize=(WIDTH * len(summaries), 9), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(3, len(summaries), squeeze=False, height_ratios=(3, 2, 2))
        for (success, endings, rules), summary in zip(grid.T, summaries, strict=True):
            assert summary.seeds is not None, "internal: only conditions with curves are drawn"
            end = float(summary.seeds.frames[-1])
            success.set_title(fill(shown(summary.name, 3 * _TITLE), _TITLE))
            _curve(success, summary, 0, "training")
            _ends(success, summary, 0, end * 1.03)
            rates(success)
            frames(success, end * 1.03)
            _endings(endings, summary)
            _rules(rules, summary.seeds)
            frames(rules, end)
        for axes, label in zip(
            grid[:, 0], ("success", "episodes ended by", "firings per episode"), strict=True
        ):
            axes.set_ylabel(label)
    return figure


def _rules(axes: Axes, seeds: Seeds) -> None:
    """The rules that fired most, one line each."""
    means = seeds.means("rules")
    peaks = {name: float(np.nanmax(rate, initial=0.0)) for name, rate in means.items()}
    names = [name for name in sorted(peaks, key=lambda name: -peaks[name]) if peaks[name] > 0][:_RULES_SHOWN]
    for name in names:
        axes.plot(seeds.frames, means[name], linewidth=1.4, label=shown(name))
    axes.set_ylim(bottom=0)
    if names:
        axes.legend(loc="upper left", bbox_to_anchor=(-0.08, -0.1), fontsize=7)


def iqm_figure(section: Section) -> Figure:
    """Interquartile mean of each column with its interval; below it that of the rows that all columns have."""
    figure, axes = new_axes(0.9 + 0.4 * len(section.columns))
    columns = list(section.by("column"))
    for place, one in enumerate(section.columns):
        ink, (value, low, high) = colour(columns.index(one["column"])), one["iqm"]
        axes.barh(place, high - low, left=low, height=0.5, color=ink, alpha=0.35)
        axes.plot([value] * 2, [place - 0.25, place + 0.25], color=ink, linewidth=2.5)
        if one["common"] not in (None, one["iqm"]):
            value, low, high = one["common"]
            axes.plot([low, high], [place + 0.36] * 2, color=MUTED, linewidth=1.2)
            axes.plot(
                [value], [place + 0.36], "o", color=MUTED, markersize=3, label="rows that all columns have"
            )
    names = [one["column"] for one in section.columns]
    lanes(axes, np.arange(len(names)).tolist(), names, len(names) - 0.4, "interquartile mean of success")
    _legend(figure, axes)
    return figure
