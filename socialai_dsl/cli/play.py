"""`socialai play`: a person plays a scenario in the terminal."""

import argparse
from typing import Any, Final

from socialai_dsl.cli.arguments import natural
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import printable

SUMMARY: Final = "play a scenario in the terminal"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenario", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    parser.add_argument(
        "--seed",
        type=natural,
        default=0,
        metavar="N",
        help="seed of the first episode (default: 0); later episodes have the next seeds",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play episode after episode until the player quits."""
    from socialai_dsl.play import play

    def episode(number: int) -> tuple[str, dict[str, Any]]:
        seed = arguments.seed + number
        return f"{arguments.scenario}, seed {seed}", {"seed": seed}

    for played in play(arguments.scenario, episode):
        print(printable(str(played)))
    return Exit.GOOD
