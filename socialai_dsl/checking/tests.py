"""Checks the tests of scenarios: those in a scenario's file, and those in files of their own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.checking.scenarios import check_scenario, naming_the_patch
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, Severity
from socialai_dsl.loader.reader import display_name, shipped_folder
from socialai_dsl.loader.resolved import ResolvedFile, parse_name
from socialai_dsl.schema.files import TestsFile
from socialai_dsl.schema.shape import model_of
from socialai_dsl.source import DataPath, Node

KIND: Final = "tests_of"
"""The key that says that a file has tests."""

MOST_VARIANTS: Final = 64
"""How many different scenarios the tests of a file may play; each takes about as long to check as the scenario."""


@dataclass(frozen=True)
class Tested:
    """A scenario with tests of it.

    Attributes:
        called: its name, as it is given to commands.
        loaded: the scenario, whose `checked.tests` are the tests.
        written: the tests as they stand in their file.
    """

    called: str
    loaded: LoadedScenario
    written: Node


def check_tests(file: ResolvedFile, bag: DiagnosticBag) -> tuple[Tested, ...]:
    """The tests that stand in a file, with the scenarios that they play. `bag` takes the findings.

    What is wrong with a scenario itself is said where that is checked.

    Args:
        file: a scenario without variants, or a file of tests.
        bag: takes the findings.
    """
    if file.kind != KIND:
        try:
            _require_scenario(file, ("tests",), file)
        except ScenarioError as error:
            bag.extend(error.diagnostics)
            return ()
        return tuple(_Tests(file, file, file.path.name, "").tested(bag))
    shape = DiagnosticBag()
    model_of(TestsFile, file.tree, shape, parameters=False)
    tests = file.tree.entry("tests")
    bag.extend(shape if tests is None else _apart(tests, shape)[1])
    named = file.tree.entry(KIND)
    if tests is None or named is None or not isinstance(named.value, str):
        return ()
    name = parse_name(named.value, named.locate(), DiagnosticBag()).base.text
    try:
        scenario = file.include((KIND,))
        _require_scenario(file, (KIND,), scenario)
    except ScenarioError as error:
        bag.extend([*error.diagnostics, *shape])
        return ()
    return tuple(_Tests(file, scenario, name, named.value[len(name) :]).tested(bag))


def tested_by(file: ResolvedFile) -> ResolvedFile | None:
    """The scenario that a file of tests is about; None if it cannot be read."""
    named = file.tree.entry(KIND)
    with suppress(ScenarioError):
        return file.include((KIND,)) if named is not None else None
    return None


def _require_scenario(file: ResolvedFile, path: DataPath, found: ResolvedFile) -> None:
    """Raise S108 if what is to be tested is no scenario that can be played."""
    abstract = isinstance(found.data, dict) and found.data.get("abstract") is True
    if found.kind != "scenario" or abstract:
        what = "an abstract scenario" if abstract else f"a file of the kind `{found.kind}`"
        hint = "of a suite its members are tested" if found.kind == "suite" else None
        span = file.tree.key_span(path) if found is file else file.tree.value_span(path)
        raise file.error("S108", f"this is {what}; tests are of a scenario", span, hint)


def _apart(part: Node, findings: Iterable[Diagnostic]) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """The findings that point into a part of a file, and the others."""
    spans = [span for _, node in part.walk() for span in (node.span.key, node.span.value) if span is not None]
    lines = range(min(span.line for span in spans), max(span.line for span in spans) + 1)
    inside: list[Diagnostic] = []
    others: list[Diagnostic] = []
    for finding in findings:
        is_in = finding.span.file == part.file and finding.span.line in lines
        (inside if is_in else others).append(finding)
    return inside, others


@dataclass(frozen=True)
class _Tests:
    """The tests of a file.

    Attributes:
        file: where they stand.
        scenario: what is played by those that do not say `of`.
        base: how the file calls that scenario's file. suffix: the variants and parameters of it.
    """

    file: ResolvedFile
    scenario: ResolvedFile
    base: str
    suffix: str

    def tested(self, bag: DiagnosticBag) -> Iterator[Tested]:
        """The scenarios that are played, each with its tests, if nothing is wrong with those."""
        tests = self.file.tree.at(("tests",))
        if not isinstance(tests.children, dict):
            yield from self._of(None, tests, bag)
            return
        groups: dict[str | None, dict[str, Node]] = {}
        for name, test in tests.children.items():
            groups.setdefault(test.text("of"), {})[name] = test
        if len(groups) > MOST_VARIANTS:
            message = f"the tests of a file play at most {MOST_VARIANTS} variants, these {len(groups)}"
            bag.error("S106", message, tests.key_span(), hint="write some of them into another file")
            return
        for of, named in groups.items():
            yield from self._of(of, Node(tests.span, children=named), bag)

    def _of(self, of: str | None, tests: Node, bag: DiagnosticBag) -> Iterator[Tested]:
        """The tests that play one variant."""
        own, scenario, is_known = DiagnosticBag(), self.scenario, True
        if of is not None:
            path: DataPath = ("tests", str(next(iter(tests.items()))[0]), "of")
            try:
                scenario = self.file.continued(path, self.base)
            except ScenarioError as error:
                bag.extend(error.diagnostics)
                is_known = False
        checked, model = check_scenario(scenario, own, tests)
        found, others = _apart(tests, own)
        others = [d for d in others if d.severity is Severity.ERROR]
        if others or not is_known:  # what is missing there may be what a test needs
            found = [d for d in found if d.code.startswith("S1")]
            bag.extend(() if scenario is self.file else others)
        bag.extend(d if d.code.startswith("S1") else naming_the_patch(d, scenario) for d in found)
        if is_known and checked is not None and model is not None:
            suffix = self.suffix if of is None else of
            loaded = LoadedScenario(checked.name, checked, model, scenario)
            yield Tested(self._called() + suffix, loaded, tests)

    def _called(self) -> str:
        """The scenario's file as it is given to commands: what ships by its name."""
        path, shipped = self.scenario.path, shipped_folder().resolve()
        if path.is_relative_to(shipped):
            return path.relative_to(shipped).with_suffix("").as_posix()
        return display_name(path)
