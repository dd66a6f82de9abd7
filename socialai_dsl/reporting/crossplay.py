"""Pictures of cross-play: who plays how well with whom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Rectangle

from socialai_dsl.reporting.records import CrossPlayRecord, SeatRecord
from socialai_dsl.reporting.style import COLOURS, INK, MUTED, colour, lanes, shown, styled

_RAMP: Final = LinearSegmentedColormap.from_list("success", ["#f4f7fa", "#a9cfe6", COLOURS[0], "#003a5c"])
_DARK: Final = 0.55
"""Text in a cell of a greater success is white."""

_CELL: Final = (0.8, 0.46)
"""Inches of a cell."""
_SMALL_CELL: Final = (0.62, 0.38)
_FEW: Final = 5
"""So many players have large cells, and names over their columns."""
_NAME: Final = 30  # characters
_SHORT: Final = 8


def matrices_figure(found: CrossPlayRecord) -> Figure:
    """A matrix for each seat side by side, one for seats that are alike, in a figure of their own."""
    groups = found.alike
    width, height = matrix_size(found)
    with styled():
        figure = Figure(figsize=(width * len(groups), height + 0.3), layout="constrained")
        FigureCanvasAgg(figure)
        title = shown(found.scenario, round(width * len(groups) * 11))
        figure.suptitle(title, x=0.01, ha="left", fontsize=11.0, fontweight="bold")
        parts = figure.subfigures(1, len(groups), squeeze=False)[0]
        for part, seats in zip(parts, groups, strict=True):
            _draw(part, found, seats)
    return figure


def matrix_figure(found: CrossPlayRecord, seats: Sequence[str]) -> Figure:
    """The matrix of seats that are alike."""
    figure = Figure(figsize=matrix_size(found), layout="constrained")
    FigureCanvasAgg(figure)
    _draw(figure, found, seats)
    return figure


def matrix_size(found: CrossPlayRecord) -> tuple[float, float]:
    """Inches of a matrix with its names and means."""
    wide, high = _cell(found)
    longest = max(len(_label(name)) for name in found.agents)
    head = max(map(len, _heads(found)))
    above = 0.6 + (head * 0.055 if head > _SHORT else 0.0)
    rows, columns = len(found.agents), len(found.others)
    return max(4.2, columns * wide + 0.9 + longest * 0.075), rows * high + above + 1.3


def _cell(found: CrossPlayRecord) -> tuple[float, float]:
    return _SMALL_CELL if _numbered(found) else _CELL


def _numbered(found: CrossPlayRecord) -> bool:
    """Whether columns have numbers for names."""
    return len(found.others) > _FEW


def _heads(found: CrossPlayRecord) -> list[str]:
    """What stands over each column: the number of its row where there are many, else the name."""
    if not _numbered(found):
        return [_label(name) for name in found.others]
    rows = {name: str(number) for number, name in enumerate(found.agents, start=1)}
    return [rows.get(name) or _label(name) for name in found.others]


def _draw(figure: Figure | SubFigure, found: CrossPlayRecord, seats: Sequence[str]) -> None:
    cells = len(found.agents) * _cell(found)[1]
    matrix, means = figure.subplots(2, 1, height_ratios=(cells, 0.55))
    _matrix(matrix, found, seats)
    _means(means, found.seats[seats[0]], found.episodes)


def _matrix(axes: Axes, found: CrossPlayRecord, seats: Sequence[str]) -> None:
    """Rows: who plays the agent. Columns: who plays the others. Outlined: a player with itself. Pairs that did not
    play are empty.
    """
    rows, columns, first = found.agents, found.others, next(iter(found.seats))
    rates = {(cell.agent, cell.others): cell for cell in found.seats[seats[0]].cells}
    success = np.full((len(rows), len(columns)), np.nan)
    for one, other in rates:
        success[rows.index(one), columns.index(other)] = rates[one, other].success
    axes.pcolormesh(success, cmap=_RAMP, vmin=0, vmax=1, edgecolor="white", linewidth=1.5)
    large = 8.5 if _numbered(found) else 10.0
    for row, column in zip(*(~np.isnan(success)).nonzero(), strict=True):
        rate = success[row, column]
        cell = rates[rows[row], columns[column]]
        below = f"{cell.interval[0]:.2f}–{cell.interval[1]:.2f}"
        if cell.episodes != found.episodes:
            below += f"\n{cell.episodes:,} episodes"
        ink = "white" if rate > _DARK else INK
        centre: dict[str, Any] = {"ha": "center", "color": ink}
        axes.text(
            column + 0.5, row + 0.46, f"{rate:.2f}", va="bottom", fontsize=large, fontweight="bold", **centre
        )
        axes.text(column + 0.5, row + 0.58, below, va="top", fontsize=large - 3.0, linespacing=1.0, **centre)
    for one in (one for one, other in rates if one == other):
        corner = columns.index(one) + 0.03, rows.index(one) + 0.04
        axes.add_patch(Rectangle(corner, 0.94, 0.92, fill=False, edgecolor=COLOURS[1], linewidth=1.8))
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0, labelcolor=INK, labelsize=8.5)
    names, heads = [_label(name) for name in rows], _heads(found)
    if _numbered(found):
        names = [f"{name}  {number}" for number, name in enumerate(names, start=1)]
    axes.set_yticks(np.arange(len(rows)) + 0.5, names)
    slanted = max(map(len, heads)) > _SHORT
    axes.set_xticks(
        np.arange(len(columns)) + 0.5,
        heads,
        rotation=40 if slanted else 0,
        ha="left" if slanted else "center",
        rotation_mode="anchor",
    )
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    others = [seat for seat in found.seats if seat != first]
    axes.set_xlabel("plays " + (others[0] if len(others) == 1 else "the others"), color=MUTED)
    axes.set_ylabel(f"plays {first}", color=MUTED)
    axes.set_title(shown(f"success of {' and '.join(seats)}", 60), pad=8, loc="left")


def _means(axes: Axes, seat: SeatRecord, episodes: int) -> None:
    """The mean with themselves beside that with others, with intervals."""
    rates = [("with themselves", seat.with_themselves, 1), ("with others", seat.with_others, 0)]
    drawn = [(name, rate, ink) for name, rate, ink in rates if rate is not None]
    for place, (_, rate, ink) in enumerate(drawn):
        low, high = rate.interval
        axes.plot([low, high], [place] * 2, color=colour(ink), linewidth=3, alpha=0.5, solid_capstyle="butt")
        axes.plot([rate.success], [place], "o", color=colour(ink), markersize=4.5, clip_on=False, zorder=3)
        axes.text(
            1.04, place, f"{rate.success:.2f}  [{low:.2f}, {high:.2f}]", va="center", fontsize=8.0,
            transform=axes.get_yaxis_transform(), clip_on=False,
        )  # fmt: skip
    below = f"mean success; {episodes:,} test episodes of each pair, 95 % intervals"
    lanes(axes, list(range(len(drawn))), [name for name, *_ in drawn], len(drawn) - 0.4, below)
    axes.xaxis.label.set(fontsize=7.5, color=MUTED)


def _label(name: str) -> str:
    """A name, both ends of it where it is long, since either may tell it from others."""
    line = shown(name, len(name) + 1)
    return line if len(line) <= _NAME else f"{line[: _NAME // 3]}…{line[-2 * _NAME // 3 :]}"
