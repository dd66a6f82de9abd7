"""Utterance classes: utterances that no rule of the program tells apart share a number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from socialai_dsl.semantics.terms import Checked, Pattern

SILENCE = 0
OTHER = 1


def normal(text: str) -> str:
    """A text as hearing compares it: without case and a final mark."""
    return text.strip().casefold().rstrip(".!?").rstrip()


class Classes:
    """Numbers the classes: 0 silence, 1 said but nothing any rule waits for, then one for each set of patterns."""

    def __init__(self, checked: Checked) -> None:
        self.patterns = list(dict.fromkeys(_patterns(checked)))
        self._numbers: dict[frozenset[int], int] = {frozenset(): OTHER}
        self._texts = [frozenset(normal(text) for text in pattern.said_by_npcs) for pattern in self.patterns]
        nouns = len(checked.nouns)
        self.of_pair = [
            self._number(frozenset(i for i, p in enumerate(self.patterns) if divmod(k, nouns) in p.pairs))
            for k in range(len(checked.templates) * nouns)
        ]
        for texts in self._texts:
            for text in sorted(texts):
                self.of_text(text)

    def _number(self, signature: frozenset[int]) -> int:
        return self._numbers.setdefault(signature, len(self._numbers) + 1)

    def of_text(self, text: str) -> int:
        """Class of what an NPC says."""
        return self._number(frozenset(i for i, texts in enumerate(self._texts) if normal(text) in texts))

    def matching(self, pattern: Pattern) -> frozenset[int]:
        """The classes whose utterances fit the pattern."""
        position = self.patterns.index(pattern)
        return frozenset(number for signature, number in self._numbers.items() if position in signature)

    @property
    def count(self) -> int:
        """Number of classes, silence included."""
        return len(self._numbers) + 1


def _patterns(node: Any) -> Iterator[Pattern]:
    if isinstance(node, Pattern):
        yield node
    elif isinstance(node, tuple):
        for item in node:
            yield from _patterns(item)
    elif is_dataclass(node):
        for item in fields(node):
            yield from _patterns(getattr(node, item.name))
