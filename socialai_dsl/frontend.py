"""From a scenario's name to a checked scenario or suite, or to everything that is wrong with it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from socialai_dsl.checking.choices import of_other_values
from socialai_dsl.checking.experiments import LoadedExperiment, check_experiment
from socialai_dsl.checking.ignored import sift
from socialai_dsl.checking.libraries import check_library, check_npc
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.checking.repetitions import said_once
from socialai_dsl.checking.scenarios import check_scenario, naming_the_patch
from socialai_dsl.checking.suites import check_suite
from socialai_dsl.checking.swallowed import swallowed
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, Severity, bounded_suggestions
from socialai_dsl.loader import Resolved, resolve
from socialai_dsl.loader.files import display_name
from socialai_dsl.schema import Scenario
from socialai_dsl.semantics.plans import Checked
from socialai_dsl.source import Source, Span

__all__ = [
    "CheckResult",
    "Loaded",
    "LoadedExperiment",
    "LoadedScenario",
    "LoadedSuite",
    "check",
    "check_files",
    "load",
    "load_experiment",
]

SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True)
class CheckResult:
    """What checking one file or name found.

    Attributes:
        name: as it was asked for.
        checked: the scenario with everything resolved; None if there are errors, or if it is not a scenario.
        scenario: its models; None if its shape is wrong, or if it is not a scenario.
        diagnostics: sorted by place. sources: name -> source of every file read.
        resolved: the data with its positions; None if the files could not be read.
        suite: the suite with its members, if it is one and nothing is wrong with it.
        used: the places of the codes in comments that silenced a warning.
        experiment: the experiment with its conditions, if it is one and nothing is wrong with it.
    """

    name: str
    checked: Checked | None
    scenario: Scenario | None
    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, Source]
    resolved: Resolved | None
    suite: LoadedSuite | None = None
    used: frozenset[Span] = frozenset()
    experiment: LoadedExperiment | None = None

    @property
    def has_errors(self) -> bool:
        """Whether it cannot be used."""
        return any(d.severity is Severity.ERROR for d in self.diagnostics)


def load(name: str | Path, texts: Mapping[Path, Source] | None = None) -> Loaded:
    """A scenario or suite by path or shipped name, with variants and parameters: `talkitout+unsocial`, `a.yaml?n=2`.

    Args:
        name: which one.
        texts: see `check`.

    Raises:
        ScenarioError: with all findings, if one of them is an error.
    """
    result = check(name, texts)
    if result.has_errors:
        raise ScenarioError(result.diagnostics, result.sources)
    loaded = _loaded(result)
    if loaded is None:
        assert result.resolved is not None, "internal: nothing was read, and nothing is wrong"
        kind = result.resolved.kind
        what = "an abstract scenario, which others build on"
        if kind != "scenario":
            what = f"a file of the kind `{kind}`"
        span = result.resolved.key_span((kind,))
        message = f"this is {what}; only a scenario can be run"
        raise ScenarioError([Diagnostic("S108", message, span)], result.sources)
    return loaded


def _loaded(result: CheckResult) -> Loaded | None:
    """What was checked and has no errors, if it can be run."""
    if result.suite is not None:
        return result.suite
    if result.checked is None or result.scenario is None or result.resolved is None:
        return None
    return LoadedScenario(
        result.checked.name, result.checked, result.scenario, result.resolved, result.diagnostics
    )  # fmt: skip


def load_experiment(name: str | Path) -> LoadedExperiment:
    """An experiment's file, with its conditions.

    Raises:
        ScenarioError: with all findings, if one of them is an error, or S108 if it is a file of another kind.
    """
    result = check(name)
    if result.has_errors:
        raise ScenarioError(result.diagnostics, result.sources)
    if result.experiment is None:
        assert result.resolved is not None, "internal: nothing was read, and nothing is wrong"
        kind = result.resolved.kind
        message = f"this is a file of the kind `{kind}`, not an experiment"
        span = result.resolved.key_span((kind,))
        raise ScenarioError([Diagnostic("S108", message, span)], result.sources)
    return result.experiment


def check(
    name: str | Path, texts: Mapping[Path, Source] | None = None, every_value: bool = False
) -> CheckResult:
    """Check a scenario or suite; findings are returned, never raised.

    Args:
        name: a path or the name of a shipped scenario, with variants and parameters.
        texts: resolved path -> text, for files that are not on the disk as they are meant: those of an editor.
        every_value: whether a scenario that is right is also checked with the other values of its parameters.
    """
    with bounded_suggestions():
        return _check(str(name), texts, every_value)


def _check(name: str, texts: Mapping[Path, Source] | None, every_value: bool) -> CheckResult:
    try:
        resolved = resolve(name, texts=texts)
    except ScenarioError as error:
        return CheckResult(name, None, None, tuple(DiagnosticBag(error.diagnostics)), error.sources, None)
    bag = DiagnosticBag()
    if resolved.kind in ("scenario", "npc", "library"):
        bag.extend(swallowed(resolved))
    if resolved.kind == "suite":
        suite = check_suite(resolved, bag)
        return _sifted(
            CheckResult(name, None, None, tuple(said_once(bag)), dict(resolved.files), resolved, suite)
        )
    if resolved.kind == "experiment":
        experiment = check_experiment(resolved, bag)
        files = dict(resolved.files)
        right = None
        if experiment is not None:
            played = _check_played(experiment, bag, files)
            right = None if bag.has_errors else replace(experiment, played=played)
        found = tuple(bag)
        return _sifted(CheckResult(name, None, None, found, files, resolved, experiment=right))
    checked, scenario = _checked(resolved, bag)
    if every_value and checked is not None:
        bag.extend(of_other_values(resolved))
    found = tuple(DiagnosticBag(naming_the_patch(d, resolved) for d in said_once(bag)))
    return _sifted(CheckResult(name, checked, scenario, found, dict(resolved.files), resolved))


def _sifted(result: CheckResult) -> CheckResult:
    """Without the warnings that comments ignore; a file whose warnings are all known is to have no idle ones."""
    assert result.resolved is not None, "internal: what was checked has been read"
    meant = (result.checked, result.suite, result.experiment) != (None, None, None)
    judged = display_name(result.resolved.path) if meant and not result.has_errors else None
    sifted = sift(result.diagnostics, result.sources, judged)
    suite = result.suite
    if suite is not None and sifted.used:
        suite = replace(suite, warnings=sifted.kept)
    return replace(result, diagnostics=sifted.kept, used=sifted.used, suite=suite)


def check_files(paths: Iterable[str | Path]) -> Iterator[CheckResult]:
    """Check files and every YAML file in folders, each once, in order of their names."""
    seen: set[str] = set()
    for path in paths:
        for file in _files(Path(path)):
            if file not in seen:
                seen.add(file)
                yield check(file)


def _files(path: Path) -> list[str]:
    if not path.is_dir():
        return [str(path)]
    return sorted(str(file) for file in path.rglob("*") if file.suffix in SUFFIXES and file.is_file())


def _checked(resolved: Resolved, bag: DiagnosticBag) -> tuple[Checked | None, Scenario | None]:
    """A file that is no suite; only a scenario has a meaning of its own."""
    match resolved.kind:
        case "scenario":
            return check_scenario(resolved, bag)
        case "npc":
            check_npc(resolved, bag)
        case "library":
            check_library(resolved, bag)
    return None, None  # the shape of a variant of any scenario was checked when it was read


def _check_played(
    experiment: LoadedExperiment, bag: DiagnosticBag, files: dict[str, Source]
) -> dict[str, Loaded]:
    """Check the scenarios that an experiment names, each once, and return those that are right.

    What is wrong with a name points into the experiment; what is wrong with a file, into that.
    """
    played: dict[str, Loaded] = {}
    for name, written, place in experiment.named():
        result = check(name)
        span = experiment.resolved.value_span(place)
        if not result.has_errors:
            loaded = _loaded(result)
            if loaded is not None:
                played[written] = loaded
                continue
            assert result.resolved is not None, "internal: nothing was read, and nothing is wrong"
            kind = result.resolved.kind
            what = "an abstract scenario" if kind == "scenario" else f"a file of the kind `{kind}`"
            bag.error("S108", f"`{written}` is {what}; only a scenario or a suite can be run", span)
            continue
        files.update({source: text for source, text in result.sources.items() if source not in files})
        for finding in result.diagnostics:
            if finding.severity is not Severity.ERROR:
                continue  # said where the scenario itself is checked
            if finding.span.file in result.sources and Path(finding.span.file).is_file():
                bag.add(finding)
                continue
            meant = finding.suggestion
            if meant is not None and os.path.isabs(meant):
                meant = os.path.relpath(meant, experiment.folder)
            bag.add(replace(finding, span=span, suggestion=meant))
    return played
