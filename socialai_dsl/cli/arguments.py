"""Options that several commands have, and numbers on the command line."""

import argparse
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from socialai_dsl.analysis.effort import Effort
from socialai_dsl.baselines import MOST_EPISODES
from socialai_dsl.errors import UsageError

STYLE: Final[dict[str, Any]] = {
    "choices": ("prose", "grid", "json"),
    "help": "style of the observations (default: prose)",
}
"""The option `--style`: how a language model reads observations."""
SECONDS: Final = 20.0
_LONGEST: Final = 366 * 24 * 3600
_MOST: Final = 10**9
_MOST_AT_ONCE: Final = 1_000
_MOST_ROOMS: Final = 100_000
_SEEDS: Final = 2**63
_SHOWN: Final = 40
"""The most characters of a mistyped number that a message repeats."""
_IDENTIFIER: Final = re.compile(r"\w[\w.-]{0,63}")


TELL_OPTIONS: Final = ("tell", "goal", "language")


def add_tell(parser: argparse.ArgumentParser) -> None:
    """Declare what players are told before the first observation."""
    group = parser.add_argument_group(
        "what is told", "to language models and people; other agents read nothing"
    )
    group.add_argument(
        "--tell",
        choices=("nothing", "instructions", "goal"),
        help="what players are told of the task (default: the scenario's instructions, where it has some)",
    )
    group.add_argument("--goal", metavar="TEXT", help="tell this sentence about the aim")
    group.add_argument(
        "--language",
        metavar="TAG",
        help="language of the instructions, such as de (default: the one written first)",
    )


def typed_options(arguments: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """Which of these options were typed; one that was not is None."""
    given = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in given.items() if value is not None}


def add_effort(parser: argparse.ArgumentParser) -> None:
    """Declare how much is tried, and for how long; what is not given is None."""
    parser.add_argument("--rooms", type=rooms, metavar="N", help=f"number of rooms (default: {Effort.rooms})")
    parser.add_argument(
        "--seconds",
        type=time_limit,
        metavar="S",
        help=f"time limit: N scenarios have N times as much in all; 0 for none (default: {SECONDS:g})",
    )


def limit(arguments: argparse.Namespace) -> float | None:
    """Seconds for a scenario; None is no limit."""
    return SECONDS if arguments.seconds is None else float(arguments.seconds) or None


def refuse(arguments: argparse.Namespace, names: Iterable[str], why: str) -> None:
    """Refuse options that were given and would be ignored.

    Args:
        arguments: what was typed; an option that was not is None, False or an empty list.
        names: of the options, as attributes.
        why: why they do not apply.

    Raises:
        UsageError: one of them was given; the message names it.
    """
    for name in sorted(names):
        value = getattr(arguments, name)
        if value is not None and value is not False and value != []:
            raise UsageError(f"--{name.replace('_', '-')}: {why}")


def positive(text: str) -> int:
    """A whole number of at least 1; `1_000` and `1,000` are 1000."""
    return _whole_number(text, 1, _MOST)


def rooms(text: str) -> int:
    """How many rooms are drawn."""
    return _whole_number(text, 1, _MOST_ROOMS)


def episodes(text: str) -> int:
    """How many test episodes."""
    return _whole_number(text, 1, MOST_EPISODES)


def episode(text: str) -> int:
    """The number of a test episode."""
    return _whole_number(text, 0, MOST_EPISODES - 1)


def at_once(text: str) -> int:
    """How many of something at once."""
    return _whole_number(text, 1, _MOST_AT_ONCE)


def natural(text: str) -> int:
    """A whole number of at least 0."""
    return _whole_number(text, 0, _MOST)


def seed(text: str) -> int:
    """The seed of rooms or draws."""
    return _whole_number(text, 0, _SEEDS - 1)


def port(text: str) -> int:
    """A port; 0 is any that is free."""
    return _whole_number(text, 0, 65_535)


def time_limit(text: str) -> float:
    """Seconds, with a fraction perhaps; 0 is no limit."""
    return _number(text, 0, _LONGEST)


def seconds(text: str) -> float:
    """A time above 0; it may have a fraction."""
    try:
        found = time_limit(text)
    except argparse.ArgumentTypeError:
        found = 0
    if found == 0:
        raise argparse.ArgumentTypeError(
            f"expected a number of seconds above 0, at most {_LONGEST}, got {text[:_SHOWN]!r}"
        )
    return found


def percent(text: str) -> float:
    """A number from 0 to 100."""
    try:
        return _number(text, 0, 100)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected a per cent from 0 to 100") from None


def number_between(least: float, most: float) -> Callable[[str], float]:
    """A number within bounds."""
    return lambda text: _number(text, least, most)


def identifier(text: str) -> str:
    """A word that can be part of a file's name."""
    if not _IDENTIFIER.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"got {_short(text)}, expected letters, digits, `.`, `_` and `-`, at most 64"
        )
    return text


def whole_number(text: str) -> int:
    """A whole number, whose bounds the caller checks; `1_000` and `1,000` are 1000."""
    try:
        return int(text.replace("_", "").replace(",", ""))
    except ValueError:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected a whole number") from None


def _whole_number(text: str, least: int, most: int) -> int:
    found = whole_number(text)
    _require_within(text, found, least, most)
    return found


def _number(text: str, least: float, most: float) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    _require_within(text, found, least, most)
    return found


def _require_within(text: str, found: float, least: float, most: float) -> None:
    if not found >= least:  # so that what is not a number is refused as well
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected at least {least}")
    if found > most:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected at most {most}")


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
