"""Text with a name, places in it, and where the parts of a document stand."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, TypeAlias

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


DataPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the root of a document to one of its parts; () is the root."""


class Positions(Protocol):
    """Path -> place; what does not exist is where its nearest ancestor is."""

    def locate(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of the character `offset` (from 0) of the text at `path`."""

    def value_span(self, path: DataPath) -> Span:
        """The place of the value at `path`."""

    def key_span(self, path: DataPath) -> Span:
        """The place of the key at `path`; of the value, for an item of a list."""

    def in_flow(self, path: DataPath) -> bool:
        """Whether the part at `path` stands inside { } or [ ]."""
