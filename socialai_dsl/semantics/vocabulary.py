"""Every word that may be heard, in a fixed order, so that all variants of a scenario number them alike."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain

from socialai_dsl.schema import UtteranceGrammar
from socialai_dsl.semantics.terms import Line, Term, Type
from socialai_dsl.semantics.utterances import texts_of
from socialai_dsl.semantics.wording import spoken
from socialai_dsl.vocabulary import words


def words_in_order(
    grammar: UtteranceGrammar, names: Iterable[Term], lines: Mapping[str, Sequence[Line]]
) -> tuple[str, ...]:
    """The words of the grammar, then of the names, then of what each member can say, by first appearance.

    Args:
        grammar: templates come first, then nouns.
        names: the name of each member of the cast, in order.
        lines: member -> its lines in the order of its frame.
    """
    texts = chain(
        (template.replace("<noun>", " ") for template in grammar.templates),
        (str(noun) for noun in grammar.nouns),
        (word for name in names for word in _values(name.type)),
        (text for said in lines.values() for line in said for text in _texts(line)),
    )
    return tuple(dict.fromkeys(word for text in texts for word in words(text)))


def _texts(line: Line) -> Iterator[str]:
    """The pieces of a line, each value with all its words; then whole texts, where pieces run into each other."""
    for part in line.parts:
        yield from [part] if isinstance(part, str) else _values(part.type)
    if _runs_together(line):
        yield from texts_of(line)


def _values(type_: Type) -> list[str]:
    return [spoken(type_, value) for value in range(type_.low, type_.high + 1)]


def _runs_together(line: Line) -> bool:
    pairs = zip(line.parts, line.parts[1:], strict=False)
    return any(_inside_word(a, b) for a, b in pairs)


def _inside_word(a: str | Term, b: str | Term) -> bool:
    before = a[-1:] if isinstance(a, str) else "x"
    after = b[:1] if isinstance(b, str) else "x"
    return bool(words(before) and words(after))
