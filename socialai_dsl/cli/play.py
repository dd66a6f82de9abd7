"""`socialai play`: a person plays a scenario in the terminal."""

import argparse
import os
import sys
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.arguments import natural
from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.diagnostics import printable

if TYPE_CHECKING:
    from socialai_dsl.cli.play_app import Episodes
    from socialai_dsl.cli.play_game import Played

SUMMARY: Final = "play a scenario yourself, from the keyboard"


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
        help="of the first episode (default: 0); the next ones have the next seeds",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play episode after episode until the player quits."""

    def episode(number: int) -> tuple[str, dict[str, Any]]:
        seed = arguments.seed + number
        return f"{arguments.scenario}, seed {seed}", {"seed": seed}

    for played in play(arguments.scenario, episode):
        print(printable(str(played)))
    return Exit.GOOD


def play(scenario: str, episodes: "Episodes", practice: bool = True) -> "list[Played]":
    """Let a person play at the terminal; the episodes that ended.

    Args:
        scenario: a path or a name.
        episodes: which ones.
        practice: whether steps may be taken back and the like.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: there is no terminal.
    """
    _require_terminal()
    from socialai_dsl.cli.play_app import PlayApp
    from socialai_dsl.cli.play_game import Game

    game = Game(scenario)
    try:
        first = episodes(0)
        assert first is not None, "internal: there is at least one episode to play"
        game.begin(*first)
        app = PlayApp(game, episodes, practice)
        done = app.run() or []
        if app.failure is not None:
            raise app.failure
        return done
    finally:
        game.close()


def _require_terminal() -> None:
    """Say so where nobody could see or type anything.

    Raises:
        UsageError: standard input, output or error output is no terminal, or one that shows lines only.
    """
    streams = {"input": sys.stdin, "output": sys.stdout, "error output": sys.stderr}
    for name, stream in streams.items():
        if not stream.isatty():
            raise UsageError(
                f"playing needs a terminal, and standard {name} is none; "
                "`socialai trace SCENARIO --do forward --do ...` plays given steps without one"
            )
    if os.environ.get("TERM", "dumb") in ("dumb", "unknown"):
        raise UsageError(
            f"playing needs a terminal that can move its cursor; TERM is {os.environ.get('TERM')!r}"
        )
