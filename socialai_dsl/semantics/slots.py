"""The slots of a grammar: what can stand in each, and the value of what was said or heard there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

from socialai_dsl.semantics.scope import FilledSlot, Findings, Symbols, beside_word, surviving
from socialai_dsl.semantics.terms import COLOR, Const, Term, Type, entity
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import COLORS, first_alike, is_plain

_RANGE: Final = re.compile(r"(-?\d+)\.\.(-?\d+)")
_MOST: Final = 256
"""The most values of a slot."""

Entry = tuple[str, Const | None]
"""A word, and the thing, member of the cast or colour that it stands for."""


def filled(symbols: Symbols, findings: Findings) -> Mapping[str, FilledSlot]:
    """The slots by name; those that cannot be filled are reported and left out."""
    found: dict[str, FilledSlot] = {}
    for name, entries in symbols.scenario.grammar.slots.items():
        path: DataPath = ("grammar", "slots", name)
        with surviving():
            found[name] = _filled(symbols, name, entries, path, findings)
    return found


def _filled(
    symbols: Symbols, name: str, entries: tuple[str | int, ...], path: DataPath, findings: Findings
) -> FilledSlot:
    found: list[Entry] = []
    known: dict[str, str] = {}
    for place, raw in findings.each(path, entries):
        findings.must_be_one_line(place, str(raw))
        for word, value in _entries(symbols, raw, place, findings):
            first = first_alike(word, known)
            if first is not None:
                same = "is in" if first == word else f"is heard as `{first}`, which is in"
                raise findings.fail("S213", f"`{word}` {same} the slot `{name}` already", findings.at(place))
            found.append((word, value))
    if len(found) > _MOST:
        message = f"a slot has at most {_MOST} values, this one {len(found)}"
        raise findings.fail("S106", message, findings.places.key_span(path))
    words = tuple(word for word, _ in found)
    values = tuple(value for _, value in found if value is not None)
    kinds = {value.type.kind for value in values}
    if len(values) < len(words) and "entity" in kinds:
        word = next(word for word, value in found if value is None)
        thing = next(word for word, value in found if value is not None and value.type.kind == "entity")
        message = f"the slot `{name}` mixes the word `{word}` with `{thing}`, which is in the room"
        hint = "a slot has either words or what is in the room; `the ball` is a word even if something is called `ball`"
        raise findings.fail("S204", message, findings.places.key_span(path), hint=hint)
    if len(kinds) > 1:
        message = f"the slot `{name}` mixes colours with what is in the room"
        raise findings.fail("S204", message, findings.places.key_span(path))
    return FilledSlot(Type("noun", 0, len(words) - 1, words), values if len(values) == len(words) else ())


def _entries(symbols: Symbols, raw: str | int, place: DataPath, findings: Findings) -> Iterator[Entry]:
    """What one entry stands for: a range, the colours, things or members of the cast, else a word."""
    text = str(raw).strip()
    limits = _RANGE.fullmatch(text)
    if limits is not None:
        low, high = map(int, limits.groups())
        if not 0 <= high - low < _MOST:
            message = f"a range goes from its least to its greatest number and has at most {_MOST} values"
            raise findings.fail("S106", message, findings.at(place))
        yield from ((str(value), None) for value in range(low, high + 1))
    elif text == "colors":
        yield from ((word, Const(COLOR, i)) for i, word in enumerate(COLORS))
    elif text in symbols.objects:
        things = symbols.objects[text]
        for i, value in enumerate(things.numbers):
            word = text.replace("_", " ")
            yield word if things.single else f"{word} {i + 1}", entity(value)
    elif text in symbols.groups or text in symbols.roles or text in symbols.numbers:
        for member in symbols.groups.get(text) or (symbols.roles.get(text, text),):
            yield name_of(symbols, member, place, findings), entity(symbols.numbers[member])
    else:
        if "<" in text or ">" in text:
            raise findings.fail("S104", "what stands in a slot has no slots itself", findings.at(place))
        yield text, Const(COLOR, COLORS.index(text)) if text in COLORS else None


def name_of(symbols: Symbols, member: str, place: DataPath, findings: Findings) -> str:
    """How others call a member of the cast, which has to be known to all."""

    def called(name: object) -> str | None:
        if name is None:
            return symbols.default_name(member)
        raw = str(name)
        return raw if is_plain(raw) and raw not in symbols.declared and "(" not in raw else None

    names = {called(case.raw) for case in symbols.cast[member].cases("name")}
    name = names.pop()
    if names or name is None:
        message = f"the name of `{member}` is drawn, so nobody can be sure to say it"
        hint = "give it a name of its own, or write words into the slot: [John, Jack]"
        raise findings.fail("S204", message, findings.at(place), hint=hint)
    return name


def meaning(slot: FilledSlot, word: Term) -> Term:
    """What a word of a slot stands for: the thing, member of the cast or colour; a word stands for itself."""
    if not slot.values or isinstance(word, Const):
        return slot.values[word.value] if slot.values and isinstance(word, Const) else word
    numbers = [value.value for value in slot.values]
    kind = slot.values[0].type.kind
    type_ = COLOR if kind == "color" else Type(kind, min(numbers), max(numbers))
    return beside_word(word, numbers, type_)
