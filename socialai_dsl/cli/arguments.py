"""Options that several commands have, and numbers on the command line."""

import argparse
import math
from collections.abc import Callable
from typing import Any, Final

STYLE: Final[dict[str, Any]] = {
    "choices": ("prose", "grid", "json"),
    "default": "prose",
    "help": "style of the observations (default: prose)",
}
"""The option `--style`: how a language model reads observations."""
ROOMS: Final = 100
SECONDS: Final = 20.0


def add_effort(parser: argparse.ArgumentParser) -> None:
    """Declare how much is tried, and for how long."""
    parser.add_argument(
        "--rooms",
        type=positive,
        default=ROOMS,
        metavar="N",
        help=f"number of rooms (default: {ROOMS})",
    )
    parser.add_argument(
        "--seconds",
        type=at_least(0.0),
        default=SECONDS,
        metavar="S",
        help=f"time limit: N scenarios have N times as much in all; 0 for none (default: {SECONDS:g})",
    )


def positive(text: str) -> int:
    """A whole number of at least 1; `1_000` and `1,000` are 1000."""
    return _number(text, 1)


def natural(text: str) -> int:
    """A whole number of at least 0."""
    return _number(text, 0)


def seconds(text: str) -> float:
    """A time above 0; it may have a fraction."""
    found = _fraction(text)
    if not (0 < found < math.inf):
        raise argparse.ArgumentTypeError(f"expected a number of seconds above 0, got {text!r}")
    return found


def percent(text: str) -> float:
    """A number from 0 to 100."""
    found = _fraction(text)
    if not (0 <= found <= 100):
        raise argparse.ArgumentTypeError(f"got {text}, expected a per cent from 0 to 100")
    return found


def at_least(least: float) -> Callable[[str], float]:
    """A finite number that is not below `least`."""

    def number(text: str) -> float:
        found = _fraction(text)
        if not (least <= found < math.inf):
            raise argparse.ArgumentTypeError(f"got {text}, expected at least {least:g}")
        return found

    return number


def _fraction(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _number(text: str, least: int) -> int:
    try:
        number = int(text.replace("_", "").replace(",", ""))
    except ValueError:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number") from None
    if number < least:
        raise argparse.ArgumentTypeError(f"got {number}, expected at least {least}")
    return number
