"""What differs between the files of a `one_of`, as values that depend on which was drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from socialai_dsl.semantics.build import all_of, any_of, one_of
from socialai_dsl.semantics.terms import Compare, Const, Select, Term, Type
from socialai_dsl.semantics.wording import spoken

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver

V = TypeVar("V")


def register_of(member: str) -> str:
    """The register that says which file was drawn."""
    return f"{member}.one_of"


def drawn(resolver: Resolver, member: str, among: Iterable[int]) -> Term | None:
    """Whether one of these alternatives of a member was drawn; None if that is certain."""
    numbers = sorted(set(among))
    if len(numbers) == len(resolver.symbols.alternatives[member]):
        return None
    which = resolver.registers.read(register_of(member))
    return one_of(which, [Const(which.type, number) for number in numbers])


def by_value(values: Sequence[V]) -> dict[V, list[int]]:
    """Value -> the alternatives that have it, in order of appearance."""
    found: dict[V, list[int]] = {}
    for number, value in enumerate(values):
        found.setdefault(value, []).append(number)
    return found


def select(resolver: Resolver, member: str, terms: Sequence[Term]) -> Term:
    """The value that belongs to the alternative that was drawn."""
    kinds = {term.type.kind for term in terms}
    assert len(kinds) == 1, "internal: alternatives of different kinds"
    if len(set(terms)) == 1:
        return terms[0]
    if kinds == {"text"}:
        return _text(resolver, member, terms)
    type_ = terms[0].type
    for term in terms[1:]:
        type_ = replace(type_, low=min(type_.low, term.type.low), high=max(type_.high, term.type.high))
    return _cases(resolver, member, [_of_type(term, type_) for term in terms], type_)


def _of_type(term: Term, type_: Type) -> Term:
    return replace(term, type=type_) if isinstance(term, Const) else term


def _cases(resolver: Resolver, member: str, terms: Sequence[Term], type_: Type) -> Term:
    which = resolver.registers.read(register_of(member))
    default = Counter(terms).most_common(1)[0][0]
    cases = [
        (Compare("==", which, Const(which.type, number)), term)
        for number, term in enumerate(terms)
        if term != default
    ]
    return Select(type_, tuple(case for case, _ in cases), tuple(term for _, term in cases), default)


def _text(resolver: Resolver, member: str, terms: Sequence[Term]) -> Term:
    """Texts have words of their own, so the result has the words of all."""
    words: dict[str, None] = {}
    for term in terms:
        values = [term.value] if isinstance(term, Const) else range(term.type.low, term.type.high + 1)
        words |= {spoken(term.type, value): None for value in values}
    type_ = Type("text", 0, len(words) - 1, tuple(words))
    if len(words) == 1:
        return Const(type_, 0)
    if all(isinstance(term, Const) for term in terms):
        known = [
            Const(type_, type_.words.index(spoken(t.type, t.value))) for t in terms if isinstance(t, Const)
        ]
        return _cases(resolver, member, known, type_)
    conditions = {word: any_of(_says(resolver, member, terms, word)) for word in words}
    first, *others = type_.words
    return Select(
        type_,
        tuple(conditions[word] for word in others),
        tuple(Const(type_, type_.words.index(word)) for word in others),
        Const(type_, type_.words.index(first)),
    )


def _says(resolver: Resolver, member: str, terms: Sequence[Term], word: str) -> Iterable[Term]:
    for term, numbers in by_value(terms).items():
        chosen = drawn(resolver, member, numbers)
        for value in range(term.type.low, term.type.high + 1):
            if spoken(term.type, value) != word or (isinstance(term, Const) and value != term.value):
                continue
            equal = None if isinstance(term, Const) else Compare("==", term, Const(term.type, value))
            yield all_of(condition for condition in (chosen, equal) if condition is not None)
