"""`socialai replay`: writes a page that shows episodes step by step."""

import argparse
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import episode, episodes, positive
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import counted
from socialai_dsl.runs.folder import REPLAY
from socialai_dsl.runs.replay import PLAYED, REPLAYED, replay

SUMMARY: Final = "write a web page to watch episodes step by step, with rules and reasons"

EXAMPLES: Final = (
    ("socialai replay shipped:help --record 1", "shows episodes of a trained agent"),
    ("socialai replay gate.yaml --agent oracle --episodes 2", "shows two episodes of the script"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "source",
        metavar="RUN|SCENARIO|TRACES",
        help="the folder of a run, shipped:NAME, the path or name of a scenario, or traces written by `--out "
        "episodes.json` or `socialai trace --json`",
    )
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path(REPLAY),
        metavar="FILE",
        help=f"file of the page (default: {REPLAY}); a name that ends in .json gets the traces instead",
    )
    parser.add_argument(
        "--agent",
        metavar="AGENT",
        help="the agent that plays a scenario: oracle, random, shipped, or a run's folder (default: oracle if "
        "there is one, else random)",
    )
    parser.add_argument(
        "--episodes",
        type=episodes,
        metavar="N",
        help=f"number of test episodes to play (default: {PLAYED})",
    )
    parser.add_argument(
        "--record",
        type=positive,
        metavar="N",
        help=f"keep up to N successes and N failures (default: {REPLAYED})",
    )
    parser.add_argument(
        "--test-episode",
        type=episode,
        action="append",
        metavar="N",
        help="keep only test episode N (repeatable)",
    )
    parser.add_argument(
        "--greedy",
        action="store_true",
        help="take the most probable action of a trained agent (default: sample)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, trace, write."""
    traces = replay(
        arguments.source,
        arguments.out,
        agent=arguments.agent,
        episodes=arguments.episodes,
        record=arguments.record,
        test_episodes=arguments.test_episode,
        greedy=arguments.greedy,
    )
    print(f"{counted(len(traces), 'episode')} written to {arguments.out}")
    return Exit.GOOD
