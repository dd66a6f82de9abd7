"""Utterance classes: utterances that no rule of the program tells apart share a number."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from socialai_dsl.semantics.plans import Activity, Checked
from socialai_dsl.semantics.terms import HeardNoun, Pattern, Speaker
from socialai_dsl.trees import every
from socialai_dsl.vocabulary import normal

_Kind = TypeVar("_Kind")

SILENCE = 0
OTHER = 1
NO_NOUN = -1
_WORD = 32


class Classes:
    """Numbers the classes: 0 silence, 1 said but nothing any rule waits for, then one for each set of patterns.

    Attributes:
        of_pair: class of each pair that the agent says. of_performed: class of each pair that an NPC says as part of a
        sequence; empty where nobody performs one.
        speakers_matter: whether a rule asks who said something, or with which noun.
        sets: sets of classes that a rule waits for and wants to know more about.
        said: for each NPC and pattern that somebody asks about, the lines of that NPC that fit it.
    """

    def __init__(self, checked: Checked) -> None:
        self.patterns = list(dict.fromkeys(every(Pattern, checked)))
        self.speakers_matter = any(True for kind in (Speaker, HeardNoun) for _ in every(kind, checked))
        self.sets: list[frozenset[int]] = []
        self.said: dict[tuple[int, Pattern | None], frozenset[int]] = {}
        self._nouns = {normal(text): noun for pattern in self.patterns for text, noun in pattern.nouns}
        self._numbers: dict[frozenset[int], int] = {frozenset(): OTHER}
        self._texts = [frozenset(normal(text) for text in pattern.said_by_npcs) for pattern in self.patterns]
        nouns = len(checked.nouns)
        self.of_pair = [self._number(self._of_pair(k, nouns)) for k in range(len(checked.templates) * nouns)]
        for texts in self._texts:
            for text in sorted(texts):
                self.of_text(text)
        performs = any(activity.name == "perform" for activity in every(Activity, checked.frames))
        self.of_performed = [
            self._number(self._of_pair(k, nouns) | self._of_text(text))
            for k, text in enumerate(texts_of_pairs(checked))
            if performs
        ]

    def _number(self, signature: frozenset[int]) -> int:
        return self._numbers.setdefault(signature, len(self._numbers) + 1)

    def of_text(self, text: str) -> int:
        """Class of what an NPC says."""
        return self._number(self._of_text(text))

    def _of_text(self, text: str) -> frozenset[int]:
        return frozenset(i for i, texts in enumerate(self._texts) if normal(text) in texts)

    def _of_pair(self, k: int, nouns: int) -> frozenset[int]:
        return frozenset(i for i, pattern in enumerate(self.patterns) if divmod(k, nouns) in pattern.pairs)

    def matching(self, pattern: Pattern) -> frozenset[int]:
        """The classes whose utterances fit the pattern."""
        position = self.patterns.index(pattern)
        return frozenset(number for signature, number in self._numbers.items() if position in signature)

    def noun_in(self, text: str) -> int:
        """The noun that a pattern finds in what an NPC says."""
        return self._nouns.get(normal(text), NO_NOUN)

    def set_of(self, patterns: Iterable[Pattern]) -> int:
        """The number of the set of all classes whose utterances fit one of the patterns."""
        wanted = frozenset[int]().union(*map(self.matching, patterns))
        if wanted not in self.sets:
            self.sets.append(wanted)
        return self.sets.index(wanted)

    @property
    def words_of_a_set(self) -> int:
        """How many words of 32 classes each a set has."""
        return -(-self.count // _WORD) if self.sets else 0

    def set_words(self) -> list[int]:
        """The sets as words, one behind the other."""
        return [
            sum(1 << number % _WORD for number in wanted if number // _WORD == word)
            for wanted in self.sets
            for word in range(self.words_of_a_set)
        ]

    @property
    def count(self) -> int:
        """Number of classes, silence included."""
        return len(self._numbers) + 1


def texts_of_pairs(checked: Checked) -> list[str]:
    """Texts of all pairs, row by row."""
    return [template.replace("<noun>", noun) for template in checked.templates for noun in checked.nouns]
