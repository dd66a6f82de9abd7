"""`socialai crossplay`: everybody with everybody, on a scenario with several seats."""

import argparse
from pathlib import Path
from typing import Final

from socialai_dsl.atomic import write_json
from socialai_dsl.cli.arguments import episodes
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.episodes.players import require_trainer
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.crossplay import cross_play, matrix_lines
from socialai_dsl.frontend import load
from socialai_dsl.runs.evaluate import made_player

SUMMARY: Final = "let trained agents, scripts and chance play with each other, everybody with everybody"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "players",
        nargs="+",
        metavar="PLAYER",
        help="the folder of a run, a checkpoint, shipped:NAME, random, or oracle (each seat's own script)",
    )
    parser.add_argument(
        "--on", required=True, metavar="SCENARIO", help="the scenario to play, with several seats"
    )
    parser.add_argument(
        "--episodes",
        type=episodes,
        default=100,
        metavar="N",
        help="number of test episodes of each pair (default: 100)",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the figures there, as JSON")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, and print a matrix for each seat."""
    players = [made_player(name, [arguments.on], {}, None) for name in arguments.players]
    if any(player.is_model or player.is_person for player in players):
        raise UsageError(
            "crossplay: got a language model or a person; expected random, oracle, a run or a checkpoint"
        )
    if any(player.is_trained for player in players):
        require_trainer()
    found = cross_play(players, arguments.on, load(arguments.on), arguments.episodes)
    if arguments.out is not None:
        write_json(arguments.out, found.figures())
    if arguments.json:
        print(json_text(found.figures()))
        return Exit.GOOD
    print(f"{arguments.on}, {arguments.episodes} test episodes of each pair")
    for seat in found.seats:
        print(f"\nsuccess of {seat}; rows: who plays {found.seats[0]}, columns: who plays the others")
        print("\n".join(matrix_lines(found, seat)))
    return Exit.GOOD
