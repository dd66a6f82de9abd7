"""Reads numbers from the command line."""

import argparse
import math


def positive(text: str) -> int:
    """A whole number of at least 1; `1_000` and `1,000` are 1000."""
    return _number(text, 1)


def natural(text: str) -> int:
    """A whole number of at least 0."""
    return _number(text, 0)


def seconds(text: str) -> float:
    """A time above 0; it may have a fraction."""
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not (0 < found < math.inf):
        raise argparse.ArgumentTypeError(f"expected a number of seconds above 0, got {text!r}")
    return found


def _number(text: str, least: int) -> int:
    try:
        number = int(text.replace("_", "").replace(",", ""))
    except ValueError:
        number = least - 1
    if number < least:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least {least}, got {text!r}")
    return number
