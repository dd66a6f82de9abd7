"""Comments that silence warnings: `# socialai: ignore=W306` on the line that a warning points at."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from socialai_dsl.diagnostics import (
    CODES,
    Diagnostic,
    DiagnosticBag,
    ScenarioError,
    Severity,
    did_you_mean,
)
from socialai_dsl.loader import read_document
from socialai_dsl.loader.comments import comments_of
from socialai_dsl.source import Source, Span

UNUSED: Final = "W008"

_IGNORE: Final = re.compile(r"#\s*socialai:\s*ignore\b(?:\s*=\s*(?P<codes>[^\s,]+(?:\s*,\s*[^\s,]+)*))?")
"""Codes are divided by commas; what follows them is a reason for people."""

_CODE: Final = re.compile(r"[^\s,]+")
_WARNINGS: Final = [code for code in CODES if code.startswith("W") and code != UNUSED]


@dataclass(frozen=True)
class Ignore:
    """One code that a comment names, and where."""

    code: str
    span: Span

    @property
    def key(self) -> tuple[str, int, str]:
        """What tells which warnings it ignores."""
        return self.span.file, self.span.line, self.code


@dataclass(frozen=True)
class Sifted:
    """Findings, divided by what comments say.

    Attributes:
        kept: what is left, with what is wrong with the comments.
        used: the places of the codes in comments that silenced a warning.
    """

    kept: tuple[Diagnostic, ...]
    used: frozenset[Span]


def sift(found: Iterable[Diagnostic], sources: Mapping[str, Source], judged: str | None) -> Sifted:
    """Take out the warnings that comments ignore.

    Args:
        found: the findings of one scenario.
        sources: the files they may point into.
        judged: the file whose comments have to silence something; None if the warnings are not all known, as of a
            file with mistakes or one that others build on.
    """
    found = tuple(found)
    ignores = [ignore for source in sources.values() for ignore in ignores_in(source)]
    if not ignores:
        return Sifted(found, frozenset())
    warned = {_key(d) for d in found if d.severity is Severity.WARNING}
    used = [i for i in ignores if i.code in _WARNINGS and i.key in warned]
    silenced = {ignore.key for ignore in used}
    bag = DiagnosticBag(d for d in found if _key(d) not in silenced)
    for ignore in ignores:
        if ignore.code not in _WARNINGS:
            bag.add(_no_warning(ignore))
        elif ignore.span.file == judged and ignore not in used:
            message = f"nothing on this line is warned of with `{ignore.code}`; delete the comment"
            bag.warning(UNUSED, message, ignore.span)
    return Sifted(tuple(bag), frozenset(ignore.span for ignore in used))


def ignores_in(source: Source) -> Iterator[Ignore]:
    """The codes that a file's comments ignore; none if the file is no YAML."""
    if _IGNORE.search(source.text) is None:
        return
    try:
        document = read_document(source)
    except ScenarioError:
        return
    for comment in comments_of(document):
        match = _IGNORE.match(comment.text)
        if match is None:
            continue
        if match["codes"] is None:
            yield Ignore("", comment.span)
            continue
        for code in _CODE.finditer(comment.text, match.start("codes"), match.end("codes")):
            yield Ignore(code.group(), comment.span.shifted(code.start(), len(code.group())))


def _key(finding: Diagnostic) -> tuple[str, int, str]:
    return finding.span.file, finding.span.line, finding.code


def _no_warning(ignore: Ignore) -> Diagnostic:
    """The finding for a code that cannot be ignored."""
    hint = "a comment ignores the warnings it names: `# socialai: ignore=" + ", ".join(_WARNINGS[:2]) + "`"
    near = None
    if not ignore.code:
        message = "this comment names no warning to ignore"
    elif ignore.code in CODES and ignore.code != UNUSED:
        message = f"`{ignore.code}` is an error, and only warnings can be ignored"
    elif ignore.code == UNUSED:
        message = f"`{UNUSED}` cannot be ignored: delete the comment it points at"
    else:
        near = did_you_mean(ignore.code, _WARNINGS)
        message = f"there is no warning `{ignore.code}`"
    return Diagnostic(UNUSED, message, ignore.span, Severity.WARNING, hint if near is None else None, near)
