"""`socialai check`: what scenarios claim about themselves is tried, and what they contain is played."""

import argparse
import sys
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.arguments import ROOMS, add_effort, episodes, limit, percent, positive, refuse, seed
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import ProgressLine, json_text

if TYPE_CHECKING:
    from socialai_dsl.analysis.effort import Clock
    from socialai_dsl.checking.loaded import LoadedScenario

SUMMARY: Final = "test by playing what scenarios claim, and whether everything in them can happen"

STATES: Final = 50_000
EPISODES: Final = 200
PARTS: Final = ("claims", "coverage", "script")


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
        choices=PARTS,
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
        help=f"for claims and script: give up on a room after N states (default: {STATES})",
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
    parser.add_argument("--json", action="store_true", help="print the reports as a JSON array")
    parser.add_argument(
        "--strict", action="store_true", help="for claims: also fail for warnings and for what is undecided"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Check every scenario that was named; what fails is a finding. Ctrl-C ends with what is known."""
    from socialai_dsl.analysis.check import scenarios_of
    from socialai_dsl.analysis.effort import Clock
    from socialai_dsl.engine.jit import load
    from socialai_dsl.engine.kernel import serve

    _refuse_what_does_not_apply(arguments)
    progress = ProgressLine(sys.stderr)
    parts = [part for part in PARTS if part in (arguments.parts or ["claims"])]
    scenarios = [pair for name in arguments.scenarios for pair in scenarios_of(name)]
    # Before the time begins: where the engine is not compiled yet, that takes longer than most checks.
    load(serve)
    clock = Clock(limit(arguments) * len(scenarios) or None, progress.show)
    documents: list[dict[str, Any]] = []
    ends = [Exit.GOOD]
    for left, part in zip(range(len(parts), 0, -1), parts, strict=True):
        own = clock.part(left)
        if part == "claims":
            ends.append(_claims(arguments, scenarios, own, progress, documents))
        else:
            ends.append((_coverage if part == "coverage" else _scripts)(arguments, own, progress, documents))
        if clock.interrupted:
            ends.append(Exit.INTERRUPTED)
            break
    progress.clear()
    if arguments.json:
        print(json_text(documents))
    return max(ends)


_OF_PART: Final = {
    "claims": ("deep", "strict", "rooms", "states"),
    "coverage": ("agent", "episodes", "fail_under"),
    "script": ("rooms", "states"),
}
"""The options that a part of the check has a use for; those that are in none of these are everybody's."""


def _refuse_what_does_not_apply(arguments: argparse.Namespace) -> None:
    """Refuse, by name, what none of the parts that are asked for would use."""
    parts = arguments.parts or ["claims"]
    used = {name for part in parts for name in _OF_PART[part]}
    idle = {name for names in _OF_PART.values() for name in names} - used
    for name in idle:
        fitting = " or ".join(f"--part {part}" for part, names in _OF_PART.items() if name in names)
        refuse(arguments, [name], f"it is for {fitting}, got --part {' --part '.join(parts)}")


def _claims(
    arguments: argparse.Namespace,
    scenarios: "list[tuple[LoadedScenario, str]]",
    clock: "Clock",
    progress: ProgressLine,
    documents: list[dict[str, Any]],
) -> Exit:
    from socialai_dsl.analysis.check import check_scenario
    from socialai_dsl.analysis.effort import Effort

    say = None if arguments.json else progress.above(sys.stdout)
    end = Exit.GOOD
    for number, (scenario, called) in enumerate(scenarios):
        own = clock.part(len(scenarios) - number)
        effort = Effort(arguments.rooms or ROOMS, arguments.seed, arguments.states or STATES, own)
        report = check_scenario(scenario, called, effort, arguments.deep, say)
        documents.append(report.as_object())
        if report.fails(arguments.strict):
            end = Exit.FINDINGS
        if clock.interrupted:
            break
    return end


def _coverage(
    arguments: argparse.Namespace, clock: "Clock", progress: ProgressLine, documents: list[dict[str, Any]]
) -> Exit:
    from socialai_dsl.evaluation import coverage

    found = coverage(
        arguments.scenarios, arguments.agent or (), arguments.episodes or EPISODES, arguments.seed, clock
    )
    documents.append(found.as_object())
    if not arguments.json:
        progress.above(sys.stdout)("\n".join(found.lines()))
    least = arguments.fail_under
    return Exit.FINDINGS if least is not None and found.percent < least else Exit.GOOD


def _scripts(
    arguments: argparse.Namespace, clock: "Clock", progress: ProgressLine, documents: list[dict[str, Any]]
) -> Exit:
    """A room that can be solved and was not is a finding."""
    from socialai_dsl.evaluation import play_script

    end = Exit.GOOD
    for number, name in enumerate(arguments.scenarios):
        own = clock.part(len(arguments.scenarios) - number)
        found = play_script(name, arguments.rooms or ROOMS, arguments.seed, arguments.states or STATES, own)
        documents.append(found.as_object())
        if not arguments.json:
            progress.above(sys.stdout)("\n".join(found.lines()))
        if found.found("solvable"):
            end = Exit.FINDINGS
        if clock.interrupted:
            break
    return end
