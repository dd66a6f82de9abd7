"""Text with a name, and places in it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

_LINE_BREAK = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True, order=True)
class Span:
    """A place in a source: `width` characters from `column` of `line`, both counted from 1.

    Columns count characters (code points), not bytes and not terminal cells.
    """

    file: str
    line: int
    column: int
    width: int = field(default=1, compare=True)

    def shifted(self, characters: int, width: int = 1) -> Span:
        """The place `characters` further on the same line, `width` characters wide."""
        return Span(self.file, self.line, self.column + characters, width)

    def __str__(self) -> str:
        """`file:line:column`, as editors and terminals make it clickable."""
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Source:
    """A file's text under the name by which messages call it."""

    name: str
    text: str = field(repr=False)

    @cached_property
    def _lines(self) -> list[str]:
        return _LINE_BREAK.split(self.text)

    def line(self, n: int) -> str:
        """Line `n`, counted from 1, without its line break; empty outside the text."""
        return self._lines[n - 1] if 1 <= n <= len(self._lines) else ""

    def lines(self) -> Iterator[str]:
        """All lines in order, without their line breaks."""
        return iter(self._lines)

    def span(self, line: int, column: int, width: int = 1) -> Span:
        """A place in this source."""
        return Span(self.name, line, column, width)
