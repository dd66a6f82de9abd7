"""Tries what a scenario claims, whether it can be known, and whether everything in it can happen."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from socialai_dsl.analysis.coverage import coverage
from socialai_dsl.analysis.depth import depth
from socialai_dsl.analysis.effort import Effort, OutOfTimeError
from socialai_dsl.analysis.properties import Trial, by_default
from socialai_dsl.analysis.reports import Evidence, Report
from socialai_dsl.analysis.scenario_report import ScenarioReport
from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite, unscripted
from socialai_dsl.engine.jit import load as load_compiled
from socialai_dsl.engine.kernel import serve
from socialai_dsl.frontend import closest_script, load
from socialai_dsl.semantics.plans import PropertyPlan
from socialai_dsl.source import Source

Say = Callable[[str], None]
"""Takes a line of the report."""


Texts = Mapping[Path, Source] | None
"""Contents that stand for those of files, as `load` takes them."""


def check_scenario(
    loaded: LoadedScenario,
    called: str,
    effort: Effort,
    deep: bool = False,
    say: Say | None = None,
    texts: Texts = None,
    script: LoadedScenario | None = None,
    named: bool = True,
) -> ScenarioReport:
    """Try what a scenario claims, whether it can be known, and whether everything in it can happen.

    Args:
        loaded: the scenario.
        called: its name, to which `+oracle` can be added.
        effort: how much to try, and for how long.
        deep: also try what success takes.
        say: takes the lines of the report as they come.
        texts: those that the scenario was loaded with.
        script: the same with a frame for the agent, where that is known.
        named: whether a command plays it by its name.
    """
    place = loaded.resolved.tree.key_span(("outcome",))
    report = ScenarioReport(
        called, effort.rooms, effort.seed, place, sources=loaded.resolved.files, named=named
    )
    said = 0

    def part(tasks: int) -> Effort:
        return replace(effort, clock=effort.clock.part(tasks))

    def tell() -> None:
        nonlocal said
        lines = list(report.lines())
        for line in lines[said:] if say is not None else ():
            say(line)  # type: ignore[misc]
        said = len(lines)

    tell()
    try:
        scripted = script or _scripted(loaded, called, texts)
        trial = Trial(loaded, effort, scripted)
        plans = by_default(loaded, place)
        for number, plan in enumerate(plans):
            found = _tried(trial, plan, part(len(plans) - number + 1 + 2 * deep))
            report.tried += ((plan, found),)
            tell()
            if effort.clock.interrupted:
                break
        if not effort.clock.interrupted:
            with suppress(OutOfTimeError):
                report.coverage = coverage(loaded, part(1 + 2 * deep), scripted)
            tell()
        if deep and not effort.clock.interrupted:
            report.depth = depth(trial, part(1))
            tell()
    except KeyboardInterrupt:
        effort.clock.interrupt()
    report.interrupted = effort.clock.interrupted
    report.complete = True
    tell()
    return report


def compile_engine() -> None:
    """Make the engine ready; where it is not compiled yet, that takes longer than most checks."""
    load_compiled(serve)


def _tried(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    """What is found of a claim; nothing where there is no time for a first room."""
    try:
        with effort.clock.limiting():
            return trial.check(plan, effort)
    except OutOfTimeError:
        return Evidence().report("", None)


class Case(NamedTuple):
    """A scenario that is to be checked.

    Attributes:
        loaded: the scenario. called: its name. script: the same with a frame for the agent, where that is known.
        named: whether a command plays it by its name; a suite may change its members.
    """

    loaded: LoadedScenario
    called: str
    script: LoadedScenario | None = None
    named: bool = True


def scenarios_of(name: str, texts: Texts = None) -> list[Case]:
    """The scenario of a name, or the members of a suite, each once however many start in other rooms."""
    loaded = load(name, texts)
    if isinstance(loaded, LoadedScenario):
        return [Case(loaded, name)]
    scripted = closest_script(name, loaded, texts).loaded
    assert isinstance(scripted, LoadedSuite), "internal: a variant of a suite is a suite"
    silent, found = unscripted(scripted), dict[str, Case]()
    for called, member, script in zip(loaded.member_names, loaded.members, scripted.members, strict=True):
        changed = any(edit.span.file == loaded.resolved.tree.file for edit in member.resolved.edits)
        own = None if called in silent else script
        case = Case(member, called if changed else member.name, own, not changed)
        found.setdefault(repr((member.resolved.data, member.resolved.params)), case)
    return list(found.values())


def _scripted(loaded: LoadedScenario, called: str, texts: Texts) -> LoadedScenario | None:
    """The scenario with a frame for the agent: itself, or its variant `oracle`; None without either."""
    scripted = closest_script(called, loaded, texts).loaded
    return scripted if isinstance(scripted, LoadedScenario) and not unscripted(scripted) else None
