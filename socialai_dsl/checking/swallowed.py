"""Texts that a comment has cut short: `say: You are #1`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from socialai_dsl.diagnostics import Diagnostic, Severity
from socialai_dsl.loader import Data, Resolved
from socialai_dsl.loader.offsets import Style
from socialai_dsl.source import DataPath, Span

_SPOKEN: Final = frozenset({"say", "hears", "templates", "nouns", "name"})
_GLUED: Final = re.compile(r"[ \t]+(#\w\S*)")
"""A comment whose text begins without a blank, as in `#1`."""


def swallowed(resolved: Resolved) -> Iterator[Diagnostic]:
    """A warning for each text that is written without quotes and seems to go on behind a `#`."""
    for path, text in _texts(resolved.data, ()):
        node = resolved.node_span(path)
        document, _ = resolved.find(path)
        comment = _GLUED.match(document.source.text, node.end) if node.style is Style.PLAIN else None
        if comment is None:
            continue
        width = len(comment[1])
        place = Span(
            node.value.file, node.value.line, node.value.column + comment.start(1) - node.start, width
        )
        message = f"`{comment[1]}` is a comment, so the text is only `{text}`"
        hint = f'write "{text} {comment[1]}" if it belongs to the text, else a blank behind the `#`'
        yield Diagnostic("W009", message, place, Severity.WARNING, hint)


def _texts(part: Data, path: DataPath) -> Iterator[tuple[DataPath, str]]:
    """What is said, heard or called, with its place."""
    if isinstance(part, dict):
        for key, value in part.items():
            yield from _texts(value, (*path, key))
    elif isinstance(part, list):
        for i, value in enumerate(part):
            yield from _texts(value, (*path, i))
    elif isinstance(part, str):
        key = next((step for step in reversed(path) if isinstance(step, str)), "")
        if key in _SPOKEN or "with" in path[-2:-1]:
            yield path, part
