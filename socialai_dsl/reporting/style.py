"""The look of all figures of a report: colours for colour-blind readers, sizes, number formats."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, PercentFormatter

# Okabe and Ito (2008), without yellow, which is too light for a line, and with black last.
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS: Final = ("o", "s", "^", "D", "v", "P", "X")
INK: Final = "#1f2430"
MUTED: Final = "#6b7280"

WIDTH: Final = 4.6
"""Inches of every figure: the page sets as many side by side as there is room for, on a telephone one."""

_SETTINGS: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": "#9aa1ad",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": "#e3e6eb",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "text.color": INK,
    "text.parse_math": False,  # names come from files; a dollar sign in one is a dollar sign
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "svg.hashsalt": "socialai-dsl",
}


def colour(index: int) -> str:
    """The colour of the column or condition with this index."""
    return COLOURS[index % len(COLOURS)]


def marker(index: int) -> str:
    """Its marker, for who sees no colours."""
    return MARKERS[index % len(MARKERS)]


def scenario_name(reference: str) -> str:
    """A scenario without the folder and the ending of its file: `rooms/mine.yaml?n=2` is `mine?n=2`."""
    return re.sub(r"^.*/|\.yaml", "", reference)


def styled() -> AbstractContextManager[None]:
    """Draw in the report's style."""
    return matplotlib.rc_context(_SETTINGS)


def new_axes(height: float) -> tuple[Figure, Axes]:
    """A figure of this height, in inches, with one panel."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots()


def rates(axes: Axes, along: str = "y") -> None:
    """An axis from 0 to 100 %, with room for a marker at either end."""
    axis = axes.yaxis if along == "y" else axes.xaxis
    (axes.set_ylim if along == "y" else axes.set_xlim)(-0.02, 1.02)
    axis.set_major_formatter(PercentFormatter(1.0))
    axis.set_ticks([0, 0.25, 0.5, 0.75, 1])


def lanes(axes: Axes, places: Sequence[float], names: Sequence[str], bottom: float, label: str) -> None:
    """Names at the left, rates along the bottom."""
    axes.set_yticks(places, [shown(name, 24) for name in names])
    axes.tick_params(axis="y", length=0, labelsize=8.5, labelcolor=INK)
    axes.set_ylim(bottom, -0.8)
    axes.grid(axis="y", visible=False)
    axes.grid(axis="x", visible=True)
    axes.spines["left"].set_visible(False)
    rates(axes, "x")
    axes.set_xlabel(label)


def frames(axes: Axes, end: float) -> None:
    """A horizontal axis of frames."""
    axes.set_xlim(0, max(end, 1) * 1.02)
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))


def saved(figure: Figure, form: str) -> bytes:
    """The figure as `svg` or `png`, the same bytes for the same figure."""
    stream = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if form == "svg" else {"Software": None}
    with styled(), warnings.catch_warnings():
        # Names come from files; a letter that the font lacks is drawn as a box.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(stream, format=form, dpi=150, metadata=metadata)
    return stream.getvalue()


def shown(name: str, width: int = 48) -> str:
    """A name as a figure shows it: on one line, cut to a width, and not hidden by a leading underscore."""
    line = " ".join(name.split())
    line = line if len(line) <= width else line[: width - 1] + "…"
    return f"\u200a{line}" if line.startswith("_") else line
