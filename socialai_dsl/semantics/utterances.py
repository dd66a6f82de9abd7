"""What the agent can say, what NPCs say, and the texts that a line can be."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice, product

from socialai_dsl.schema import UtteranceGrammar
from socialai_dsl.semantics.terms import Line, Pattern, Term, Type
from socialai_dsl.semantics.wording import spoken
from socialai_dsl.vocabulary import normal, words

MAX_TEXTS = 4096
"""How many different texts one line may have."""


class Utterances:
    """Everything that may be said: each template with each noun by the agent, the texts of their lines by NPCs.

    Attributes:
        npc_texts: every text that an NPC can say, for what others may hear; only ever added to.
        said_by: member -> the texts of those that it can say.
    """

    def __init__(self, grammar: UtteranceGrammar) -> None:
        self.npc_texts: dict[str, None] = {}
        self.said_by: dict[str, dict[str, None]] = {}
        self._grammar = grammar
        self._pairs: dict[str, set[tuple[int, int]]] = {}
        self._by_normal: dict[str, list[tuple[int, str]]] = {}
        self._known_texts = 0
        for t, n in product(range(len(grammar.templates)), range(len(grammar.nouns))):
            self._pairs.setdefault(normal(grammar.utterance(t, n)), set()).add((t, n))

    def add_npc_texts(self, member: str, texts: Iterable[str]) -> None:
        """Make known what a member of the cast can say."""
        found = dict.fromkeys(texts)
        self.npc_texts |= found
        self.said_by.setdefault(member, {}).update(found)

    def match(self, said: str) -> frozenset[tuple[int, int]]:
        """The pairs of template and noun that a text is, `<noun>` standing for any noun."""
        if "<noun>" not in said:
            return frozenset(self._pairs.get(normal(said), ()))
        nouns = [str(noun) for noun in self._grammar.nouns]
        return frozenset(
            pair for n in nouns for pair in self._pairs.get(normal(said.replace("<noun>", n)), ())
        )

    def npcs_matching(self, said: str) -> dict[str, int | None]:
        """The texts of NPCs that fit, each with the noun that stands for `<noun>`."""
        known = self._npc_texts()
        if "<noun>" not in said:
            return {text: None for _, text in known.get(normal(said), ())}
        wanted = {normal(said.replace("<noun>", str(noun))): i for i, noun in enumerate(self._grammar.nouns)}
        found = sorted((place, text, i) for like, i in wanted.items() for place, text in known.get(like, ()))
        return {text: i for _, text, i in found}

    def _npc_texts(self) -> dict[str, list[tuple[int, str]]]:
        """What NPCs say, by what counts of it, with its place among all texts, to which others only are added."""
        texts = self.npc_texts
        for place, text in enumerate(islice(texts, self._known_texts, None), self._known_texts):
            self._by_normal.setdefault(normal(text), []).append((place, text))
        self._known_texts = len(texts)
        return self._by_normal

    def noun_in(self, said: str) -> int | None:
        """The noun of what the grammar can say; None where it cannot, or the template has no place for a noun."""
        found = [
            noun
            for template, noun in self._pairs.get(normal(said), ())
            if "<noun>" in self._grammar.templates[template]
        ]
        return min(found, default=None)

    def anything(self) -> Pattern:
        """Whatever anybody can say."""
        pairs = frozenset(pair for found in self._pairs.values() for pair in found)
        return Pattern(pairs, "any", frozenset(self.npc_texts))

    def all_texts(self) -> Iterator[str]:
        """Every utterance as text."""
        for t, n in product(range(len(self._grammar.templates)), range(len(self._grammar.nouns))):
            yield self._grammar.utterance(t, n)


def texts_of(line: Line) -> list[str]:
    """Every text that a line can be, in the order of its values; at most MAX_TEXTS."""
    choices = [[part] if isinstance(part, str) else words_of_values(part.type) for part in line.parts]
    texts: list[str] = []
    for chosen in product(*choices):
        if len(texts) == MAX_TEXTS:
            break
        texts.append("".join(chosen))
    return texts


def number_of_texts(line: Line) -> int:
    """How many texts a line can be."""
    count = 1
    for part in line.parts:
        count *= 1 if isinstance(part, str) else part.type.size
    return count


def words_of_values(type_: Type) -> list[str]:
    """The word of each value of a type."""
    return [spoken(type_, value) for value in range(type_.low, type_.high + 1)]


# -- words -----------------------------------------------------------------------------------------------------


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
        (word for name in names for word in words_of_values(name.type)),
        (text for said in lines.values() for line in said for text in _texts(line)),
    )
    return tuple(dict.fromkeys(word for text in texts for word in words(text)))


def _texts(line: Line) -> Iterator[str]:
    """The pieces of a line, each value with all its words; then whole texts, where pieces run into each other."""
    for part in line.parts:
        yield from [part] if isinstance(part, str) else words_of_values(part.type)
    if _runs_together(line):
        yield from texts_of(line)


def _runs_together(line: Line) -> bool:
    pairs = zip(line.parts, line.parts[1:], strict=False)
    return any(_inside_word(a, b) for a, b in pairs)


def _inside_word(a: str | Term, b: str | Term) -> bool:
    before = a[-1:] if isinstance(a, str) else "x"
    after = b[:1] if isinstance(b, str) else "x"
    return bool(words(before) and words(after))
