"""The options of a run on the command line."""

import argparse
import json
from collections.abc import Sequence
from reprlib import repr as shortened
from typing import Any, Literal

from socialai_dsl.cli.arguments import add_declared, add_seats, flag, typed_options, whole_number
from socialai_dsl.diagnostics import suggested
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.options import AUTOMATIC
from socialai_dsl.trainer.config import FLAGS, HYPER, RECIPES, RunConfig


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare a flag for each option of `RunConfig` that has one, `--recipe` and `--hyper`."""
    for name in FLAGS:
        field = RunConfig.model_fields[name]
        number = field.annotation is int
        add_declared(
            parser,
            name,
            Literal["auto", "cpu", "cuda"] if name == "device" else field.annotation,
            field.description or "",
            AUTOMATIC.get(name, field.default),
            aliases=["--explo"] if name == "bonus" else [],
            type=whole_number if number else str,
            metavar="N" if number else "NAME",
        )
    parser.add_argument(
        "--recipe",
        choices=tuple(RECIPES),
        help="the way of learning: guided (the scenario's script shows the task first), plain or paper (from "
        "the reward alone) (default: guided if the scenario has a script)",
    )
    add_seats(
        parser,
        "; several for one seat take turns from game to game; the agent learns on all other seats",
        rivals=False,
    )
    parser.add_argument(
        "--hyper",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="any other option of the trainer, such as lr=1e-4 or entropy_coef=0.02 (repeatable)",
    )


def given_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options that were typed, by name."""
    options = typed_options(arguments, (*FLAGS, "recipe")) | _read_hyper(arguments.hyper)
    seats: dict[str, list[str]] = {}
    for seat, player in arguments.seat:
        seats.setdefault(seat, []).append(player)
    return options | ({"seats": seats} if seats else {})


def _read_hyper(given: Sequence[str]) -> dict[str, Any]:
    """Options given as NAME=VALUE, by name; whether their values are possible is `RunConfig`'s to say."""
    found: dict[str, Any] = {}
    for text in given:
        name, equals, written = text.partition("=")
        if not equals or not written:
            raise UsageError(f"--hyper: got {text!r}, expected NAME=VALUE, such as lr=1e-4")
        if name in FLAGS:
            raise UsageError(f"--hyper: {name} has an option of its own, {flag(name)}")
        if name not in HYPER:
            hint = suggested(name, HYPER, f"; expected one of {', '.join(HYPER)}")
            raise UsageError(f"--hyper: got {name!r}{hint}")
        if name in found:
            raise UsageError(f"--hyper: {name} is given twice")
        found[name] = _plain_value(name, written)
    return found


def _plain_value(name: str, written: str) -> bool | int | float | str | None:
    """A number, true, false or null as JSON writes them; else the word itself."""
    try:
        value = json.loads(written)
    except (ValueError, RecursionError):
        return written
    if not isinstance(value, bool | int | float | str | None):
        raise UsageError(
            f"--hyper {name}: got {shortened(written)}, expected a number, a word, true, false or null"
        )
    return value
