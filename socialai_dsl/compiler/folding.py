"""Constant folding: utterance classes, and terms simplified by what is known when a rule is looked at."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

from socialai_dsl.grammar.ast import every, rebuilt
from socialai_dsl.program import Body
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import Activity, CheckedScenario
from socialai_dsl.semantics.resolver import texts_of
from socialai_dsl.semantics.terms import (
    BOOL,
    Const,
    HeardNoun,
    Line,
    Pattern,
    Speaker,
    Term,
    compute,
    may_find_nothing,
    numbers_of,
)
from socialai_dsl.vocabulary import normal

SILENCE = 0
OTHER = 1
NO_NOUN = -1
_WORD = 32


class Classes:
    """Numbers the classes: 0 silence, 1 said but nothing any rule waits for, then one for each set of patterns.

    Attributes:
        of_pair: class of each pair that the agent says. of_performed: class of each pair that an NPC says as part of a
        sequence; empty where nobody performs one.
        speakers_matter: whether a rule asks who said something, or what stood in its slots.
        sets: sets of classes that a rule waits for and wants to know more about.
        said: for each NPC and pattern that a condition asks about, the lines of that NPC that fit it.
    """

    def __init__(self, checked: CheckedScenario) -> None:
        self.patterns = list(dict.fromkeys(every(Pattern, checked)))
        self.speakers_matter = any(True for kind in (Speaker, HeardNoun) for _ in every(kind, checked))
        self.sets: list[frozenset[int]] = []
        self.said: dict[tuple[int, Pattern | None], frozenset[int]] = {}
        self._nouns: dict[str, int] = {}
        for text, noun in (found for pattern in self.patterns for found in pattern.nouns):
            known = self._nouns.get(normal(text), noun)
            self._nouns[normal(text)] = checked.sentences.both(known, noun)
        self._numbers: dict[frozenset[int], int] = {frozenset(): OTHER}
        self._texts = [frozenset(normal(text) for text in pattern.said_by_npcs) for pattern in self.patterns]
        self._addressees = _Addressees(checked)
        nouns = checked.sentences.fillings
        pairs = range(len(checked.sentences.templates) * nouns)
        self.of_pair = [
            self._number(
                self._addressees.joined(self._of_pair(k, nouns), self._addressees.of_filling(k % nouns))
            )
            for k in pairs
        ]
        for texts in self._texts:
            for text in sorted(texts):
                self.of_text(text)
        for line in every(Line, checked):
            if line.to is not None:
                for text, number in product(texts_of(line), numbers_of(line.to.term)):
                    self.of_text(text, number)
        performs = bool(checked.seated) or any(
            activity.name == "perform" for activity in every(Activity, checked.frames)
        )
        self.of_performed = [
            self._number(self._of_pair(k, nouns) | self._of_text(text))
            for k, text in enumerate(checked.sentences.by_number())
            if performs
        ]

    def _number(self, signature: frozenset[int]) -> int:
        return self._numbers.setdefault(signature, len(self._numbers) + 1)

    def of_text(self, text: str, to: int | None = None) -> int:
        """Class of what an NPC says, perhaps to a single hearer."""
        return self._number(self._addressees.joined(self._of_text(text), to))

    def _of_text(self, text: str) -> frozenset[int]:
        return frozenset(i for i, texts in enumerate(self._texts) if normal(text) in texts)

    def _of_pair(self, k: int, nouns: int) -> frozenset[int]:
        return frozenset(i for i, pattern in enumerate(self.patterns) if divmod(k, nouns) in pattern.pairs)

    def matching(self, pattern: Pattern) -> frozenset[int]:
        """The classes whose utterances fit the pattern."""
        position = self.patterns.index(pattern)
        return frozenset(
            number
            for signature, number in self._numbers.items()
            if position in signature and self._addressees.hears(pattern, signature)
        )

    def noun_in(self, text: str) -> int:
        """The filling that patterns find in what an NPC says."""
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


class _Addressees:
    """Whom utterances address: of an addressed one the signature has, besides its patterns, -1 - the member's number.

    Attributes:
        matter: whether it matters to any pattern whom an utterance addresses.
    """

    def __init__(self, checked: CheckedScenario) -> None:
        self._slot, self._words = checked.addressing or ("", ())
        self._checked = checked
        self.matter = any(pattern.hearer is not None for pattern in every(Pattern, checked))

    def of_filling(self, filling: int) -> int | None:
        """The member whom a sentence of the agent addresses."""
        sentences = self._checked.sentences
        for slot, choice in zip(sentences.slots, sentences.choices(filling), strict=True):
            if slot.name == self._slot:
                return None if choice is None else self._words[choice]
        return None

    def joined(self, patterns: frozenset[int], to: int | None) -> frozenset[int]:
        """The signature of an utterance."""
        return patterns | {-1 - to} if self.matter and to is not None and patterns else patterns

    def hears(self, pattern: Pattern, signature: frozenset[int]) -> bool:
        """Whether the ears of a pattern hear what has this signature, and want to."""
        if pattern.hearer is None:
            return True
        to = next((-1 - part for part in signature if part < 0), None)
        if to not in (None, pattern.hearer) and not self._checked.overheard:
            return False
        return pattern.addressed in (None, to == pattern.hearer)


# -- terms simplified by what is known when a rule is looked at: this sorts rules by trigger -----------------


TRUE = Const(BOOL, 1)
FALSE = Const(BOOL, 0)
SEVERAL = -1
"""Stands for "several classes were heard at once", where each rule has to look for itself."""


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts at compile time; None means unknown.

    Attributes:
        said: utterance class of the agent this step. action: its body action.
        heard: the class in the inbox, or SEVERAL.
    """

    said: int | None = None
    action: int | None = None
    heard: int | None = None


def fold(term: Term, facts: Facts, classes: Classes) -> Term:
    """An equal term with everything decided that the facts decide."""
    if isinstance(term, terms.Said) and facts.said is not None:
        return _truth(facts.said in classes.matching(term.pattern))
    if isinstance(term, terms.Spoke) and facts.said is not None:
        return _truth(facts.said != SILENCE)
    if isinstance(term, terms.Heard) and facts.heard not in (None, SEVERAL):
        return _truth(any(facts.heard in classes.matching(pattern) for pattern in term.patterns))
    if isinstance(term, terms.World) and term.name == "action" and facts.action is not None:
        return Const(term.type, facts.action)
    toggles = facts.action in (None, Body.TOGGLE)
    if isinstance(term, terms.PokedNow) and not toggles and not may_find_nothing(term.entity):
        return FALSE
    return _decide(rebuilt(term, lambda part: fold(part, facts, classes)))


def fold_whole(term: Term, facts: Facts, classes: Classes) -> Term:
    """As `fold`, for a condition as a whole, which is false as well if something in it finds nothing."""
    folded = fold(term, facts, classes)
    return FALSE if _never_true(folded) else folded


def _never_true(term: Term) -> bool:
    if isinstance(term, terms.Logic):
        return (any if term.op == "and" else all)(map(_never_true, term.args))
    return term == FALSE


def substitute(term: Term, name: str, value: Const) -> Term:
    """The term with the quantifier's variable replaced by one of its items."""
    if isinstance(term, terms.Variable):
        return value if term.name == name else term
    if isinstance(term, terms.Quantification) and term.variable == name:
        return term
    found: Term = rebuilt(term, lambda part: substitute(part, name, value))
    return found


def mentions(term: Any, kind: type, such: Callable[[Any], bool] = lambda _: True) -> bool:
    """Whether a term of this kind, and such a one, stands anywhere in the tree."""
    return any(map(such, every(kind, term)))


def _truth(value: bool) -> Const:
    return TRUE if value else FALSE


def _decide(term: Term) -> Term:
    if isinstance(term, terms.Not) and isinstance(term.arg, Const):
        return _truth(not term.arg.value)
    if isinstance(term, terms.Compare) and isinstance(term.left, Const) and isinstance(term.right, Const):
        return _truth(terms.COMPARISONS[term.op](term.left.value, term.right.value))
    if isinstance(term, terms.Logic):
        return _decide_logic(term)
    if isinstance(term, terms.Operation):
        return _decide_operation(term)
    if isinstance(term, terms.Compare) and isinstance(term.left, terms.Select):
        return _decide_compared(term, term.left)
    if isinstance(term, terms.Select):
        return _decide_select(term)
    if isinstance(term, terms.Quantification) and term.op in ("any", "all") and not term.cells:
        return _decide_quantified(term)
    if isinstance(term, terms.ReadEach):
        return term.known() or term
    return term


def _decide_operation(term: terms.Operation) -> Term:
    """A sum of known values, and the like; left as it is where its type would cut it."""
    values = [arg.value for arg in term.args if isinstance(arg, Const)]
    if term.op not in _ARITHMETIC or len(values) < len(term.args):
        return term
    result = compute(term.op, *values)
    return Const(term.type, result) if term.type.low <= result <= term.type.high else term


_ARITHMETIC: Final = frozenset(("+", "-", "*", "//", "%", "min", "max"))


def _decide_logic(term: terms.Logic) -> Term:
    decisive = 0 if term.op == "and" else 1
    rest: list[Term] = []
    for arg in term.args:
        if not isinstance(arg, Const):
            rest.append(arg)
        elif bool(arg.value) == bool(decisive):
            if not any(map(may_find_nothing, rest)):
                return _truth(bool(decisive))
            rest.append(arg)  # what stands before it is still asked: if it finds nothing, all of it is false
            break
    if not rest:
        return _truth(not decisive)
    return rest[0] if len(rest) == 1 else replace(term, args=tuple(rest))


def _decide_select(term: terms.Select) -> Term:
    """Without conditions that never hold, and without what stands after one that always does."""
    kept = []
    default = term.default
    for condition, value in zip(term.conditions, term.values, strict=True):
        if not isinstance(condition, Const):
            kept.append((condition, value))
        elif condition.value:
            default = value
            break
    is_default = isinstance(default, Const) and not any(may_find_nothing(asked) for asked, _ in kept)
    if all(value == default for _, value in kept) and (not kept or is_default):
        return default
    conditions, values = zip(*kept, strict=True)
    return replace(term, conditions=conditions, values=values, default=default)


def _decide_compared(term: terms.Compare, left: terms.Select) -> Term:
    """Known values compared with a known value: which conditions make it true is known as well."""
    if not all(isinstance(part, Const) for part in (term.right, left.default, *left.values)):
        return term
    values = tuple(_decide(replace(term, left=value)) for value in left.values)
    default = _decide(replace(term, left=left.default))
    return _decide_select(terms.Select(BOOL, left.conditions, values, default))


def _decide_quantified(term: terms.Quantification) -> Term:
    """Any and all are an `or` and an `and` over the items."""
    parts = tuple(_decided(substitute(term.condition or TRUE, term.variable, item)) for item in term.items)
    if not parts:
        return _truth(term.op == "all")
    op: Any = "or" if term.op == "any" else "and"
    return _decide(terms.Logic(op, parts))


def _decided(term: Term) -> Term:
    """A term some of whose innermost parts have become known."""
    return _decide(rebuilt(term, _decided))
