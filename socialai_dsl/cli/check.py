"""`socialai check`: what scenarios claim about themselves is tried, and what they contain is played."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.analysis.effort import EPISODES, Effort
from socialai_dsl.atomic import write_json
from socialai_dsl.cli.arguments import (
    add_effort,
    episodes,
    limit,
    percent,
    positive,
    refuse,
    seed,
    typed_options,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import ProgressLine, json_text
from socialai_dsl.runs.folder import DILEMMAS
from socialai_dsl.runs.report import require_libraries

SUMMARY: Final = "test by playing what scenarios claim, and whether everything in them can happen"

EXAMPLES: Final = (
    ("socialai check gate.yaml", "tries what the file claims"),
    (
        "socialai check help --rooms 20 --deep",
        "also measures how long success takes, and how often it is possible without the others",
    ),
)

_OF_PART: Final = {
    "claims": ("deep", "strict", "rooms", "states", "pictures"),
    "coverage": ("agent", "episodes", "fail_under"),
    "script": ("rooms", "states"),
}
"""The options that a part of the check has a use for; those that are in none of these are everybody's."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios",
        nargs="+",
        metavar="SCENARIO",
        help="a path or a name; in a suite every member is checked",
    )
    parser.add_argument(
        "--part",
        action="append",
        choices=tuple(_OF_PART),
        dest="parts",
        help="what to check (repeatable). claims, the default: what the file claims, and whether everything can "
        "be known and can happen. coverage: what happens while agents play. script: which rooms the script of the "
        "scenario solves, and whether the other rooms can be solved",
    )
    parser.add_argument(
        "--deep",
        action="store_true",
        help="for claims: also find the shortest successes, play the script in the same rooms, and measure the success "
        "that is possible without seeing or hearing an NPC",
    )
    add_effort(parser)
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help="seed of the rooms (default: 0)")
    parser.add_argument(
        "--states",
        type=positive,
        metavar="N",
        help=f"for claims and script: give up on a room after N states (default: {Effort.states})",
    )
    parser.add_argument(
        "--agent",
        action="append",
        metavar="AGENT",
        help="for coverage: the agent that plays (repeatable): oracle, random, shipped, a checkpoint or a run folder "
        "(default: random, and oracle where the scenario has a script)",
    )
    parser.add_argument(
        "--episodes",
        type=episodes,
        metavar="N",
        help=f"for coverage: number of episodes of each agent (default: {EPISODES})",
    )
    parser.add_argument(
        "--fail-under",
        type=percent,
        metavar="PERCENT",
        help="for coverage: exit with 1 if less than this share happened",
    )
    parser.add_argument(
        "--pictures",
        type=Path,
        metavar="DIR",
        help="for claims: draw the diagram of each claim `dilemma` there, as PNG and SVG, with its figures, which "
        "`socialai report` takes",
    )
    parser.add_argument("--json", action="store_true", help="print the reports as a JSON array")
    parser.add_argument(
        "--strict", action="store_true", help="for claims: also fail for warnings and for what is undecided"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Check every scenario that was named; what fails is a finding. Ctrl-C ends with what is known."""
    from socialai_dsl.evaluation.checks import Asked, check

    _refuse_what_does_not_apply(arguments)
    if arguments.pictures is not None:
        require_libraries("matplotlib")
    given = typed_options(arguments, ("rooms", "states", "episodes"))
    asked = Asked(
        arguments.scenarios,
        [part for part in _OF_PART if part in (arguments.parts or ["claims"])],
        limit(arguments),
        seed=arguments.seed,
        deep=arguments.deep,
        strict=arguments.strict,
        agents=arguments.agent or (),
        least=arguments.fail_under,
        **given,
    )
    progress = ProgressLine(sys.stderr)
    found = check(asked, progress.show, None if arguments.json else progress.above(sys.stdout))
    progress.clear()
    documents = [result.document for result in found.results]
    if arguments.json:
        print(json_text(documents))
    if arguments.pictures is not None:
        _draw(documents, arguments.pictures)
    if found.interrupted:
        return Exit.INTERRUPTED
    return Exit.FINDINGS if any(result.failed for result in found.results) else Exit.GOOD


def _draw(documents: Sequence[Mapping[str, Any]], folder: Path) -> None:
    from socialai_dsl.reporting.dilemma import dilemmas_of, draw_dilemmas  # it loads Matplotlib

    drawn = draw_dilemmas(documents, folder)
    if drawn:
        write_json(folder / DILEMMAS, dilemmas_of(documents))
    for file in drawn:
        print(f"written to {file}", file=sys.stderr)
    if not drawn:
        print("nothing to draw: no scenario claims to be a dilemma", file=sys.stderr)


def _refuse_what_does_not_apply(arguments: argparse.Namespace) -> None:
    """Refuse, by name, what none of the parts that are asked for would use."""
    parts = arguments.parts or ["claims"]
    used = {name for part in parts for name in _OF_PART[part]}
    idle = {name for names in _OF_PART.values() for name in names} - used
    for name in idle:
        fitting = " or ".join(f"--part {part}" for part, names in _OF_PART.items() if name in names)
        refuse(arguments, [name], f"it is for {fitting}, got --part {' --part '.join(parts)}")
