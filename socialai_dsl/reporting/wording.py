"""Figures in words: counts, times, means with their spread, unknown values."""

from __future__ import annotations

import math
from typing import Final

from socialai_dsl.reporting.document import Cell
from socialai_dsl.reporting.statistics import Estimate, Spread

NONE: Final = Cell("–", tone="muted")


def spread_text(spread: Spread) -> str:
    """Mean ± standard deviation; the mean alone of one seed."""
    return f"{spread.mean:.3f}" + (f" ± {spread.std:.3f}" if spread.std is not None else "")


def number_cell(value: float | None, form: str) -> Cell:
    """A number in a format of Python's, or a dash where there is none."""
    return NONE if value is None or math.isnan(value) else Cell(signed(value, form))


def signed(value: float, form: str) -> str:
    """A number with a real minus sign."""
    return format(value, form).replace("-", "\u2212")


def estimate_text(estimate: Estimate) -> str:
    """A figure and its interval."""
    return f"{estimate.value:.3f} [{estimate.low:.3f}, {estimate.high:.3f}]"


def signed_estimate_text(estimate: Estimate) -> str:
    """A difference and its interval."""
    value, low, high = (signed(part, "+.3f") for part in (estimate.value, estimate.low, estimate.high))
    return f"{value} [{low}, {high}]"


def duration(seconds: float) -> str:
    """A time, in the unit that fits."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    if seconds < 3600:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


def count_of(number: int, noun: str) -> str:
    """`3 runs`, `1 run`."""
    return f"{number:,} {noun}" + ("" if number == 1 else "s")
