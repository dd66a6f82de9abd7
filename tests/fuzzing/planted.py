"""Mistakes that a loader might have, to be planted in ours."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.loader import patches, reader, resolved
from socialai_dsl.loader.patches import Miss
from socialai_dsl.loader.reader import Library, Plain
from socialai_dsl.source import Node, Source, Span, Style

Patch = pytest.MonkeyPatch


def depth_off_by_one(patch: Patch) -> None:
    """One level more than the language allows is read."""
    patch.setattr(reader, "MAX_DEPTH", reader.MAX_DEPTH + 1)
    patch.setattr(resolved, "MAX_DEPTH", resolved.MAX_DEPTH + 1)


def depth_unlimited(patch: Patch) -> None:
    """Nesting is not counted, so that everything after the reader recurses as deep as a file likes."""
    patch.setattr(reader, "MAX_DEPTH", 10**9)
    patch.setattr(resolved, "MAX_DEPTH", 10**9)


def index_error_on_a_rare_token(patch: Patch) -> None:
    """The explanation of a `%` at the start of a text looks at the character behind it, which may not be there."""
    explain = reader.explain

    def explained(error: Exception, source: Source) -> Diagnostic:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        if mark is not None and source.line(mark.line + 1)[mark.column : mark.column + 1] == "%":
            source.line(mark.line + 1)[mark.column + 1]
        return explain(error, source)

    patch.setattr(reader, "explain", explained)


def dots_are_taken_out_first(patch: Patch) -> None:
    """`..` behind a folder is taken as harmless, because it was taken out of the path before the check."""
    checked, trusted = Library.resolved, set()

    def resolved(self: Library, path: Path, asked: Span) -> Path:
        if path in trusted:
            return path
        if ".." in path.parts and path.parts.index("..") > len(self._roots[0].parts):
            trusted.add(plain := Path(os.path.normpath(path)))
            return plain
        return checked(self, path, asked)

    patch.setattr(Library, "resolved", resolved)


def folders_are_prefixes(patch: Patch) -> None:
    """A path lies in a folder if it begins with the folder's name; links are not followed."""
    checked = Library.resolved

    def resolved(self: Library, path: Path, asked: Span) -> Path:
        plain = Path(os.path.normpath(path))
        if any(str(plain).startswith(str(root)) for root in self._roots):
            return plain
        return checked(self, path, asked)

    patch.setattr(Library, "resolved", resolved)


def numbers_of_any_length(patch: Patch) -> None:
    """A whole number may have as many digits as it likes."""
    patch.setattr(reader, "_int", lambda text: Plain(int(text)))


def columns_in_bytes(patch: Patch) -> None:
    """A column counts bytes, which shows behind a letter that is not ASCII only."""

    def span(self: Any, event: Any) -> Span:
        start, end = event.start_mark, event.end_mark
        before = self.source.line(start.line + 1)[: start.column]
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source.name, start.line + 1, len(before.encode()) + 1, max(1, width))

    patch.setattr(reader._Builder, "_span", span)


def duplicates_in_braces(patch: Patch) -> None:
    """A key given twice is found in blocks only."""
    key = reader._Builder._key

    def taken(self: Any, text: str, style: Style, span: Span) -> None:
        if self._stack[-1].flow:
            self._stack[-1].container.pop(text, None)
        key(self, text, style, span)

    patch.setattr(reader._Builder, "_key", taken)


def escapes_are_not_looked_into(patch: Patch) -> None:
    """A control character may be written as an escape in double quotes."""

    class Nothing:
        @staticmethod
        def search(text: str) -> None:
            del text

    patch.setattr(reader, "FORBIDDEN", Nothing)


def one_entry_too_many(patch: Patch) -> None:
    """A path of a patch may name the entry behind the last one of a list."""
    step = patches._list_step

    def stepped(node: Node, path: str, begin: int) -> tuple[int, int] | Miss:
        match = re.match(r"\[(\d{1,4})\]", path[begin:])
        if match and int(match[1]) == len(node.children or ()):
            return int(match[1]), begin + match.end()
        return step(node, path, begin)

    patch.setattr(patches, "_list_step", stepped)


PLANTED: dict[str, tuple[str, Callable[[Patch], None]]] = {
    "one level too deep": ("document", depth_off_by_one),
    "no limit of nesting": ("whole", depth_unlimited),
    "IndexError on a rare token": ("document", index_error_on_a_rare_token),
    "`..` not followed": ("whole", dots_are_taken_out_first),
    "a folder as a prefix": ("whole", folders_are_prefixes),
    "numbers of any length": ("document", numbers_of_any_length),
    "columns in bytes": ("document", columns_in_bytes),
    "keys given twice in braces": ("document", duplicates_in_braces),
    "control characters as escapes": ("document", escapes_are_not_looked_into),
    "an entry behind the last": ("whole", one_entry_too_many),
}
"""What it is called -> the target that ought to find it, and how to plant it."""
