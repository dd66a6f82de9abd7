"""Who seems to speak, and which texts look alike and are not."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from socialai_dsl.semantics.cast import AGENT, Member
from socialai_dsl.semantics.resolver import Resolver, texts_of, words_of_values
from socialai_dsl.semantics.scope import surviving
from socialai_dsl.semantics.terms import Line, Term
from socialai_dsl.source import DataPath, Span
from socialai_dsl.vocabulary import composed, is_own_word

Spoken = Mapping[str, Mapping[DataPath, Line]]
"""Member of the cast -> what it says, by place."""


def check_speakers(resolver: Resolver, spoken: Spoken) -> None:
    """Report names and lines that a hearer takes for another speaker's, or for another tone (S405)."""
    findings, symbols = resolver.findings, resolver.symbols
    divides = re.compile(":| to " if resolver.addresses else ":")
    for member in symbols.cast:
        with surviving():
            for name in words_of_values(resolver.registers.read(f"{member}.name").type):
                path = _place_of(name, symbols.cast[member])
                mark = divides.search(composed(name))
                if findings.must_be_one_line(path, name) and mark is not None:
                    what = "a colon" if mark.group() == ":" else "` to `"
                    message = f"the name `{name}` contains {what}, so its lines read as another speaker's"
                    hint = "what is heard reads `Ann: text`, or `Ann to Bob: text`; leave it out of names"
                    findings.error("S405", message, findings.at(path), hint=hint)
                elif is_own_word(name):
                    message = (
                        f"the name `{name}` is one of the words with which texts tell what is seen and heard"
                    )
                    hint = "language models read `You hear:` and `2 steps ahead: a door`; choose another name"
                    findings.error("S405", message, findings.at(path), hint=hint)
    if symbols.scenario.observe.names == "hidden":
        for line in _of_npcs(spoken):
            begun = (re.match("([^:]+): ", composed(text)) for text in texts_of(line))
            said = next((one for one in begun if one is not None), None)
            if said is not None:
                message = f"`{said[0]}` reads as the name of who speaks, though names are hidden"
                findings.error("S405", message, line.span, hint="leave the colon out")
    tone = symbols.scenario.observe.tone
    look = symbols.scenario.looks.get(tone) if tone is not None else None
    if look is None:
        return
    for line in _of_npcs(spoken):
        begun = (re.match(r"\(([^()]*)\)", composed(text)) for text in texts_of(line))
        said = next((one for one in begun if one is not None and one[1] in look.words), None)
        if said is not None:
            message = f"`{said[0]}` reads as the tone of what is said, which the look `{tone}` gives"
            findings.error("S405", message, line.span, hint="leave it out; the tone is heard anyway")


def report_alike(resolver: Resolver, spoken: Spoken, names: Iterable[Term]) -> None:
    """Warn of texts that look alike and are not: a language model may tell them apart, and nobody else does (W406)."""
    findings, symbols = resolver.findings, resolver.symbols
    called: dict[str, tuple[str, str]] = {}
    for member, name in zip(symbols.cast, names, strict=True):
        for text in words_of_values(name.type):
            first, known = called.setdefault(_as_it_looks(text), (member, _written(text)))
            if first != member and known != _written(text):
                message = (
                    f"`{text}` and `{known}`, which `{first}` is called, look alike and are not the same name"
                )
                _warn(resolver, message, findings.at(_place_of(text, symbols.cast[member])))
    heard: dict[tuple[str, str], tuple[str, Span]] = {}
    told: set[Span] = set()
    for member, lines in spoken.items():
        who = member if symbols.scenario.observe.names == "shown" else ""
        for line in _of_npcs({member: lines}):
            for text in texts_of(line):
                known, span = heard.setdefault((who, _as_it_looks(text)), (_written(text), line.span))
                if known != _written(text) and line.span not in told:
                    told.add(line.span)
                    where = f"line {span.line}" if span.file == line.span.file else str(span)
                    message = f'"{text}" and "{known}" ({where}) look alike and are not the same text'
                    _warn(resolver, message, line.span)


def _place_of(name: str, member: Member) -> DataPath:
    """Where a name of a member is written."""
    cases = member.cases("name")
    return next((case.path for case in cases if name in str(case.raw)), cases[0].path)


def _warn(resolver: Resolver, message: str, span: Span) -> None:
    hint = "spell them alike; an agent and a person take them for the same, a language model may not"
    resolver.findings.warning("W406", message, span, hint=hint)


def _as_it_looks(text: str) -> str:
    return _written(composed(text))


def _written(text: str) -> str:
    return " ".join(text.split())


def _of_npcs(spoken: Spoken) -> Iterator[Line]:
    """All lines but the agent's, whose own utterances are actions."""
    for member, lines in spoken.items():
        yield from lines.values() if member != AGENT else ()
