"""`socialai trace`: one episode step by step, with the rules that fired and why others did not."""

import argparse
import sys
from typing import Any, Final

from socialai_dsl.cli.arguments import (
    add_scenario,
    add_seats,
    episode,
    known_room,
    natural,
    positive,
    refuse,
    seed,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import shows_color
from socialai_dsl.cli.trace_text import Steps, Text
from socialai_dsl.episodes.traces import TracedEpisode, reset_of
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.saved_tests import TakenDialogue, save_test
from socialai_dsl.loader.reader import display_name

SUMMARY: Final = "print one episode step by step: the rules that fired, and why the others did not"

EXAMPLES: Final = (
    ("socialai trace talkitout", "shows the script in the first room"),
    (
        "socialai trace dance --agent shipped --test-episode 3",
        "shows what the trained agent does in a test episode",
    ),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser)
    parser.add_argument(
        "--seed",
        type=seed,
        metavar="N",
        help="seed of the episode (default: 0), and of an agent that samples",
    )
    parser.add_argument(
        "--test-episode", type=episode, metavar="N", help="play episode N of the test set instead of a seed"
    )
    parser.add_argument(
        "--index",
        type=natural,
        metavar="N",
        help="play room N of the seed, counted from 0, as `check` and `validate` number rooms (default: 0)",
    )
    parser.add_argument(
        "--layout",
        type=known_room,
        metavar="FILE",
        help="start in the room that this file, or text, describes, in JSON or YAML (docs/layouts.md)",
    )
    played = parser.add_mutually_exclusive_group()
    played.add_argument(
        "--agent",
        metavar="AGENT",
        help="the agent: oracle, random, shipped, or a checkpoint or run folder (default: oracle if there is "
        "one, else random)",
    )
    played.add_argument(
        "--do",
        action="append",
        metavar="LINE",
        help="the agent's next action, typed as in `socialai play` (repeatable, once for each step)",
    )
    add_seats(parser)
    parser.add_argument("--steps", type=positive, metavar="N", help="show at most N steps")
    parser.add_argument(
        "--from", type=positive, default=1, metavar="K", dest="first", help="start with step K"
    )
    parser.add_argument(
        "--why",
        action="append",
        default=[],
        metavar="NAME",
        help="show only the rules of this member of the cast, of `world` or of `outcome`, with every reason",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print the trace as JSON, in the format that `socialai replay` reads and writes, with every rule and "
        "reason",
    )
    parser.add_argument(
        "--save-test",
        metavar="NAME",
        help="write what was played as a test of this name into the file beside the scenario, `SCENARIO.tests.yaml`; "
        "of a scenario that ships it is printed",
    )
    parser.add_argument("--force", action="store_true", help="for --save-test: replace a test of this name")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play the episode and print it."""
    if arguments.test_episode is not None and arguments.do is not None:
        refuse(arguments, ("seed",), "--test-episode says which room it is, and --do what is done there")
    drawn = arguments.seed or 0
    reset = reset_of(drawn, arguments.index, arguments.test_episode, arguments.layout)
    if arguments.json and (arguments.why or arguments.first > 1):
        raise UsageError("--json: got --why or --from with it, but the document has every step and rule")
    if arguments.save_test is None:
        refuse(arguments, ("force",), "it is for --save-test")
    taken = TakenDialogue()
    watching = [] if arguments.save_test is None else [taken]
    played = TracedEpisode(arguments.scenario, arguments.agent, arguments.do, drawn, arguments.seat)
    try:
        played.require_names(arguments.why)
        last = None if arguments.steps is None else arguments.first + arguments.steps - 1
        if arguments.json:
            steps = Steps()
            played.play(reset, [steps, *watching], lambda: steps.t == last)
            print(played.document().as_json())
        else:
            text = Text(played, arguments.why, shows_color(sys.stdout), arguments.first)
            played.play(reset, [text, *watching], lambda: text.t == last)
            print("\n".join(text.end()))
    finally:
        played.close()
    if arguments.save_test is not None:
        _save(taken, arguments, reset)
    return Exit.GOOD


def _save(taken: TakenDialogue, arguments: argparse.Namespace, reset: dict[str, Any]) -> None:
    """Save the episode as a test; where it went is no part of the trace."""
    saved = save_test(taken, arguments.scenario, reset, arguments.save_test, arguments.force)
    if saved.beside is None:
        print(f"\n{saved.entry}", end="", file=sys.stderr if arguments.json else sys.stdout)
    else:
        print(f"wrote the test `{arguments.save_test}` into {display_name(saved.beside)}", file=sys.stderr)
