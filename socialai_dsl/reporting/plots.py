"""The figures of a report: success beside published figures, learning curves, endings, interquartile means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from socialai_dsl.reporting.analysis import Aggregate, Ceilings, Section, Summary, column_of
from socialai_dsl.reporting.curve import draw_outcomes
from socialai_dsl.reporting.seeds import Float, mean_over_seeds
from socialai_dsl.reporting.style import INK, MUTED, colour, frames, marker, new_figure, rates, shown

_PANEL: Final = (4.4, 2.9)  # inches
_NARROW: Final = 4.4
_BETWEEN: Final = 0.08  # of an axis, so that two names do not overlap
_ACROSS: Final = 2
_Style = Literal["-", ":", "--"]
_LEVELS: Final[tuple[tuple[str, str, _Style], ...]] = (
    ("oracle", "own script", "-"),
    ("random", "random", ":"),
    ("alone", "without NPCs", "--"),
)


def colours_of(section: Section) -> dict[str, int]:
    """The index of the colour of each column, or of each condition of a case study."""
    labels = dict.fromkeys(section.label(summary) for summary in section.summaries)
    return {label: index for index, label in enumerate(labels)}


def success_figure(section: Section, ceilings: Mapping[str, Ceilings], narrow: bool = False) -> Figure:
    """Test success of every condition: a dot for each seed, mean and standard deviation, published figures beside."""
    rows = section.rows
    colours = {column: index for index, column in enumerate(section.columns)}
    lanes = sum(len(members) for members in rows.values()) + 0.9 * (len(rows) - 1)
    figure = new_figure(_NARROW if narrow else 8.8, 0.9 + 0.27 * lanes + (0.6 if narrow else 0.25))
    axes = figure.subplots()
    place, ticks = 0.0, []
    for members in rows.values():
        top = place
        for summary in members:
            _dots(axes, summary, place, colours[column_of(summary)])
            place += 1
        ticks.append((top + place - 1) / 2)
        _level_marks(axes, ceilings.get(members[0].condition.entry.scenario), top - 0.45, place - 0.55)
        place += 0.9
    axes.set_yticks(ticks, [shown(row, 30) for row in rows])
    axes.tick_params(axis="y", length=0, labelsize=9, labelcolor=INK)
    axes.set_ylim(place - 1.1, -0.8)
    axes.grid(axis="y", visible=False)
    axes.grid(axis="x", visible=True)
    axes.spines["left"].set_visible(False)
    rates(axes, "x")
    axes.set_xlabel("success on the test episodes")
    handles: list[Any] = [
        Line2D([], [], color=colour(i), marker=marker(i), linestyle="none", label=shown(name))
        for name, i in colours.items()
    ]
    if any(summary.reference is not None for summary in section.summaries):
        handles.append(_reference_handle())
    handles += _level_handles([s.condition.entry.scenario for s in section.summaries], ceilings)
    figure.legend(handles=handles, loc="outside upper left", ncols=2 if narrow else 4, fontsize=8.5)
    return figure


def _dots(axes: Axes, summary: Summary, place: float, index: int) -> None:
    success, reference = summary.success, summary.reference
    if reference is not None:
        axes.errorbar(
            [reference.mean], [place], xerr=reference.std, fmt="D", markersize=7, markerfacecolor="none",
            markeredgecolor=INK, ecolor=INK, elinewidth=0.8, capsize=0, zorder=4,
        )  # fmt: skip
    if success.n:
        axes.plot(
            success.values, [place] * success.n, marker(index), color=colour(index), alpha=0.35, markersize=4
        )
        axes.errorbar(
            [success.mean], [place], xerr=success.std, fmt=marker(index), color=colour(index), markersize=6,
            elinewidth=2, capsize=3, zorder=3,
        )  # fmt: skip


def _level_marks(axes: Axes, ceilings: Ceilings | None, top: float, bottom: float) -> None:
    for name, _, style in _LEVELS:
        level = getattr(ceilings, name, None)
        if level is not None:
            axes.plot([level.value] * 2, [top, bottom], style, color=MUTED, linewidth=1.1, zorder=1)


def _reference_handle() -> Line2D:
    return Line2D(
        [],
        [],
        color=INK,
        marker="D",
        markerfacecolor="none",
        linestyle="none",
        markersize=6,
        label="published",
    )


def _level_handles(scenarios: Sequence[str], ceilings: Mapping[str, Ceilings]) -> list[Line2D]:
    there = [ceilings[scenario] for scenario in scenarios if scenario in ceilings]
    return [
        Line2D([], [], color=MUTED, linestyle=style, linewidth=1.2, label=label)
        for name, label, style in _LEVELS
        if any(getattr(one, name) is not None for one in there)
    ]


def curves_figure(section: Section, ceilings: Mapping[str, Ceilings], narrow: bool = False) -> Figure | None:
    """Learning curves, a panel for conditions that belong together: seeds thin, the mean thick, its spread shaded.

    None where nothing was trained.
    """
    rows = {row: [s for s in members if s.seeds is not None] for row, members in section.panels.items()}
    rows = {row: members for row, members in rows.items() if members}
    if not rows:
        return None
    colours = colours_of(section)
    across = 1 if narrow else min(_ACROSS, len(rows))
    down = -(-len(rows) // across)
    width = _NARROW if narrow else _PANEL[0] * across if len(rows) > 1 else 8.0
    figure = new_figure(width, _PANEL[1] * down * (1.25 if len(rows) == 1 else 1) + (0.9 if narrow else 0.5))
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for axes in panels[len(rows) :]:
        axes.set_axis_off()
    tests = False
    for axes, (row, members) in zip(panels, rows.items(), strict=False):
        axes.set_title(shown(row, 40))
        tests |= _panel(axes, section, members, colours, ceilings)
    handles: list[Any] = [
        Line2D([], [], color=colour(i), linewidth=2, marker=marker(i), markersize=5, label=shown(name))
        for name, i in colours.items()
    ]
    if tests:
        handles.append(Line2D([], [], color=INK, linestyle="-.", linewidth=1.2, label="on a further test"))
    if any(s.reference is not None for members in rows.values() for s in members):
        handles.append(_reference_handle())
    handles += _level_handles([members[0].condition.entry.scenario for members in rows.values()], ceilings)
    figure.legend(
        handles=handles,
        loc="outside upper left",
        ncols=2 if narrow else 3 if across == 1 else 4,
        fontsize=8.5,
    )
    return figure


def _panel(
    axes: Axes,
    section: Section,
    members: Sequence[Summary],
    colours: Mapping[str, int],
    ceilings: Mapping[str, Ceilings],
) -> bool:
    """Draw a row; whether further tests are among it."""
    end = max(float(s.seeds.frames[-1]) for s in members if s.seeds is not None)
    levels = ceilings.get(members[0].condition.entry.scenario)
    for name, _, style in _LEVELS:
        level = getattr(levels, name, None)
        if level is not None:
            axes.axhline(level.value, color=MUTED, linestyle=style, linewidth=1, zorder=1)
    tested = False
    for summary in members:
        index = colours[section.label(summary)]
        _curve(axes, summary, index)
        _ends(axes, summary, index, end)
        for name, spread in summary.tests.items():
            if spread.n:
                tested = True
                axes.axhline(spread.mean, color=colour(index), linestyle="-.", linewidth=1.3, zorder=2)
                _name_line(axes, name, spread.mean, end, colour(index))
    rates(axes)
    frames(axes, end * 1.03)
    axes.set_xlabel("frames")
    axes.set_ylabel("success")
    return tested


def _name_line(axes: Axes, name: str, height: float, end: float, ink: str) -> None:
    """Write over a line whose it is, unless a line beside it has its name there."""
    if all(abs(text.get_position()[1] - height) > _BETWEEN for text in axes.texts):
        axes.text(end * 0.02, height + 0.015, shown(name, 30), fontsize=7.5, color=ink, va="bottom")


def _curve(axes: Axes, summary: Summary, index: int) -> None:
    seeds = summary.seeds
    assert seeds is not None, "internal: only conditions with curves are drawn"
    for one in seeds.success:
        axes.plot(seeds.frames, one, color=colour(index), alpha=0.3, linewidth=0.7, zorder=2)
    mean, std = mean_over_seeds(seeds.success), std_over_seeds(seeds.success)
    axes.fill_between(
        seeds.frames, mean - std, mean + std, color=colour(index), alpha=0.15, linewidth=0, zorder=1.5
    )
    axes.plot(seeds.frames, mean, "--", color=colour(index), linewidth=1.2, zorder=3)
    everyone = np.where(np.isnan(seeds.success).any(0), np.nan, mean)
    axes.plot(seeds.frames, everyone, color=colour(index), linewidth=2, zorder=3)


def std_over_seeds(rates: Float) -> Float:
    """Sample standard deviation over the seeds that had an episode, (S, B) to (B,); nan where fewer than two had."""
    known = ~np.isnan(rates)
    count = known.sum(0)
    centred = np.where(known, rates - mean_over_seeds(rates), 0.0)
    spread = np.sqrt((centred**2).sum(0) / np.maximum(count - 1, 1))
    return np.where(count > 1, spread, np.nan)


def _ends(axes: Axes, summary: Summary, index: int, end: float) -> None:
    """What the test episodes gave, and what was published, beyond the right end."""
    place = end * 1.03
    if summary.reference is not None:
        axes.plot(
            [place], [summary.reference.mean], "D", markerfacecolor="none", markeredgecolor=colour(index),
            markersize=6, clip_on=False, zorder=5,
        )  # fmt: skip
    if summary.success.n:
        axes.plot(
            [place],
            [summary.success.mean],
            marker(index),
            color=colour(index),
            markersize=5,
            clip_on=False,
            zorder=4,
        )


def endings_figure(members: Sequence[Summary], labels: Sequence[str], narrow: bool = False) -> Figure | None:
    """How training episodes ended over frames, mean over seeds, a panel for each condition; None without curves."""
    drawn = [(s, label) for s, label in zip(members, labels, strict=True) if s.seeds is not None]
    if not drawn:
        return None
    down, across = (len(drawn), 1) if narrow else (1, len(drawn))
    size = (_NARROW, 2.9 * down) if narrow else (max(3.2, 2.9 * across), 2.9)
    figure = new_figure(*size)
    panels = figure.subplots(down, across, squeeze=False, sharey=True).ravel()
    for axes, (summary, label) in zip(panels, drawn, strict=True):
        assert summary.seeds is not None, "internal: only conditions with curves are drawn"
        means = {shown(n, 30): mean_over_seeds(rate) for n, rate in summary.seeds.part("outcomes").items()}
        successes = frozenset(shown(name, 30) for name in summary.successes)
        draw_outcomes(axes, summary.seeds.frames, means, successes, _BELOW)
        axes.set_title(shown(label, 28), fontsize=9)
        rates(axes)
        axes.set_ylim(0, 1)
        frames(axes, float(summary.seeds.frames[-1]))
    return figure


_BELOW: Final = {"loc": "upper left", "bbox_to_anchor": (-0.05, -0.14), "ncols": 1}


def iqm_figure(aggregates: Sequence[Aggregate], columns: Sequence[str], narrow: bool = False) -> Figure:
    """Interquartile mean of each column with its interval."""
    figure = new_figure(_NARROW if narrow else 8.0, 0.75 + 0.36 * len(aggregates))
    axes = figure.subplots()
    for place, aggregate in enumerate(aggregates):
        index = columns.index(aggregate.column)
        estimate = aggregate.estimate
        axes.barh(
            place,
            estimate.high - estimate.low,
            left=estimate.low,
            height=0.5,
            color=colour(index),
            alpha=0.35,
        )
        axes.plot([estimate.value] * 2, [place - 0.25, place + 0.25], color=colour(index), linewidth=2.5)
        if aggregate.common is not None and aggregate.common != estimate:
            common = aggregate.common
            axes.plot([common.low, common.high], [place + 0.36] * 2, color=MUTED, linewidth=1.2)
            axes.plot([common.value], [place + 0.36], "o", color=MUTED, markersize=3)
    axes.set_yticks(range(len(aggregates)), [shown(a.column, 30) for a in aggregates])
    axes.tick_params(axis="y", length=0, labelsize=9, labelcolor=INK)
    axes.set_ylim(len(aggregates) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.grid(axis="x", visible=True)
    axes.spines["left"].set_visible(False)
    rates(axes, "x")
    axes.set_xlabel("interquartile mean of success")
    if any(a.common is not None and a.common != a.estimate for a in aggregates):
        handles: list[Any] = [
            Patch(color=MUTED, alpha=0.5, label="all rows of the column"),
            Line2D([], [], color=MUTED, marker="o", markersize=3, label="rows that all columns have"),
        ]
        figure.legend(handles=handles, loc="outside upper left", ncols=1 if narrow else 2)
    return figure
