"""`socialai play`: a person plays a scenario in the terminal."""

import argparse
import sys
from pathlib import Path
from typing import Any, Final

import socialai_dsl
from socialai_dsl.checking.briefing import brief
from socialai_dsl.cli.arguments import (
    TELL_OPTIONS,
    add_participant,
    add_scenario,
    add_tell,
    seed,
    typed_options,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import printable
from socialai_dsl.episodes.players import HUMAN_FOLDER, session_folder
from socialai_dsl.runs.folder import scenario_folder_name

SUMMARY: Final = "play a scenario in the terminal"


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
    add_participant(parser)
    parser.add_argument(
        "--view",
        choices=("room", "seat"),
        default="room",
        help="show the whole room (default), or what the agent sees and nothing else",
    )
    add_tell(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Play episode after episode until the player quits."""
    from socialai_dsl.play import play

    briefing = brief(socialai_dsl.load(arguments.scenario), **typed_options(arguments, TELL_OPTIONS))
    name = scenario_folder_name(arguments.scenario)
    session = session_folder(arguments.out, arguments.participant)

    def episode(number: int) -> tuple[str, dict[str, Any]]:
        own = arguments.seed + number
        return f"{name}, seed {own}", {"seed": own}

    about = {"session": session.name, "scenario": name}
    for played in play(arguments.scenario, episode, session / name, about, briefing, arguments.view):
        print(printable(str(played)))
    print(f"every step is in {session / name}", file=sys.stderr)
    return Exit.GOOD
