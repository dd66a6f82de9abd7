"""`socialai play`: a person plays a scenario in the terminal."""

import argparse
import sys
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import (
    TELL_OPTIONS,
    add_participant,
    add_scenario,
    add_seats,
    add_tell,
    seed,
    typed_options,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import printable
from socialai_dsl.episodes.players import HUMAN_FOLDER

SUMMARY: Final = "play a scenario in the terminal"

EXAMPLES: Final = (
    ("socialai play talkitout", "shows the whole room, and takes keys"),
    ("socialai play help --view seat", "shows only what the agent sees"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser)
    parser.add_argument(
        "--seed",
        type=seed,
        default=0,
        metavar="N",
        help="seed of the first episode (default: 0); later episodes have the next seeds",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=HUMAN_FOLDER,
        metavar="DIR",
        help=f"folder that gets a folder of this session with every step (default: {HUMAN_FOLDER})",
    )
    add_seats(parser)
    add_participant(parser)
    parser.add_argument(
        "--view",
        choices=("room", "seat"),
        default="room",
        help="show the whole room (default), or what is seen from the seat and nothing else",
    )
    add_tell(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Play episode after episode until the player quits."""
    from socialai_dsl.evaluation.people import play_seed

    told = typed_options(arguments, TELL_OPTIONS)
    asked = arguments.scenario, arguments.seed, arguments.out, arguments.participant, arguments.view
    played, folder = play_seed(*asked, arguments.seat, **told)
    for episode in played:
        print(printable(str(episode)))
    print(f"every step is in {folder}", file=sys.stderr)
    return Exit.GOOD
