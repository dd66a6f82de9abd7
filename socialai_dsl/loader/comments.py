"""The comments of a YAML file, found between the places that the parser's events name."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass

from socialai_dsl.source import Node, Span, Style

_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n|$)")


@dataclass(frozen=True)
class Comment:
    """One comment.

    Attributes:
        text: from the `#` to the end of the line, without trailing blanks.
        span: where; as wide as the text.
        alone: whether nothing stands before it on its line.
    """

    text: str
    span: Span
    alone: bool


def comments_of(document: Node) -> list[Comment]:
    """The comments of a document, in order."""
    text = document.source.text
    starts, ends = _written(document)
    found: list[Comment] = []
    begin = 0
    for number, match in enumerate(_LINE.finditer(text), 1):
        line = match.group().rstrip("\r\n")
        column = _comment_in(line, begin, starts, ends)
        if column is not None:
            comment = line[column:].rstrip(" \t")
            span = Span(document.source.name, number, column + 1, len(comment))
            found.append(Comment(comment, span, not line[:column].strip(" \t")))
        begin = match.end()
    return found


def _comment_in(line: str, begin: int, starts: list[int], ends: list[int]) -> int | None:
    """Where on a line, which begins at an index of the text, a comment begins."""
    column = line.find("#")
    while column >= 0:
        before = bisect_right(starts, begin + column) - 1
        inside = before >= 0 and begin + column < ends[before]
        if not inside:
            return column
        column = line.find("#", column + 1)
    return None


def _written(document: Node) -> tuple[list[int], list[int]]:
    """First indices, and indices behind the last, of the texts in which `#` begins no comment; sorted."""
    lines = [0]
    lines += [match.end() for match in _LINE.finditer(document.source.text) if match.group()]
    areas: list[tuple[int, int]] = []
    for node in (part.span for _, part in document.walk()):
        if node.key is not None:
            start = lines[node.key.line - 1] + node.key.column - 1
            areas.append((start, start + node.key.width))
        if node.style in (Style.MAPPING, Style.SEQUENCE):
            continue
        start = node.start
        if node.style in (Style.LITERAL, Style.FOLDED):
            # A comment may follow the header `|` or `>`; the text begins on the next line.
            header = _LINE.match(document.source.text, start)
            start = header.end() if header else start
        areas.append((start, node.end))
    areas.sort()
    return [start for start, _ in areas], [end for _, end in areas]
