"""The tests of `socialai test`: found in scenarios and in the files beside them, chosen by their names, played."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any, Final

from socialai_dsl.analysis.check import compile_engine
from socialai_dsl.checking.formats import CheckedInput
from socialai_dsl.checking.tests import Tested
from socialai_dsl.diagnostics import DiagnosticBag, Severity, to_json
from socialai_dsl.envs.dialogues import Performed, Rehearsal, seeds_of
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import check
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem, parse_expression
from socialai_dsl.loader.given import given_files
from socialai_dsl.loader.reader import display_name, followed
from socialai_dsl.loader.resolved import TESTS, resolve, taken_apart
from socialai_dsl.semantics.plans import DialoguePlan
from socialai_dsl.source import Source

_HAS_TESTS: Final = re.compile(r"""^["']?tests(_of)?["']?\s*:""", re.MULTILINE)


@dataclass(frozen=True)
class PlayedTest:
    """A test that was played.

    Attributes:
        plan: the test. called: the scenario that was played.
        outcome: its name, what is wrong, and the files that this points into.
        performed: how it went in the last room in which it was played.
        seconds: what it took.
    """

    plan: DialoguePlan
    called: str
    outcome: CheckedInput
    performed: Performed
    seconds: float

    @property
    def fails(self) -> bool:
        """Whether something is wrong."""
        return bool(self.outcome.errors)

    def as_object(self) -> dict[str, Any]:
        """The result for JSON."""
        span = self.plan.span
        return {
            "test": self.plan.name,
            "scenario": self.called,
            "file": span.file,
            "line": span.line,
            "column": span.column,
            "passes": not self.fails,
            "rooms": len(seeds_of(self.plan)),
            "seconds": round(self.seconds, 3),
            "findings": to_json(self.outcome.diagnostics, self.outcome.sources),
        }


def play_tests(
    names: Sequence[str],
    chosen: str | None = None,
    say: Callable[[PlayedTest], None] = lambda _: None,
    texts: Mapping[Path, Source] | None = None,
) -> list[PlayedTest]:
    """Play the tests of files and scenarios.

    Args:
        names: scenarios, files of tests, or folders; of a scenario also the tests in the file beside it, and with
            `+variants` or `?parameters` those that play just these.
        chosen: words, with `and`, `or`, `not` and brackets, that must be part of the names; None: all.
        say: takes each test as soon as it has been played.
        texts: contents that stand for those of files, as `check` takes them.

    Raises:
        ScenarioError: with all mistakes in these files.
        UsageError: there is no test, or none that is chosen, or `chosen` is no such expression.
    """
    wanted = _Choice(chosen)
    found, sources = _found(names, texts or {})
    tests = [(one, plan) for one in found for plan in one.loaded.checked.tests if wanted.takes(one, plan)]
    if not tests:
        what = "tests" if chosen is None or not found else f"a test that is called {chosen!r}"
        raise UsageError(f"{', '.join(names)}: expected {what}, found none")
    compile_engine()
    played = []
    for one in found:
        plans = [plan for owner, plan in tests if owner is one]
        rehearsal = Rehearsal(one) if plans else None
        for plan in plans:
            assert rehearsal is not None, "internal: there is something to play"
            begun = perf_counter()
            performed = rehearsal.play(plan)
            outcome = CheckedInput(f"{plan.span.file}::{plan.name}", performed.findings, sources)
            played.append(PlayedTest(plan, one.called, outcome, performed, perf_counter() - begun))
            say(played[-1])
    return played


def _found(names: Sequence[str], texts: Mapping[Path, Source]) -> tuple[list[Tested], dict[str, Source]]:
    """The tests of files and scenarios, with all files that were read."""
    bag, sources = DiagnosticBag(), dict[str, Source]()
    found: list[Tested] = []
    given = (file for name in given_files(names) for file in _files(name, texts))
    for file, suffix in dict.fromkeys(given):
        result = check(file, texts)
        bag.extend(d for d in result.diagnostics if d.severity is Severity.ERROR)
        sources |= result.sources
        if not result.has_errors:
            found += [one for one in result.tested if one.called.endswith(suffix)]
    bag.raise_errors(sources)
    return found, sources


def _files(name: str, texts: Mapping[Path, Source]) -> Iterator[tuple[str, str]]:
    """The files that may have tests of a name, and the end of the names of the scenarios that these are to play."""
    base, suffix = taken_apart(name)
    path = Path(base)
    if not path.is_file() and followed(path) not in texts:
        path = resolve(base).path
    for file in dict.fromkeys((path, path.with_name(path.stem.removesuffix(".tests") + TESTS))):
        own = texts.get(followed(file))
        text = own.text if own else file.read_text("utf-8", "replace") if file.is_file() else ""
        if _HAS_TESTS.search(text):
            yield display_name(file), suffix


@dataclass(frozen=True)
class _Choice:
    """Which tests are chosen.

    Args:
        text: words with `and`, `or`, `not` and brackets; None: all tests.
    """

    text: str | None

    def takes(self, one: Tested, plan: DialoguePlan) -> bool:
        """Whether a test is chosen."""
        return self.text is None or _holds(self._tree, f"{one.called} {plan.name}".casefold())

    @cached_property
    def _tree(self) -> ast.Expr:
        try:
            return parse_expression(self.text or "")
        except ParseProblem as problem:
            raise UsageError(f"-k: got {self.text!r}: {problem}") from None


def _holds(tree: ast.Expr, name: str) -> bool:
    match tree:
        case ast.Name(id=word):
            return word.casefold() in name
        case ast.Not():
            return not _holds(next(tree.children()), name)
        case ast.Logic(op=op, operands=operands):
            return (all if op == "and" else any)(_holds(part, name) for part in operands)
    raise UsageError(f"-k: expected words with `and`, `or` and `not`, got {ast.unparse(tree)!r}")


def passes(source: Source, name: str, texts: Mapping[Path, Source] | None = None) -> None:
    """See that a test passes, in a file that need not be on the disk yet, among `texts` as `check` takes them.

    Raises:
        ScenarioError: with what is wrong.
    """
    assert source.path is not None, "internal: tests stand in files"
    result = check(source.path, {**(texts or {}), source.path.resolve(): source})
    result.read()
    bag = DiagnosticBag()
    for one in result.tested:
        for plan in one.loaded.checked.tests:
            if plan.name == name:
                bag.extend(Rehearsal(one).play(plan).findings)
    bag.raise_errors(result.sources)
