"""`socialai words`: what each seat says in which situation, and how much that tells of it."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import add_seats, episodes
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import columns, json_text
from socialai_dsl.diagnostics import printable
from socialai_dsl.errors import OptionError
from socialai_dsl.evaluation.words import MOST_VALUES, SeatWords, Situation
from socialai_dsl.runs.folder import WORDS
from socialai_dsl.runs.words import words

SUMMARY: Final = "find what players say in which situation, and how much that tells of it"

EXAMPLES: Final = (
    (
        "socialai words oracle --on together/reference_game_together --episodes 20",
        "finds what the words of the scripts mean",
    ),
)
_TABLES: Final = 4
"""Situations that have a table, of those that are told most of."""
_MOST: Final = 8
"""Messages that have a column of their own."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "player",
        metavar="PLAYER",
        help="the folder of a run, a checkpoint, shipped:NAME, random, or oracle (each seat's own script)",
    )
    parser.add_argument("--on", required=True, metavar="SCENARIO", help="the scenario to play")
    parser.add_argument(
        "--episodes", type=episodes, default=500, metavar="N", help="number of test episodes (default: 500)"
    )
    add_seats(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"write {WORDS} there; `socialai report` takes this folder"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, and print what each seat says."""
    seats = dict(arguments.seat)
    if len(seats) < len(arguments.seat):
        raise OptionError("seat", "got two players for one of them, expected one")
    found = words(arguments.player, arguments.on, arguments.episodes, seats=seats, out=arguments.out)
    if arguments.json:
        print(json_text(found.figures()))
        return Exit.GOOD
    print(f"{arguments.on}, {found.episodes} test episodes")
    for seat, said in found.seats.items():
        print("", *map(printable, _seat(seat, said)), sep="\n")
    if found.left_out:
        print(f"\nleft out, with more than {MOST_VALUES} values: {', '.join(found.left_out)}")
    if arguments.out is not None:
        print(f"\nwritten to {arguments.out}")
    return Exit.GOOD


def _seat(seat: str, found: SeatWords) -> Iterator[str]:
    yield (
        f"{seat}, played by {found.player}: success {found.success:.2f}, speaks in {found.spoke:.0%} of the "
        f"episodes, {found.utterances:.1f} times in each"
    )
    if len(found.messages) == 1:
        yield f"  says the same everywhere: {next(iter(found.messages))}"
        return
    most = list(found.messages.items())[:_MOST]
    yield f"  says {', '.join(f'{text} ({share:.0%})' for text, share in most)}"
    told = [one for one in found.situations if one.more_than_chance]
    for one in told[:_TABLES]:
        yield from ("", *(f"  {line}" for line in _table(one, list(found.messages))))
    if told[_TABLES:]:
        yield from ("", *(f"  {_figures(one)}" for one in told[_TABLES:]))
    untold = [one.name for one in found.situations if not one.more_than_chance]
    if untold:
        yield ""
        yield f"  tells no more than by chance about {', '.join(untold)}"
    if found.topographic is not None:
        similarity, p = found.topographic
        yield ""
        yield f"  similar situations get similar messages: topographic similarity {similarity:.2f} (p {p:.3f})"


def _table(situation: Situation, messages: list[str]) -> Iterator[str]:
    """The share of each message where something has a value, and how much it is told of."""
    shown, rest = messages[:_MOST], messages[_MOST:]
    rows = [[situation.name, *shown, *(["others"] if rest else [])]]
    for value, said in situation.said.items():
        counts = [said.get(text, 0.0) for text in shown]
        counts += [sum(said.get(text, 0.0) for text in rest)] if rest else []
        total = sum(said.values())
        rows.append([value, *(f"{count / total:.2f}" if total else "-" for count in counts)])
    yield _figures(situation)
    yield from columns(rows)


def _figures(situation: Situation) -> str:
    told = situation.told
    assert told is not None, "internal: it is told of"
    names = " = ".join((situation.name, *situation.same))
    return f"{names}: {told.bits:.2f} of {told.possible:.2f} bits (chance {told.chance:.2f}, p {told.p:.3f})"
