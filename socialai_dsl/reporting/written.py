"""How figures stand on the page of a report: as text, with real minus signs, and a dash where nothing is known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import pandas as pd

from socialai_dsl.reporting.statistics import Estimate

NONE: Final = "–"

Rows = list[dict[str, Any]]
"""A table of the page: what stands under each heading, as text; lines after the first are smaller print."""


def spread(values: Sequence[float] | pd.Series) -> str:
    """Mean ± standard deviation; the mean alone of one seed; a dash without any."""
    known = pd.Series(values, dtype=float)
    return figure(known.mean(), known.std()) if len(known) else NONE


def figure(mean: float | None, std: float | None, digits: int = 3) -> str:
    """Mean ± standard deviation; the mean alone where its deviation is unknown; a dash without any."""
    if mean is None:
        return NONE
    known = std is not None and not math.isnan(std)
    return f"{mean:.{digits}f}" + (f" ± {std:.{digits}f}" if known else "")


def difference(one: Mapping[str, Any]) -> str:
    """A difference, with its interval where there is one."""
    if one["difference_low"] is None:
        return signed(one["difference"])
    return interval(Estimate(*(one[f"difference{part}"] for part in ("", "_low", "_high"))), "+.3f")


def signed(value: float | None, form: str = "+.3f") -> str:
    """A number with a real minus sign, or a dash where there is none."""
    return NONE if value is None or math.isnan(value) else format(value, form).replace("-", "\u2212")


def p_value(value: float | None) -> str:
    """A p, which is never 0; a dash without one."""
    return "< 0.0001" if value is not None and value < 1e-4 else signed(value, ".4f")


def count_of(number: int, noun: str) -> str:
    """`3 runs`, `1 run`."""
    return f"{number:,} {noun}" + ("" if number == 1 else "s")


def interval(estimate: Estimate | None, form: str = ".3f") -> str:
    """A figure with its interval in brackets; a dash without one."""
    if estimate is None:
        return NONE
    value, low, high = (signed(part, form) for part in estimate)
    return f"{value} [{low}, {high}]"


def duration(seconds: float) -> str:
    """Seconds, minutes or hours, whichever is read best."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 3600 else f"{seconds / 3600:.1f} h"
