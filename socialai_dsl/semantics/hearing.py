"""Who seems to speak, and which texts only some of those who hear them tell apart: people, models, trained agents."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from socialai_dsl.semantics.entities import AGENT
from socialai_dsl.semantics.resolver import Resolver, texts_of, words_of_values
from socialai_dsl.semantics.scope import surviving
from socialai_dsl.semantics.terms import Line, Term
from socialai_dsl.source import DataPath, Span
from socialai_dsl.vocabulary import composed, words

Spoken = Mapping[str, Mapping[DataPath, Line]]
"""Member of the cast -> what it says, by place."""


def check_speakers(resolver: Resolver, spoken: Spoken) -> None:
    """Report names and lines that a hearer takes for another speaker's, or for another tone (S405)."""
    findings, symbols = resolver.findings, resolver.symbols
    divides = re.compile(":| to " if resolver.addresses else ":")
    for member in symbols.cast:
        path = symbols.member_path(member, "name")
        with surviving():
            for name in words_of_values(resolver.registers.read(f"{member}.name").type):
                mark = divides.search(composed(name))
                if findings.must_be_one_line(path, name) and mark is not None:
                    what = "a colon" if mark.group() == ":" else "` to `"
                    message = f"the name `{name}` contains {what}, so its lines read as another speaker's"
                    hint = "what is heard reads `Ann: text`, or `Ann to Bob: text`; leave it out of names"
                    findings.error("S405", message, findings.at(path), hint=hint)
    tone = symbols.scenario.observe.tone
    look = symbols.scenario.looks.get(tone) if tone is not None else None
    for line in _of_npcs(spoken) if look is not None else ():
        begun = (re.match(r"\(([^()]*)\)", composed(text)) for text in texts_of(line))
        said = next(
            (one for one in begun if one is not None and look is not None and one[1] in look.words), None
        )
        if said is not None:
            message = f"`{said[0]}` reads as the tone of what is said, which the look `{tone}` gives"
            findings.error("S405", message, line.span, hint="leave it out; the tone is heard anyway")


def report_alike(resolver: Resolver, spoken: Spoken, names: Iterable[Term]) -> None:
    """Warn of what people tell apart and a trained agent does not, which hears words alone (W406)."""
    findings, symbols = resolver.findings, resolver.symbols
    called: dict[tuple[str, ...], tuple[str, str]] = {}
    for member, name in zip(symbols.cast, names, strict=True):
        for text in words_of_values(name.type):
            first, known = called.setdefault(tuple(words(text)), (member, text))
            if first != member and known != text:
                message = (
                    f"`{text}` and `{known}`, which `{first}` is called, are one name to a trained agent"
                )
                _warn(resolver, message, text, findings.at(symbols.member_path(member, "name")))
    heard: dict[tuple[str, tuple[str, ...]], tuple[str, Span]] = {}
    told: set[Span] = set()
    for member, lines in spoken.items():
        who = member if symbols.scenario.observe.names == "shown" else ""
        for line in _of_npcs({member: lines}):
            for text in texts_of(line):
                known, span = heard.setdefault((who, tuple(words(text))), (_shown(text), line.span))
                if known != _shown(text) and line.span not in told:
                    told.add(line.span)
                    where = f"line {span.line}" if span.file == line.span.file else str(span)
                    message = f'"{text}" and "{known}" ({where}) are the same to a trained agent'
                    _warn(resolver, message, text, line.span)


def _warn(resolver: Resolver, message: str, text: str, span: Span) -> None:
    hears = " ".join(words(text)) or "none"
    hint = f"it hears words alone, here {hears}; say what matters in words"
    resolver.findings.warning("W406", message, span, hint=hint)


def _shown(text: str) -> str:
    return " ".join(composed(text).split())


def _of_npcs(spoken: Spoken) -> Iterator[Line]:
    """All lines but the agent's, whose own utterances are actions."""
    for member, lines in spoken.items():
        yield from lines.values() if member != AGENT else ()
