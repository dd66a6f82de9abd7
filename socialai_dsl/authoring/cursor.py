"""The place of a position in a document, also in an unfinished line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Data, DataPath, Node, Source, Span, Style

_HERE: Final = "zzz_here_zzz"
_WORD: Final = re.compile(r"\$?[A-Za-z_][A-Za-z0-9_]*")
_PARTIAL: Final = re.compile(r"\$?[A-Za-z0-9_]*$")
_REST: Final = re.compile(r"[A-Za-z0-9_]*")


@dataclass(frozen=True)
class Cursor:
    """A place in a document.

    Attributes:
        path: of the entry or item it is in.
        is_key: whether it is in the entry's key.
        word: the word there; as far as it is written, for a completion.
        before: the key or value up to that word.
        data: the document with what is written so far.
        span: of the word.
    """

    path: DataPath
    is_key: bool
    word: str
    before: str
    data: Data
    span: Span


def word_at(document: Node, line: int, column: int) -> Cursor | None:
    """The word at a position, from 1, of a document; None if there is none."""
    text = document.source.line(line)
    match = next((m for m in _WORD.finditer(text) if m.start() < column <= m.end() + 1), None)
    if match is None:
        return None
    span = document.source.span(line, match.start() + 1, len(match.group()))
    index = sum(len(part) + 1 for part in document.source.text.split("\n")[: line - 1]) + match.start()
    for path, part in document.walk():
        node, key = part.span, part.span.key
        if key is not None and key.line == line and key.column <= span.column < key.column + key.width:
            before = text[key.column - 1 : match.start()]
            return Cursor(path, True, match.group(), before, document.data, span)
        if node.style not in (Style.MAPPING, Style.SEQUENCE) and node.start <= index < node.end:
            before = document.source.text[node.start : index]
            return Cursor(path, False, match.group(), before, document.data, span)
    return None


def completion_at(text: str, line: int, column: int) -> Cursor | None:
    """The unfinished word at a position, from 1; None if there is none.

    The word there is replaced by a marker as a value and as a key, first with all that follows, then without.
    """
    given = list(Source("", text).lines())
    if not 1 <= line <= len(given):
        return None
    current = given[line - 1]
    head = current[: column - 1]
    word = _PARTIAL.search(head)
    assert word is not None, "internal: an empty match is one"
    start = head[: word.start()]
    rest = current[column - 1 :]
    tail = rest[len(_REST.match(rest).group()) :]  # type: ignore[union-attr]
    above, below = given[: line - 1], given[line:]
    span = Span("", line, word.start() + 1, max(1, len(word.group())))
    for marked in (_HERE, f"{_HERE}: 0"):
        for end, after in ((tail, below), (_closing("\n".join([*above, start])), [])):
            attempt = "\n".join([*above, start + marked + end, *after])
            found = _find(attempt)
            if found is not None:
                path, is_key, before, data = found
                return Cursor(path, is_key, word.group(), before, data, span)
    return None


def _find(text: str) -> tuple[DataPath, bool, str, Data] | None:
    try:
        document = read_document(Source("", text))
    except ScenarioError:
        return None
    for path, part in document.walk():
        if path and isinstance(path[-1], str) and _HERE in path[-1]:
            return path, True, path[-1].partition(_HERE)[0], document.data
        if isinstance(part.value, str) and _HERE in part.value:
            return path, False, part.value.partition(_HERE)[0], document.data
    return None


def _closing(text: str) -> str:
    """The brackets that are still to be closed at the end of a text."""
    closing: list[str] = []
    for character in text:
        if character in "[{":
            closing.append("]" if character == "[" else "}")
        elif closing and character == closing[-1]:
            closing.pop()
    return "".join(reversed(closing))
