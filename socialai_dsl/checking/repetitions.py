"""This module shows a mistake once that many places of a file repeat."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from socialai_dsl.diagnostics import Diagnostic

_OF_ONE_NAME: Final = frozenset({"S201", "S206", "S301", "S401"})
"""What is wrong with a name or an utterance, wherever it is used."""


_WORD: Final = re.compile(r"`[^`]+`")


def said_once(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The findings, with what is unknown in many places shown at the first: mostly its declaration has the slip."""
    everything = list(found)
    alike: dict[tuple[str, ...], list[Diagnostic]] = {}
    for d in everything:
        alike.setdefault(_cause(d), []).append(d)
    for d in everything:
        first, *others = alike[_cause(d)]
        if d.code not in _OF_ONE_NAME or not others:
            yield d
        elif d is first:
            yield replace(d, hint="; ".join(filter(None, (d.hint, _repeated(d, others)))))


def _cause(found: Diagnostic) -> tuple[str, ...]:
    """What findings of one mistake have in common: an unknown name is one, whatever it was to stand for."""
    word = _WORD.search(found.message)
    if found.code == "S201" and found.suggestion is not None and word is not None:
        return found.code, word[0], found.suggestion
    return found.code, found.text


def _repeated(first: Diagnostic, others: Sequence[Diagnostic]) -> str:
    """Where else it is: lines of the same file, and other files."""
    lines = sorted({d.span.line for d in others if d.span.file == first.span.file} - {first.span.line})
    files = sorted({d.span.file for d in others} - {first.span.file})
    where = ([f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines))}"] if lines else []) + files
    return f"the same is in {' and in '.join(where)}" if where else "the same is in this line once more"
