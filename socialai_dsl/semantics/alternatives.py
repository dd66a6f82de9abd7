"""What differs between the files of a `one_of`, as values that depend on which was drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

from socialai_dsl.semantics.build import all_of, one_of
from socialai_dsl.semantics.terms import Compare, Const, Select, Term, Type
from socialai_dsl.semantics.wording import spoken

V = TypeVar("V")


def drawn(which: Term | None, among: Iterable[int]) -> Term | None:
    """Whether the file that was drawn, whose number `which` is, is one of these; None if that is certain."""
    numbers = sorted(set(among))
    if which is None or len(numbers) == which.type.size:
        return None
    return one_of(which, [Const(which.type, number) for number in numbers])


def by_value(values: Sequence[V]) -> dict[V, list[int]]:
    """Value -> the alternatives that have it, in order of appearance."""
    found: dict[V, list[int]] = {}
    for number, value in enumerate(values):
        found.setdefault(value, []).append(number)
    return found


def select(which: Term | None, terms: Sequence[Term]) -> Term:
    """The value that belongs to the file that was drawn, whose number `which` is."""
    kinds = {term.type.kind for term in terms}
    assert len(kinds) == 1, "internal: alternatives of different kinds"
    if len(set(terms)) == 1:
        return terms[0]
    assert which is not None, "internal: nothing is drawn, and the values differ"
    if kinds == {"text"}:
        return _text(which, terms)
    type_ = terms[0].type
    for term in terms[1:]:
        type_ = replace(type_, low=min(type_.low, term.type.low), high=max(type_.high, term.type.high))
    return _cases(which, [_of_type(term, type_) for term in terms], type_)


def _of_type(term: Term, type_: Type) -> Term:
    return replace(term, type=type_) if isinstance(term, Const) else term


def _cases(which: Term, terms: Sequence[Term], type_: Type) -> Term:
    default = Counter(terms).most_common(1)[0][0]
    cases = [
        (Compare("==", which, Const(which.type, number)), term)
        for number, term in enumerate(terms)
        if term != default
    ]
    return Select(type_, tuple(case for case, _ in cases), tuple(term for _, term in cases), default)


def _text(which: Term, terms: Sequence[Term]) -> Term:
    """Texts have words of their own, so the result has the words of all."""
    return text_of(
        [(Compare("==", which, Const(which.type, number)), term) for number, term in enumerate(terms)]
    )


def of_each(who: Term, values: Sequence[Term]) -> Term:
    """The value that belongs to whichever entity is meant; `values` in the order of those it can be."""
    numbers = [who.value] if isinstance(who, Const) else range(who.type.low, who.type.high + 1)
    cases = [
        (Compare("==", who, Const(who.type, number)), value)
        for number, value in zip(numbers, values, strict=True)
    ]
    if len(set(values)) == 1:
        return values[0]
    if values[0].type.kind == "text":
        return text_of(cases)
    low, high = min(v.type.low for v in values), max(v.type.high for v in values)
    *others, (_, last) = cases
    conditions, chosen = tuple(c for c, _ in others), tuple(v for _, v in others)
    return Select(replace(last.type, low=low, high=high), conditions, chosen, last)


def text_of(cases: Sequence[tuple[Term, Term]]) -> Term:
    """The text beside the condition that holds (one does), of one type that has the words of all."""
    words: dict[str, None] = {}
    for _, term in cases:
        values = [term.value] if isinstance(term, Const) else range(term.type.low, term.type.high + 1)
        words |= {spoken(term.type, value): None for value in values}
    type_ = Type("text", 0, len(words) - 1, tuple(words))
    if len(words) == 1:
        return Const(type_, 0)
    if len(cases) == 1:
        return cases[0][1]
    choices = [case for condition, term in cases for case in _words_of(condition, term, type_)]
    default = Counter(value for _, value in choices).most_common(1)[0][0]
    kept = [(condition, value) for condition, value in choices if value != default]
    return Select(type_, tuple(c for c, _ in kept), tuple(v for _, v in kept), default)


def _words_of(condition: Term, term: Term, type_: Type) -> Iterator[tuple[Term, Const]]:
    """Each word that a text can be, with the condition that it is."""
    if isinstance(term, Const):
        yield condition, Const(type_, type_.words.index(spoken(term.type, term.value)))
        return
    for value in range(term.type.low, term.type.high + 1):
        equal = Compare("==", term, Const(term.type, value))
        yield all_of([condition, equal]), Const(type_, type_.words.index(spoken(term.type, value)))
