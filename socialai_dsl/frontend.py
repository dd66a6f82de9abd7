"""From a scenario's name to a checked scenario, or to everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, Severity, did_you_mean
from socialai_dsl.library import GrammarLibrary, ObjectLibrary, prelude, shared_grammars
from socialai_dsl.loader import Resolved, resolve
from socialai_dsl.parameters import Substituted, substitute
from socialai_dsl.schema import Npc, Scenario
from socialai_dsl.schema.shape import model_of
from socialai_dsl.semantics.check import check_meaning
from socialai_dsl.semantics.terms import Checked
from socialai_dsl.source import Source

SUFFIXES = (".yaml", ".yml")

_MAY_FOLLOW = frozenset(
    {"S105", "S201", "S204", "S205", "S206", "S301", "S302", "S303", "S305", "S310", "S401", "S402"}
)
"""What may be wrong only because a part of the file was left out, which has been reported."""


@dataclass(frozen=True)
class CheckResult:
    """What checking one file or name found.

    Attributes:
        name: as it was asked for.
        checked: the scenario with everything resolved; None if there are errors, or if it is not a scenario.
        scenario: its models; None if its shape is wrong.
        diagnostics: sorted by place. sources: name -> source of every file read.
        resolved: the data with its positions; None if the files could not be read.
    """

    name: str
    checked: Checked | None
    scenario: Scenario | None
    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, Source]
    resolved: Resolved | None

    @property
    def has_errors(self) -> bool:
        """Whether it cannot be used."""
        return any(d.severity is Severity.ERROR for d in self.diagnostics)


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario that is right: what `compile` takes.

    Attributes:
        name: with variants, e.g. `talkitout+unsocial`.
        checked: everything resolved. scenario: the models. resolved: the data with its positions.
        warnings: findings that do not keep it from running.
    """

    name: str
    checked: Checked
    scenario: Scenario
    resolved: Resolved
    warnings: tuple[Diagnostic, ...] = ()

    def __repr__(self) -> str:
        return f"<LoadedScenario {self.name}: {len(self.checked.entities)} entities, horizon {self.checked.horizon}>"


def load(name: str | Path) -> LoadedScenario:
    """A scenario by path or shipped name, with variants and parameters: `talkitout+unsocial`, `a.yaml?n=2`.

    Raises:
        ScenarioError: with all findings, if one of them is an error.
    """
    result = check(name)
    if result.has_errors:
        raise ScenarioError(result.diagnostics, result.sources)
    if result.checked is None or result.scenario is None or result.resolved is None:
        kind = result.resolved.kind if result.resolved is not None else "file"
        abstract = result.scenario is None and kind == "scenario"
        what = "an abstract scenario, which others build on" if abstract else f"a file of the kind `{kind}`"
        assert result.resolved is not None, "internal: nothing was read, and nothing is wrong"
        span = result.resolved.key_span((kind,))
        message = f"this is {what}; only a scenario can be run"
        raise ScenarioError([Diagnostic("S108", message, span)], result.sources)
    return LoadedScenario(
        result.checked.name, result.checked, result.scenario, result.resolved, result.diagnostics
    )  # fmt: skip


def check(name: str | Path) -> CheckResult:
    """Check a scenario; findings are returned, never raised."""
    name = str(name)
    try:
        resolved = resolve(name)
    except ScenarioError as error:
        return CheckResult(name, None, None, tuple(DiagnosticBag(error.diagnostics)), error.sources, None)
    bag = DiagnosticBag()
    checked, scenario = _checked(resolved, bag)
    found = tuple(_naming_the_patch(d, resolved) for d in bag)
    return CheckResult(name, checked, scenario, found, dict(resolved.files), resolved)


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
    match resolved.kind:
        case "scenario":
            return _checked_scenario(resolved, bag)
        case "variant":
            return None, None  # of any scenario: its shape was checked when it was read
        case "npc":
            _check_npc(resolved, bag)
            return None, None
        case "library":
            _check_library(resolved, bag)
            return None, None
    message = f"files of the kind `{resolved.kind}` are not known here"
    hint = "known are `scenario`, `variant` and `library`"
    bag.error("S108", message, resolved.key_span((resolved.kind,)), hint=hint)
    return None, None


def _check_npc(resolved: Resolved, bag: DiagnosticBag) -> None:
    """Its shape; what it means is checked in the scenarios that draw it."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    model_of(Npc, resolved.data, resolved, bag, partial=resolved.data.get("abstract") is True)


def _check_library(resolved: Resolved, bag: DiagnosticBag) -> None:
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    kind = resolved.data["library"]
    if kind == "objects":
        model_of(ObjectLibrary, resolved.data, resolved, bag)
    elif kind == "grammars":
        model_of(GrammarLibrary, resolved.data, resolved, bag)
    else:
        message = f"there is no library of `{kind}`"
        bag.error("S103", message, resolved.value_span(("library",)), hint="one of objects, grammars")


def _checked_scenario(resolved: Resolved, bag: DiagnosticBag) -> tuple[Checked | None, Scenario | None]:
    try:
        resolved = resolved.with_drawn_files()
    except ScenarioError as error:
        bag.extend(error.diagnostics)
        return None, None
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    filled = substitute(resolved, bag)
    data = _with_grammar(filled, resolved, bag)
    abstract = data.get("abstract") is True
    failed = bag.has_errors
    shaped = model_of(Scenario, data, resolved, bag, partial=abstract)
    if shaped.model is None or abstract or failed:
        return None, None if bag.has_errors else shaped.model
    found = DiagnosticBag()
    checked = check_meaning(
        shaped.model, resolved.name, shaped.places, found, prelude(), shaped.data, filled.values, filled.paths
    )  # fmt: skip
    if not bag.has_errors:
        bag.extend(found)
        return checked, shaped.model
    bag.extend(
        d for d in found if d.severity is Severity.ERROR and not (shaped.lost and d.code in _MAY_FOLLOW)
    )
    return None, None


def _with_grammar(filled: Substituted, resolved: Resolved, bag: DiagnosticBag) -> dict[str, object]:
    """The data with the name of a shared grammar replaced by the grammar."""
    data = dict(filled.data)
    name = data.get("grammar")
    if not isinstance(name, str):
        return data
    shared = shared_grammars()
    if name in shared:
        return {**data, "grammar": shared[name]}
    span = resolved.value_span(("grammar",))
    near = did_you_mean(name, shared)
    hint = None if near else "shared are " + ", ".join(shared) + "; else write `templates` and `nouns`"
    bag.error("S201", f"there is no shared grammar `{name}`", span, suggestion=near, hint=hint)
    return {**data, "grammar": next(iter(shared.values()))}


def _naming_the_patch(finding: Diagnostic, resolved: Resolved) -> Diagnostic:
    """A mistake in a patched scenario says what it was patched by, since its file alone may be right."""
    if not resolved.edits or finding.severity is not Severity.ERROR:
        return finding
    patches = sorted({edit.span.file for edit in resolved.edits})
    note = f"in `{resolved.name}`, patched by {', '.join(patches)}"
    return replace(finding, hint=f"{finding.hint}; {note}" if finding.hint else note)
