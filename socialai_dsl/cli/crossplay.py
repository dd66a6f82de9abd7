"""`socialai crossplay`: everybody with everybody, on a scenario with several seats."""

import argparse
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import TELL_OPTIONS, add_tell, episodes, typed_options
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.model_options import MODEL_OPTIONS, add_options
from socialai_dsl.cli.terminal import columns, json_text
from socialai_dsl.evaluation.crossplay import CrossPlay
from socialai_dsl.runs.crossplay import crossplay
from socialai_dsl.runs.folder import CROSSPLAY

SUMMARY: Final = (
    "let agents, scripts, chance and language models play with each other, everybody with everybody"
)

EXAMPLES: Final = (
    (
        "socialai crossplay oracle random --on together/levers_together --episodes 20",
        "finds who succeeds with whom",
    ),
)
_WIDTH: Final = 100  # characters of a line


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "players",
        nargs="+",
        metavar="PLAYER",
        help="the folder of a run, a checkpoint, shipped:NAME, random, oracle (each seat's own script), llm:MODEL, "
        "rival:NAME, which plays the agent alone, or a person's session of `socialai evaluate human`",
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
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"write {CROSSPLAY} and a picture of the matrices there; `socialai report` takes this folder",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    add_tell(parser)
    add_options(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, and print a matrix for each seat."""
    typed = typed_options(arguments, (*TELL_OPTIONS, *MODEL_OPTIONS))
    found = crossplay(arguments.players, arguments.on, arguments.episodes, out=arguments.out, **typed)
    if arguments.json:
        print(json_text(found.figures()))
        return Exit.GOOD
    print(f"{arguments.on}, {arguments.episodes} test episodes of each pair")
    for seat in found.seats:
        print(f"\nsuccess of {seat}; rows: who plays {found.seats[0]}, columns: who plays the others")
        print("\n".join(_matrix(found, seat)))
    if arguments.out is not None:
        print(f"\nwritten to {arguments.out}")
    return Exit.GOOD


def _matrix(found: CrossPlay, seat: str) -> list[str]:
    """The success of a seat as lines; columns have the numbers of rows where names would take too much room."""
    names, heads = dict(enumerate(found.names)), dict(enumerate(found.names))
    if (max(5, *map(len, found.names)) + 2) * (len(found.others) + 1) > _WIDTH:
        for number, one in enumerate(found.agents, start=1):
            names[one], heads[one] = f"{number} {names[one]}", str(number)
    cells = [["", *(heads[other] for other in found.others)]]
    for one in found.agents:
        pairs = [(one, other) for other in found.others]
        cells.append([names[one], *(_cell(found, pair, seat) for pair in pairs)])
    means = {"with themselves": found.with_themselves(seat), "with others": found.with_others(seat)}
    told = ", ".join(f"{name} {mean}" for name, mean in means.items() if mean is not None)
    return [*columns(cells), f"{told} (95% intervals over rooms)"]


def _cell(found: CrossPlay, pair: tuple[int, int], seat: str) -> str:
    if pair not in found.results:
        return ""
    episodes = f" of {found.results[pair].episodes}" if pair in found.recorded else ""
    return f"{found.rate(pair, seat).success:.2f}{episodes}"
