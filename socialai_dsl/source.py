"""Text with a name, places in it, and the tree of a document, whose parts know where they are written."""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

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
class TextEdit:
    """A change of a file: `text` takes the place of the characters of `span`, line breaks among them; of none if 0."""

    span: Span
    text: str


@dataclass(frozen=True)
class Source:
    """A file's text under the name by which messages call it.

    Attributes:
        name: how messages call it.
        text: what is in it.
        path: the file itself, resolved; None if the text did not come from a file.
    """

    name: str
    text: str = field(repr=False)
    path: Path | None = field(default=None, compare=False)

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

    # -- edits -----------------------------------------------------------------------------------------------

    @cached_property
    def _starts(self) -> list[int]:
        """Where each line begins."""
        return [0, *(found.end() for found in _LINE_BREAK.finditer(self.text))]

    def index(self, span: Span) -> int:
        """Where a place in this source begins in its text."""
        return self._starts[span.line - 1] + span.column - 1

    def edit(self, start: int, end: int, text: str) -> TextEdit:
        """The change that puts another text in the place of `self.text[start:end]`."""
        line = bisect(self._starts, start)
        return TextEdit(self.span(line, start - self._starts[line - 1] + 1, end - start), text)

    def ends(self, edit: TextEdit) -> tuple[Span, Span]:
        """Where the characters that a change takes away begin, and the place behind them; both are of no width."""
        start = self.index(edit.span)
        return self.edit(start, start, "").span, self.edit(stop := start + edit.span.width, stop, "").span

    def edited(self, edits: Iterable[TextEdit]) -> str:
        """The text after changes that do not overlap."""
        text = self.text
        for edit in sorted(edits, key=lambda edit: edit.span, reverse=True):
            start = self.index(edit.span)
            text = text[:start] + edit.text + text[start + edit.span.width :]
        return text


DataPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the root of a document to one of its parts; () is the root."""

Scalar: TypeAlias = str | int | float | bool | None

Data: TypeAlias = "Scalar | list[Data] | dict[str, Data]"


# -- the place of each character of a scalar's value ---------------------------------------------------------


_WHITE = " \t\n\r"
_ESCAPE_DIGITS = {"x": 2, "u": 4, "U": 8}
_ESCAPED = {
    "0": "\0", "a": "\a", "b": "\b", "t": "\t", "\t": "\t", "n": "\n", "v": "\v", "f": "\f", "r": "\r",
    "e": "\x1b", "N": "\x85", "_": "\xa0", "L": "\u2028", "P": "\u2029",
}  # fmt: skip


class Style(Enum):
    """How a part is written."""

    PLAIN = "plain"
    SINGLE = "'"
    DOUBLE = '"'
    LITERAL = "|"
    FOLDED = ">"
    MAPPING = "mapping"
    SEQUENCE = "sequence"


def source_indices(text: str, start: int, end: int, style: Style, value: str) -> list[int]:
    """For each character of `value`, and for the place behind it, its index in `text`.

    `text[start:end]` is the scalar as written, quotes and block header included. Characters that are not
    blank are found exactly; blanks where lines were folded are placed between their neighbours.
    """
    anchors = list(_anchors(text, start, end, style))
    indices: list[int] = []
    gap_start = anchors[0][0] if anchors else start
    pending = next_anchor = 0
    for character in value:
        if next_anchor < len(anchors) and character == anchors[next_anchor][2]:
            index, length, _ = anchors[next_anchor]
            indices += _blanks(text, gap_start, index, pending)
            indices.append(index)
            gap_start, pending, next_anchor = index + length, 0, next_anchor + 1
        else:
            pending += 1
    indices += _blanks(text, gap_start, end, pending)
    indices.append(gap_start + pending if gap_start + pending <= end else gap_start)
    return indices


def _blanks(text: str, start: int, end: int, count: int) -> list[int]:
    """Places for `count` blanks in the gap `text[start:end]`."""
    if count == end - start or "\n" not in text[start:end]:
        return [min(start + i, end) for i in range(count)]
    # A line break counts where the line ends; kept indentation stands before the next word.
    line_start = max(text.rfind("\n", start, end), text.rfind("\r", start, end)) + 1
    breaks = [start] * max(0, count - (end - line_start))
    return breaks + list(range(end - (count - len(breaks)), end))


def _anchors(text: str, start: int, end: int, style: Style) -> Iterator[tuple[int, int, str]]:
    """(index, length, character) of each character that is not blank, or is written as an escape."""
    if style is Style.DOUBLE:
        yield from _double_quoted(text, start + 1, end - 1)
    elif style is Style.SINGLE:
        yield from _single_quoted(text, start + 1, end - 1)
    else:
        if style in (Style.LITERAL, Style.FOLDED):  # the text begins behind the header
            start = next((i for i in range(start, end) if text[i] in "\n\r"), end)
        yield from ((i, 1, text[i]) for i in range(start, end) if text[i] not in _WHITE)


def _single_quoted(text: str, start: int, end: int) -> Iterator[tuple[int, int, str]]:
    i = start
    while i < end:
        length = 2 if text.startswith("''", i) else 1
        if text[i] not in _WHITE:
            yield i, length, text[i]
        i += length


def _double_quoted(text: str, start: int, end: int) -> Iterator[tuple[int, int, str]]:
    i = start
    while i < end:
        if text[i] != "\\":
            if text[i] not in _WHITE:
                yield i, 1, text[i]
            i += 1
            continue
        letter = text[i + 1]
        length = 2 + _ESCAPE_DIGITS.get(letter, 0)
        if letter in _ESCAPE_DIGITS:
            yield i, length, chr(int(text[i + 2 : i + length], 16))
        elif letter not in "\n\r":
            yield i, length, _ESCAPED.get(letter, letter)
        i += length


# -- the tree of a document ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class NodeSpan:
    """Where one part of a document is written.

    Attributes:
        source: the file.
        key: place of the key, for an entry of a mapping.
        value: place of the value; as wide as a scalar on one line, else of width 1.
        style: how the value is written.
        flow: whether the value stands inside `{ }` or `[ ]`.
        start: index in the source's text of a scalar's first character, quotes and block header included.
        end: index behind its last character; of a mapping or list only if it is written in braces or brackets.
        read: what a scalar was read as.
    """

    source: Source
    key: Span | None
    value: Span
    style: Style
    flow: bool
    start: int
    end: int
    read: Scalar = None

    def locate(self, offset: int, width: int) -> Span:
        """The place of one character of a scalar; the start of anything else."""
        if self.style in (Style.MAPPING, Style.SEQUENCE):
            return self.value.shifted(0, width)
        text = self.source.text
        raw = text[self.start : self.end]
        if self.style is Style.PLAIN and "\n" not in raw and "\r" not in raw:
            return self.value.shifted(min(max(offset, 0), len(raw)), width)
        assert isinstance(self.read, str), "internal: what is written as a text is read as one"
        indices = source_indices(text, self.start, self.end, self.style, self.read)
        index, end = (indices[min(max(place, 0), len(indices) - 1)] for place in (offset, offset + width))
        width = max(width, end - index) if _LINE_BREAK.search(text, index, end) is None else width
        before = Source("", text[self.start : index])
        *_, (breaks, last) = enumerate(before.lines())
        column = len(last) + (1 if breaks else self.value.column)
        return Span(self.value.file, self.value.line + breaks, column, width)


Children: TypeAlias = "dict[str, Node] | list[Node] | None"


class Node:
    """A part of a document. Its root stands for the whole, also of a scenario that several files are put together to.

    A part that does not exist has the place of its nearest ancestor.

    Attributes:
        span: where it is written.
        value: the scalar's value; None for a mapping or list.
        children: the entries of a mapping or list; None for a scalar.
        substituted: whether it is the value of a parameter, so that places inside of it mean nothing.
        left_out: whether a mistake in it was reported; it is then missing from the data, but keeps its place.
    """

    __slots__ = ("children", "left_out", "span", "substituted", "value")

    def __init__(self, span: NodeSpan, value: Scalar = None, children: Children = None) -> None:
        self.span = span
        self.value = value
        self.children = children
        self.substituted = False
        self.left_out = False

    @property
    def source(self) -> Source:
        """The file this part was written in."""
        return self.span.source

    @property
    def file(self) -> str:
        """How messages call that file."""
        return self.span.source.name

    @property
    def kind(self) -> str:
        """The kind of this part, for messages."""
        if isinstance(self.children, dict):
            return "a mapping"
        if isinstance(self.children, list):
            return "a list"
        if self.value is None:
            return "empty"
        if isinstance(self.value, bool):
            return "`true` or `false`"
        return "a text" if isinstance(self.value, str) else "a number"

    @property
    def is_empty(self) -> bool:
        """Whether nothing is written here."""
        return self.children is None and self.value is None

    @property
    def data(self) -> Data:
        """The part as plain data."""
        if isinstance(self.children, dict):
            return {key: part.data for key, part in self.children.items() if not part.left_out}
        if isinstance(self.children, list):
            return [part.data for part in self.children]
        return self.value

    # -- parts -----------------------------------------------------------------------------------------------

    def items(self) -> Iterator[tuple[str | int, Node]]:
        """Key or index and part, for each child."""
        if isinstance(self.children, dict):
            yield from self.children.items()
        elif self.children is not None:
            yield from enumerate(self.children)

    @property
    def size(self) -> int:
        """The number of children."""
        return 0 if self.children is None else len(self.children)

    @property
    def own(self) -> list[Node]:
        """The children that are written within this part, in their order there; those of patches and bases are not."""
        return sorted(
            (part for _, part in self.items() if self._holds(part)), key=lambda part: part.span.start
        )

    def _holds(self, part: Node) -> bool:
        if part.source != self.source:
            return False
        key, around = part.span.key, self.span.key
        start = self.source.index(key) if key is not None else part.span.start
        if self.is_braced:
            return self.span.start < start and part.span.end < self.span.end
        # A patch may make a section of what stands side by side in its `set`.
        deeper = key is None or around is None or key.column > around.column
        return self.span.start <= start and deeper

    def walk(self, path: DataPath = ()) -> Iterator[tuple[DataPath, Node]]:
        """This part and all below it with their paths, parents first."""
        yield path, self
        for key, part in self.items():
            yield from part.walk((*path, key))

    def entry(self, key: str | int) -> Node | None:
        """The entry of a mapping or item of a list; None if there is none."""
        if isinstance(self.children, dict):
            return self.children.get(key)  # type: ignore[arg-type]
        if isinstance(self.children, list) and isinstance(key, int) and 0 <= key < len(self.children):
            return self.children[key]
        return None

    def get(self, path: DataPath) -> Node | None:
        """The part at a path below this one; None if there is none."""
        part: Node | None = self
        for step in path:
            part = part.entry(step) if part is not None else None
        return part

    def at(self, path: DataPath) -> Node:
        """The part at a path below this one, which must exist."""
        part = self.get(path)
        assert part is not None, f"internal: there is nothing at {path}"
        return part

    def nearest(self, path: DataPath) -> Node:
        """The part at a path below this one or, if there is none, its nearest ancestor."""
        part = self
        for step in path:
            below = part.entry(step)
            if below is None:
                break
            part = below
        return part

    def text(self, key: str) -> str | None:
        """The text at a key of a mapping; None for anything else."""
        entry = self.entry(key)
        return entry.value if entry is not None and isinstance(entry.value, str) else None

    # -- places ----------------------------------------------------------------------------------------------

    def locate(self, path: DataPath = (), offset: int = 0, width: int = 1) -> Span:
        """The place of the character `offset` (from 0) of the text at a path; the place of a parameter's value."""
        part = self.nearest(path)
        return part.span.locate(0 if part.substituted else offset, width)

    def value_span(self, path: DataPath = ()) -> Span:
        """The place of the value at a path."""
        return self.nearest(path).span.value

    def whole_span(self, path: DataPath = ()) -> Span:
        """The place of all that is written of the value at a path, which may be several lines."""
        part = self.nearest(path)
        return Span(
            part.file, part.span.value.line, part.span.value.column, max(1, part.end - part.span.start)
        )

    def key_span(self, path: DataPath = ()) -> Span:
        """The place of the key at a path; of the value, for an item of a list and for the root."""
        span = self.nearest(path).span
        return span.key or span.value

    @property
    def is_braced(self) -> bool:
        """Whether it is a mapping or list in braces or brackets."""
        return self.children is not None and self.source.text[self.span.start : self.span.start + 1] in "{["

    @property
    def end(self) -> int:
        """The index behind what is written of it in its file."""
        if not self.is_braced and (own := self.own):
            return own[-1].end
        return self.span.start + len(self.source.text[self.span.start : self.span.end].rstrip())

    # -- changes ---------------------------------------------------------------------------------------------

    def put(self, data: Data) -> None:
        """Replace this part by data, all of which gets the place of this part."""
        self.value, self.children = None, None
        if isinstance(data, dict):
            self.children = {key: self._here(part) for key, part in data.items()}
        elif isinstance(data, list):
            self.children = [self._here(part) for part in data]
        else:
            self.value = data

    def _here(self, data: Data) -> Node:
        part = Node(self.span)
        part.put(data)
        return part

    def copy(self) -> Node:
        """This part with all below it, free to be changed."""
        copied = Node(self.span, self.value)
        copied.substituted, copied.left_out = self.substituted, self.left_out
        if isinstance(self.children, dict):
            copied.children = {key: part.copy() for key, part in self.children.items()}
        elif isinstance(self.children, list):
            copied.children = [part.copy() for part in self.children]
        return copied
