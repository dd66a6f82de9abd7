"""The findings in checked files, as tools and code hosts read them."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final
from urllib.parse import quote
from xml.etree import ElementTree

from socialai_dsl.diagnostics import CODES, Diagnostic, Severity, counted, printable, render_text, to_json
from socialai_dsl.source import Source, Span


@dataclass(frozen=True)
class CheckedInput:
    """One checked input and what was found in it, or in files it uses.

    Attributes:
        name: as it was given.
        diagnostics: sorted by place.
        sources: name -> source of the files they point into.
        left_out: how many errors more there are than are to be reported.
    """

    name: str
    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, Source]
    left_out: int = 0

    @property
    def errors(self) -> int:
        """Number of errors."""
        return sum(d.severity is Severity.ERROR for d in self.diagnostics) + self.left_out

    @property
    def warnings(self) -> int:
        """Number of warnings."""
        return sum(d.severity is Severity.WARNING for d in self.diagnostics)


def limited(checked: Sequence[CheckedInput], most: int) -> list[CheckedInput]:
    """The results with the first `most` errors alone; one in a file that several inputs share counts once."""
    errors = [d for d in every_finding(checked) if d.severity is Severity.ERROR]
    hidden = set(map(_mistake, errors[most:]))
    return [
        replace(
            c,
            diagnostics=tuple(d for d in c.diagnostics if _mistake(d) not in hidden),
            left_out=sum(_mistake(d) in hidden for d in c.diagnostics),
        )
        for c in checked
    ]


def as_json(checked: Sequence[CheckedInput]) -> str:
    """An array of findings."""
    return _json(to_json(every_finding(checked), _sources(checked)))


def as_github(checked: Sequence[CheckedInput]) -> str:
    """GitHub workflow commands, shown as annotations of the changed lines."""
    lines = []
    for d in every_finding(checked):
        place = {
            "file": printable(d.span.file),
            "line": d.span.line,
            "col": d.span.column,
            "endColumn": d.span.column + d.span.width,
            "title": d.code,
        }
        properties = ",".join(f"{key}={_escape(str(value), ':,')}" for key, value in place.items())
        lines.append(f"::{d.severity.value} {properties}::{_escape(_with_hint(d))}")
    return "\n".join(lines)


def as_sarif(checked: Sequence[CheckedInput]) -> str:
    """A SARIF 2.1.0 log."""
    diagnostics, sources = every_finding(checked), _sources(checked)
    rules = [
        {"id": code, "shortDescription": {"text": CODES[code]}}
        for code in sorted({d.code for d in diagnostics})
    ]
    run = {
        "tool": {"driver": {"name": "socialai", "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "results": [_sarif_result(d, sources) for d in diagnostics],
    }
    log = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return _json(log)


def as_junit(checked: Sequence[CheckedInput], command: str = "validate") -> str:
    """A JUnit XML file: one test case per checked input; warnings are its output, errors its failures."""
    failed = sum(c.errors > 0 for c in checked)
    suite = ElementTree.Element(
        "testsuite", name=f"socialai {command}", tests=str(len(checked)), failures=str(failed)
    )
    for c in checked:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"socialai.{command}", name=printable(c.name)
        )
        if c.errors:
            failure = ElementTree.SubElement(case, "failure", message=counted(c.errors, "error"))
            failure.text = render_text(c.diagnostics, c.sources)
        elif c.diagnostics:
            ElementTree.SubElement(case, "system-out").text = render_text(c.diagnostics, c.sources)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True)


FORMATS: Final[dict[str, Callable[[Sequence[CheckedInput]], str]]] = {
    "json": as_json,
    "github": as_github,
    "sarif": as_sarif,
    "junit": as_junit,
}
"""Format -> function from what was checked to the document."""


def every_finding(checked: Iterable[CheckedInput]) -> list[Diagnostic]:
    """Every finding once, even where several inputs share the file it lies in.

    What a file says of itself is said in place of what its variants say of it, which name their patches as well.
    """
    found: dict[_Mistake, dict[Diagnostic, None]] = {}
    for c in checked:
        own: dict[_Mistake, dict[Diagnostic, None]] = {}
        for d in c.diagnostics:
            own.setdefault(_mistake(d), {})[d] = None
        for mistake, said in own.items():
            if mistake not in found or _length(said) < _length(found[mistake]):
                found[mistake] = said
    return [d for said in found.values() for d in said]


_Mistake = tuple[str, Span, str]


def _mistake(found: Diagnostic) -> _Mistake:
    """What two findings of one mistake have in common, whatever they propose."""
    return found.code, found.span, found.text


def _length(said: Iterable[Diagnostic]) -> int:
    return sum(len(d.help or "") for d in said)


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False)


def _with_hint(diagnostic: Diagnostic) -> str:
    more = [*diagnostic.notes, *filter(None, (diagnostic.help,))]
    return "\n".join([diagnostic.text, *map(printable, more)])


def _escape(text: str, also: str = "") -> str:
    for character in "%\r\n" + also:
        text = text.replace(character, f"%{ord(character):02X}")
    return text


def _sources(checked: Iterable[CheckedInput]) -> dict[str, Source]:
    return {name: source for c in checked for name, source in c.sources.items()}


def _sarif_result(diagnostic: Diagnostic, sources: Mapping[str, Source]) -> dict[str, Any]:
    span = diagnostic.span
    region = {"startLine": span.line, "startColumn": span.column, "endColumn": span.column + span.width}
    location = {"physicalLocation": {"artifactLocation": _artifact(span.file), "region": region}}
    result = {
        "ruleId": diagnostic.code,
        "level": diagnostic.severity.value,
        "message": {"text": _with_hint(diagnostic)},
        "locations": [location],
    }
    return {**result, "fixes": [_sarif_fix(diagnostic, sources)]} if diagnostic.edits else result


def _sarif_fix(diagnostic: Diagnostic, sources: Mapping[str, Source]) -> dict[str, Any]:
    """The changes that cure a finding, file by file."""
    changes: dict[str, list[dict[str, Any]]] = {}
    for edit in diagnostic.edits:
        start, end = sources[edit.span.file].ends(edit)
        region = {"startLine": start.line, "startColumn": start.column}
        region |= {"endLine": end.line, "endColumn": end.column}
        replacement = {"deletedRegion": region, "insertedContent": {"text": edit.text}}
        changes.setdefault(edit.span.file, []).append(replacement)
    return {
        "description": {"text": printable(diagnostic.cure)},
        "artifactChanges": [
            {"artifactLocation": _artifact(file), "replacements": own} for file, own in changes.items()
        ],
    }


def _artifact(file: str) -> dict[str, str]:
    return {"uri": quote(file.replace("\\", "/"))}
