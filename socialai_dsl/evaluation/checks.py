"""The checks of `socialai check`: claims are tried, what scenarios contain is played, scripts are put to the test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from socialai_dsl.analysis.check import Case, Say, check_scenario, compile_engine, scenarios_of
from socialai_dsl.analysis.effort import EPISODES, Clock, Effort, Tell
from socialai_dsl.evaluation.coverage_report import coverage
from socialai_dsl.evaluation.scripts import play_script


@dataclass(frozen=True)
class Asked:
    """What is checked, and how much is tried.

    Attributes:
        scenarios: paths or names; in a suite every member is checked.
        parts: `claims`, `coverage` and `script`, in the order in which they are checked.
        seconds: for each scenario; None: as long as it takes.
        rooms, seed: rooms 0 to rooms - 1 of this seed are tried.
        states: how many states of a room are searched.
        deep: whether claims are tried with the shortest successes, and with what is possible without NPCs.
        strict: whether what is undecided, and what never happens, is a failure.
        agents, episodes: who plays for the coverage, and how much.
        least: the percentage that has to come about.
    """

    scenarios: Sequence[str]
    parts: Sequence[str] = ("claims",)
    seconds: float | None = None
    rooms: int = Effort.rooms
    seed: int = 0
    states: int = Effort.states
    deep: bool = False
    strict: bool = False
    agents: Sequence[str] = ()
    episodes: int = EPISODES
    least: float | None = None


class Result(NamedTuple):
    """What a check found: a JSON-able object, and whether that is a failure."""

    document: dict[str, Any]
    failed: bool


class Checks(NamedTuple):
    """What the checks found, and whether Ctrl-C ended them."""

    results: list[Result]
    interrupted: bool


def check(asked: Asked, tell: Tell | None = None, say: Say | None = None) -> Checks:
    """Check scenarios, one part after the other; they share the time. Ctrl-C ends with what is known.

    Args:
        asked: what is checked.
        tell: takes lines about progress, which the next one replaces.
        say: takes the lines of the reports as they come.

    Raises:
        ScenarioError: a scenario has mistakes.
        UsageError: an agent cannot play, or there is no script.
    """
    scenarios = [case for name in asked.scenarios for case in scenarios_of(name)]
    compile_engine()  # before the time begins
    clock = Clock(None if asked.seconds is None else asked.seconds * len(scenarios), tell)
    results: list[Result] = []
    for number, part in enumerate(asked.parts):
        own = clock.part(len(asked.parts) - number)
        if part == "claims":
            results += _claims(asked, scenarios, own, say)
        else:
            results += (_coverage if part == "coverage" else _script)(asked, own, say)
        if clock.interrupted:
            break
    return Checks(results, clock.interrupted)


def _claims(asked: Asked, scenarios: Sequence[Case], clock: Clock, say: Say | None) -> Iterator[Result]:
    for number, case in enumerate(scenarios):
        own = clock.part(len(scenarios) - number)
        effort = Effort(asked.rooms, asked.seed, asked.states, own)
        report = check_scenario(
            case.loaded, case.called, effort, asked.deep, say, script=case.script, named=case.named
        )
        yield Result(report.as_object(), report.fails(asked.strict))
        if clock.interrupted:
            return


def _coverage(asked: Asked, clock: Clock, say: Say | None) -> Iterator[Result]:
    found = coverage(asked.scenarios, asked.agents, asked.episodes, asked.seed, clock)
    if say is not None:
        say("\n".join(found.lines()))
    yield Result(found.as_object(), asked.least is not None and found.percent < asked.least)


def _script(asked: Asked, clock: Clock, say: Say | None) -> Iterator[Result]:
    """A room that can be solved and was not is a failure."""
    for number, name in enumerate(asked.scenarios):
        own = clock.part(len(asked.scenarios) - number)
        found = play_script(name, asked.rooms, asked.seed, asked.states, own)
        if say is not None:
            say("\n".join(found.lines()))
        yield Result(found.as_object(), bool(found.found("solvable")))
        if clock.interrupted:
            return
