"""Schelling diagrams: what those who cooperate and those who defect are paid, by how many others cooperate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from socialai_dsl.reporting.records import SchellingRecord
from socialai_dsl.reporting.style import (
    INK,
    MUTED,
    colour,
    marker,
    new_axes,
    saved,
    scenario_name,
    shown,
    styled,
)
from socialai_dsl.runs.folder import scenario_folder_name

_CHARACTERS: Final = 74  # of a line below the figure
_NO_ERROR: Final = 1e-9
"""A standard error below this is none."""


def dilemmas_of(checked: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The figures of each claim `dilemma` that was tried, as a report takes them."""
    return {
        "dilemmas": [
            {"scenario": report["scenario"], "schelling": one["schelling"]}
            for report in checked
            for one in report.get("properties", ())
            if "schelling" in one
        ]
    }


def draw_dilemmas(checked: Sequence[Mapping[str, Any]], folder: Path) -> list[Path]:
    """Draw each claim `dilemma` that was tried into a folder, as PNG and SVG.

    Args:
        checked: of each scenario what `socialai check --json` prints.
        folder: which is made if it is not there.

    Returns:
        The pictures.
    """
    drawn: list[Path] = []
    for report in checked:
        found = [one["schelling"] for one in report.get("properties", ()) if "schelling" in one]
        for number, figures in enumerate(found, start=1):
            folder.mkdir(parents=True, exist_ok=True)
            figure = dilemma_figure(report["scenario"], SchellingRecord.model_validate(figures))
            name = f"{scenario_folder_name(report['scenario'])}_dilemma" + (
                f"{number}" if len(found) > 1 else ""
            )
            for form in ("png", "svg"):
                drawn.append(folder / f"{name}.{form}")
                drawn[-1].write_bytes(saved(figure, form))
    return drawn


def dilemma_figure(scenario: str, found: SchellingRecord) -> Figure:
    """The diagram with its verdict below; bars are two standard errors over rooms."""
    with styled():
        figure, axes = new_axes(3.6)
        others = range(len(found.cooperators))
        lines = (
            (found.cooperators, found.cooperators_se, f"those who cooperate ({shown(found.frames[0], 20)})"),
            (found.defectors, found.defectors_se, f"those who defect ({shown(found.frames[1], 20)})"),
        )
        for index, (means, errors, label) in enumerate(lines):
            bars = [2 * error for error in errors] if max(errors) > _NO_ERROR else None
            axes.errorbar(
                others, means, yerr=bars, fmt=f"-{marker(index)}", color=colour(index), linewidth=2, markersize=6,
                capsize=3, elinewidth=1.2, label=label, zorder=3,
            )  # fmt: skip
        _all_and_nobody(axes, found)
        axes.set_xticks(others)
        axes.set_xlim(-0.35, len(others) - 0.65)
        axes.margins(y=0.16)
        axes.set_title(shown(scenario_name(scenario), 44))
        axes.set_xlabel(
            f"how many of the {len(others) - 1} others cooperate"
            if len(others) > 2
            else "how many others cooperate"
        )
        axes.set_ylabel("mean reward of an episode")
        figure.legend(loc="outside upper left", ncols=1)
        figure.supxlabel(
            fill(f"{found.verdict[:1].upper()}{found.verdict[1:]}.", _CHARACTERS),
            fontsize=7.5,
            color=MUTED,
            x=0.02,
            ha="left",
        )
    return figure


def _all_and_nobody(axes: Axes, found: SchellingRecord) -> None:
    """Lines across for what each is paid if all cooperate, and if nobody does, which a dilemma sets apart."""
    together, alone = found.cooperators[-1], found.defectors[0]
    above = together >= alone
    for index, (said, level, place, is_above) in enumerate(
        [
            ("all\ncooperate", together, len(found.cooperators) - 1, above),
            ("nobody\ndoes", alone, 0, not above),
        ]
    ):
        ink = colour(index)
        axes.axhline(level, color=ink, linestyle=":", linewidth=1.1, zorder=1)
        axes.plot([place], [level], marker(index), mfc="white", mec=ink, markersize=7, mew=1.8, zorder=4)
        axes.annotate(
            f"{said}\n{level:.2f}", (1.0, level), xycoords=axes.get_yaxis_transform(), textcoords="offset points",
            xytext=(5, 0), va="bottom" if is_above else "top", fontsize=7.5, color=INK, linespacing=1.1,
        )  # fmt: skip
