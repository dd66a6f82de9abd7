"""Options that several commands have, and numbers on the command line."""

import argparse
import contextlib
import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

from socialai_dsl.analysis.effort import Effort
from socialai_dsl.baselines import MOST_EPISODES
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source

SECONDS: Final = 20.0
_LONGEST: Final = 366 * 24 * 3600
_MOST: Final = 10**9
_MOST_AT_ONCE: Final = 1_000
_MOST_ROOMS: Final = 100_000
_SEEDS: Final = 2**63
_SHOWN: Final = 40
"""The most characters of a mistyped number that a message repeats."""
_Number = TypeVar("_Number", int, float)
_IDENTIFIER: Final = re.compile(r"\w[\w.-]{0,63}")


TELL_OPTIONS: Final = ("tell", "goal", "language")


def flag(name: str) -> str:
    """`max_tokens` as `--max-tokens`."""
    return f"--{name.replace('_', '-')}"


def add_declared(
    parser: argparse._ActionsContainer, name: str, annotation: Any, about: str, default: Any, **more: Any
) -> None:
    """Declare the option of a field; one that is not typed is None.

    Args:
        parser: gets it.
        name: of the field.
        annotation: its type: of a `bool` the option is a switch, a `Literal` has the words to choose from.
        about: what it means; unless it says so itself, the default is added.
        default: where the field has another than None.
        more: what argparse is told besides.
    """
    words = tuple(word for word in get_args(annotation) if isinstance(word, str))
    if annotation is bool:
        more |= {"action": "store_true", "default": None}
    elif words:
        more |= {"choices": words, "metavar": None}
    if annotation is not bool and default not in (None, "none") and "(default)" not in about:
        about += f" (default: {format(default, 'g') if isinstance(default, float) else default})"
    aliases = more.pop("aliases", ())
    parser.add_argument(flag(name), *aliases, dest=name, help=about.replace("%", "%%"), **more)


def add_scenario(parser: argparse.ArgumentParser, more: str = "", **options: Any) -> None:
    """Declare the scenario that a command is about."""
    parser.add_argument(
        "scenario",
        metavar="SCENARIO",
        help=f"a path or a name, with +variants and ?parameters{more}",
        **options,
    )


def add_participant(parser: argparse.ArgumentParser, whose: str = "") -> None:
    """Declare the word that begins the name of a person's session."""
    parser.add_argument(
        "--participant",
        type=identifier,
        metavar="ID",
        help=f"{whose}begins the name of the session's folder (default: the time alone)",
    )


def add_seats(
    parser: argparse.ArgumentParser,
    more: str = "; the player gets all other seats, a person, a model or a rival only the first of them",
    models: bool = False,
    rivals: bool = True,
) -> None:
    """Declare who sits on other seats than the one who plays; `models`: also language models; `rivals`: also them."""
    players = ["script", "random", "nobody", "a run", "a checkpoint", "shipped:NAME"]
    players += ["llm:MODEL"] * models + ["rival:NAME on the agent's seat"] * rivals
    parser.add_argument(
        "--seat",
        action="append",
        type=seat_and_player,
        default=[],
        metavar="NAME=PLAYER",
        help=f"who plays a member of the cast with a seat: {', '.join(players[:-1])} or {players[-1]} "
        f"(repeatable){more}",
    )


def seat_and_player(text: str) -> tuple[str, str]:
    """`helper=runs/x` as a pair."""
    seat, equals, player = text.partition("=")
    if not (seat and equals and player):
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected NAME=PLAYER, such as helper=script")
    return seat, player


def add_tell(parser: argparse.ArgumentParser) -> None:
    """Declare what players are told before the first observation."""
    group = parser.add_argument_group(
        "instructions", "for language models and people; other agents do not read any"
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
            raise UsageError(f"{flag(name)}: {why}")


def whole_number(text: str) -> int:
    """A whole number, whose bounds the caller checks; `1_000` and `1,000` are 1000."""
    try:
        return int(text.replace("_", "").replace(",", ""))
    except ValueError:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected a whole number") from None


def whole_between(least: int, most: int) -> Callable[[str], int]:
    """Whole numbers within bounds, as `type` of an option."""
    return lambda text: _within(text, whole_number(text), least, most)


def number_between(least: float, most: float) -> Callable[[str], float]:
    """Numbers within bounds, as `type` of an option."""
    return lambda text: _within(text, _number(text), least, most)


positive: Final = whole_between(1, _MOST)
natural: Final = whole_between(0, _MOST)
rooms: Final = whole_between(1, _MOST_ROOMS)
at_once: Final = whole_between(1, _MOST_AT_ONCE)
seed: Final = whole_between(0, _SEEDS - 1)
port: Final = whole_between(0, 65_535)
episodes: Final = whole_between(1, MOST_EPISODES)
"""How many test episodes."""
episode: Final = whole_between(0, MOST_EPISODES - 1)
"""The number of a test episode."""
time_limit: Final = number_between(0, _LONGEST)
"""Seconds; 0 is no limit."""


def seconds(text: str) -> float:
    """A time above 0; it may have a fraction."""
    found = _number(text)
    if not 0 < found <= _LONGEST:
        raise argparse.ArgumentTypeError(
            f"expected a number of seconds above 0, at most {_LONGEST}, got {text[:_SHOWN]!r}"
        )
    return found


def percent(text: str) -> float:
    """A number from 0 to 100."""
    found = _number(text)
    if not 0 <= found <= 100:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected a per cent from 0 to 100")
    return found


def known_room(text: str) -> Path | dict[str, Any]:
    """A layout, or the file with one."""
    if not text.lstrip().startswith("{"):
        return Path(text)
    with contextlib.suppress(ValueError, RecursionError):
        return dict(json.loads(text))
    try:
        return dict(read_document(Source("layout", text)).data)  # type: ignore[arg-type]
    except ScenarioError as error:
        why = error.diagnostics[0].text
        raise argparse.ArgumentTypeError(
            f"got {_short(text)}, which is neither JSON nor YAML: {why}"
        ) from None


def identifier(text: str) -> str:
    """A word that can be part of a file's name."""
    if not _IDENTIFIER.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"got {_short(text)}, expected letters, digits, `.`, `_` and `-`, at most 64"
        )
    return text


def _number(text: str) -> float:
    """A number; what is none is not a number, which lies within no bounds."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _within(text: str, found: _Number, least: float, most: float) -> _Number:
    if not found >= least:  # so that what is not a number is refused as well
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected at least {least}")
    if found > most:
        raise argparse.ArgumentTypeError(f"got {_short(text)}, expected at most {most}")
    return found


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
