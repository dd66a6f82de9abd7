"""This module is `socialai check`: what scenarios claim about themselves is tried in rooms that are drawn."""

import argparse
import json
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.check_report import ScenarioReport
from socialai_dsl.cli.errors import Exit, UsageError

if TYPE_CHECKING:
    from socialai_dsl.checking import LoadedScenario
    from socialai_dsl.envs.properties import Effort

SUMMARY: Final = (
    "verify the properties that scenarios claim in `check`, or that everything in them can happen"
)

ROOMS: Final = 200
STATES: Final = 50_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios",
        nargs="+",
        metavar="SCENARIO",
        help="a path or a name; of a suite every member is checked",
    )
    parser.add_argument(
        "--rooms", type=int, default=ROOMS, metavar="N", help=f"rooms to try (default: {ROOMS})"
    )
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
        help="try all there is: the properties, whether everything can happen, how long a success takes, whether the "
        "script succeeds, and what an agent gets that neither sees nor hears the NPCs",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument(
        "--strict", action="store_true", help="what is undecided, and warnings, count as failures too"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Check every scenario that was named; what fails is a finding."""
    for option in ("rooms", "states"):
        if getattr(arguments, option) < 1:
            raise UsageError(f"--{option}: got {getattr(arguments, option)}, expected at least 1")
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    from socialai_dsl.envs.properties import Effort

    effort = Effort(arguments.rooms, arguments.seed, arguments.states)
    reports = []
    for name in arguments.scenarios:
        for scenario, called in scenarios_of(name):
            reports.append(check_scenario(scenario, called, effort, arguments.deep))
            if arguments.format == "text":
                print("\n".join(reports[-1].lines()), flush=True)
    if arguments.format == "json":
        print(json.dumps([report.as_object() for report in reports], indent=2))
    failed = any(report.fails(arguments.strict) for report in reports)
    return Exit.FINDINGS if failed else Exit.GOOD


def check_scenario(
    loaded: "LoadedScenario", called: str, effort: "Effort", deep: bool = False
) -> ScenarioReport:
    """Try what a scenario claims; if it claims nothing, whether everything in it can happen.

    Args:
        loaded: the scenario.
        called: its name, to which `+oracle` can be added.
        effort: how much to try.
        deep: try both, and what success takes.
    """
    from socialai_dsl.envs.coverage import coverage
    from socialai_dsl.envs.depth import depth
    from socialai_dsl.envs.properties import check_property

    scripted = _scripted(loaded, called)
    plans = loaded.checked.properties
    tried = tuple((plan, check_property(loaded, plan, effort, scripted)) for plan in plans)
    happening = coverage(loaded, effort, scripted) if deep or not plans else None
    success = depth(loaded, effort, scripted) if deep else None
    place = loaded.resolved.key_span(("outcome",))
    return ScenarioReport(called, effort.rooms, effort.seed, tried, happening, success, place)


def scenarios_of(name: str) -> "list[tuple[LoadedScenario, str]]":
    """The scenario of a name, or the members of a suite, each with its own."""
    from socialai_dsl.checking import LoadedSuite
    from socialai_dsl.frontend import load

    loaded = load(name)
    if isinstance(loaded, LoadedSuite):
        return list({member.name: (member, member.name) for member in loaded.members}.values())
    return [(loaded, name)]


def _scripted(loaded: "LoadedScenario", called: str) -> "LoadedScenario | None":
    """The scenario with a frame for the agent: itself, or its variant `oracle`; None without either."""
    from socialai_dsl.checking import LoadedScenario
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
