"""`socialai check`: tries the claims of scenarios in drawn rooms."""

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.check_report import ScenarioReport
from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.terminal import ProgressLine

if TYPE_CHECKING:
    from socialai_dsl.analysis.effort import Effort
    from socialai_dsl.checking.loaded import LoadedScenario

SUMMARY: Final = "verify what scenarios claim in `check`, and that everything in them can happen and be known"

ROOMS: Final = 100
STATES: Final = 50_000
SECONDS: Final = 20.0

Say = Callable[[str], None]
"""Takes a line of the report."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios",
        nargs="+",
        metavar="SCENARIO",
        help="a path or a name; of a suite every member is checked",
    )
    add_effort(parser)
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the rooms (default: 0)")
    parser.add_argument(
        "--states",
        type=int,
        default=STATES,
        metavar="N",
        help=f"how many states of a room are searched before it is undecided (default: {STATES})",
    )
    parser.add_argument(
        "--deep",
        action="store_true",
        help="also tell how long a success takes, whether the script succeeds, and what an agent gets that neither "
        "sees nor hears the NPCs",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument(
        "--strict", action="store_true", help="what is undecided, and warnings, count as failures too"
    )


def add_effort(parser: argparse.ArgumentParser) -> None:
    """Declare how much is tried, and for how long."""
    parser.add_argument(
        "--rooms", type=int, default=ROOMS, metavar="N", help=f"rooms to try (default: {ROOMS})"
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=SECONDS,
        metavar="S",
        help=f"how long to try each scenario; 0 takes as long as it needs (default: {SECONDS:g})",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Check every scenario that was named; what fails is a finding. Ctrl-C ends with what is known."""
    check_effort(arguments)
    if arguments.states < 1:
        raise UsageError(f"--states: got {arguments.states}, expected at least 1")
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    from socialai_dsl.analysis.effort import Clock, Effort

    progress = ProgressLine(sys.stderr)
    reports: list[ScenarioReport] = []
    say = progress.above(sys.stdout) if arguments.format == "text" else None
    for scenario, called in (pair for name in arguments.scenarios for pair in scenarios_of(name)):
        clock = Clock(arguments.seconds or None, progress.show)
        effort = Effort(arguments.rooms, arguments.seed, arguments.states, clock)
        reports.append(check_scenario(scenario, called, effort, arguments.deep, say))
        if clock.interrupted:
            break
    progress.clear()
    if arguments.format == "json":
        print(json.dumps([report.as_object() for report in reports], indent=2))
    if any(report.interrupted for report in reports):
        return Exit.INTERRUPTED
    failed = any(report.fails(arguments.strict) for report in reports)
    return Exit.FINDINGS if failed else Exit.GOOD


def check_effort(arguments: argparse.Namespace) -> None:
    """Raise UsageError for numbers of rooms or seconds that make no sense."""
    if arguments.rooms < 1:
        raise UsageError(f"--rooms: got {arguments.rooms}, expected at least 1")
    if not 0 <= arguments.seconds < float("inf"):
        raise UsageError(f"--seconds: got {arguments.seconds:g}, expected at least 0")


def check_scenario(
    loaded: "LoadedScenario", called: str, effort: "Effort", deep: bool = False, say: Say | None = None
) -> ScenarioReport:
    """Try what a scenario claims, whether it can be known, and whether everything in it can happen.

    Args:
        loaded: the scenario.
        called: its name, to which `+oracle` can be added.
        effort: how much to try, and for how long.
        deep: also try what success takes.
        say: takes the lines of the report as they come.
    """
    from socialai_dsl.analysis.coverage import coverage
    from socialai_dsl.analysis.depth import depth
    from socialai_dsl.analysis.properties import Trial, by_default

    place = loaded.resolved.key_span(("outcome",))
    report = ScenarioReport(called, effort.rooms, effort.seed, place)
    said = 0

    def part(tasks: int) -> "Effort":
        return replace(effort, clock=effort.clock.part(tasks))

    def tell() -> None:
        nonlocal said
        lines = list(report.lines())
        for line in lines[said:] if say is not None else ():
            say(line)  # type: ignore[misc]
        said = len(lines)

    tell()
    try:
        scripted = _scripted(loaded, called)
        trial = Trial(loaded, effort, scripted)
        plans = by_default(loaded, place)
        for number, plan in enumerate(plans):
            found = trial.check(plan, part(len(plans) - number + 1 + 2 * deep))
            report.tried += ((plan, found),)
            tell()
            if effort.clock.interrupted:
                break
        if not effort.clock.interrupted:
            report.coverage = coverage(loaded, part(1 + 2 * deep), scripted)
            tell()
        if deep and not effort.clock.interrupted:
            report.depth = depth(trial, part(1))
            tell()
    except KeyboardInterrupt:
        effort.clock.interrupt()
    report.interrupted, report.in_time = effort.clock.interrupted, not effort.clock.is_over
    report.complete = True
    tell()
    return report


def scenarios_of(name: str) -> "list[tuple[LoadedScenario, str]]":
    """The scenario of a name, or the members of a suite, each with its own."""
    from socialai_dsl.checking.loaded import LoadedSuite
    from socialai_dsl.frontend import load

    loaded = load(name)
    if isinstance(loaded, LoadedSuite):
        return list({member.name: (member, member.name) for member in loaded.members}.values())
    return [(loaded, name)]


def _scripted(loaded: "LoadedScenario", called: str) -> "LoadedScenario | None":
    """The scenario with a frame for the agent: itself, or its variant `oracle`; None without either."""
    from socialai_dsl.checking.loaded import LoadedScenario
    from socialai_dsl.diagnostics import ScenarioError
    from socialai_dsl.frontend import load

    if any(frame.entity == 0 for frame in loaded.checked.frames):
        return loaded
    base, mark, parameters = called.partition("?")
    try:
        scripted = load(f"{base}+oracle{mark}{parameters}")
    except ScenarioError as error:
        if any(diagnostic.code not in _UNKNOWN for diagnostic in error.diagnostics):
            raise
        return None
    return scripted if isinstance(scripted, LoadedScenario) else None


_UNKNOWN: Final[frozenset[Any]] = frozenset({"S503", "S504", "S508"})
"""Codes of names that do not exist; a member of a suite may have no name of its own."""
