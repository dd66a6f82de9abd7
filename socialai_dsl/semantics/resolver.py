"""The interface of the resolver, as the parts of the language see it; `resolve` implements it."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, product
from math import prod
from typing import ClassVar, Final, Unpack

from socialai_dsl import cures
from socialai_dsl.diagnostics import Advice
from socialai_dsl.grammar import ast
from socialai_dsl.semantics.cast import Cases
from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.scope import (
    FilledSlot,
    Findings,
    PlayedFrame,
    ReportedError,
    Scalar,
    Scope,
    Symbols,
    beside_word,
    described,
    quoted,
    select,
    spoken,
    words_of,
)
from socialai_dsl.semantics.signatures import Words
from socialai_dsl.semantics.terms import (
    ACTION,
    COLOR,
    DIRECTION,
    LARGEST,
    NOTED,
    SIDE,
    TURN,
    Const,
    Line,
    Pattern,
    Read,
    ReadEach,
    Readings,
    Select,
    SitedTerm,
    Term,
    Type,
    arithmetic,
    draws,
    holds_nothing,
    integer,
    may_be_nothing,
    may_find_nothing,
    nothing_of,
    number,
    walk,
    where_there_is,
)
from socialai_dsl.source import DataPath, Span
from socialai_dsl.vocabulary import Sentences, is_number, is_plain, normal

MAX_TEXTS = 4096
"""How many different texts one line may have."""

MAX_ALL_TEXTS = 1 << 15
"""How many all lines may have together; those that several members say count for each."""


class Utterances:
    """Everything that may be said: the sentences of the grammar by the agent, the texts of their lines by NPCs.

    Attributes:
        npc_texts: every text that an NPC can say, for what others may hear; only ever added to.
        said_by: member -> the texts of those that it can say.
        sentences: what the grammar can say.
    """

    def __init__(self, sentences: Sentences) -> None:
        self.npc_texts: dict[str, None] = {}
        self.said_by: dict[str, dict[str, None]] = {}
        self.sentences = sentences
        self._by_normal: dict[str, list[tuple[int, str]]] = {}
        self._unclear: list[tuple[str | None, re.Pattern[str]]] = []

    @cached_property
    def _pairs(self) -> dict[str, set[tuple[int, int]]]:
        """Templates and fillings of what the grammar can say, by what counts of the text."""
        pairs: dict[str, set[tuple[int, int]]] = {}
        for (template, choices), pair in zip(self.sentences.each(), self.sentences.pairs(), strict=True):
            pairs.setdefault(normal(self.sentences.text(template, choices)), set()).add(pair)
        return pairs

    def add_npc_texts(self, member: str, texts: Iterable[str]) -> None:
        """Make known what a member of the cast can say."""
        own = self.said_by.setdefault(member, {})
        for text in texts:
            if text not in self.npc_texts:
                self._by_normal.setdefault(normal(text), []).append((len(self.npc_texts), text))
            self.npc_texts[text] = own[text] = None

    def add_unclear(self, member: str | None, parts: Iterable[object]) -> None:
        """Make known that a member says a text in which something was reported that means nothing; None: anybody.

        `parts`: what is fixed of it as texts; anything may stand in the place of others.
        """
        written = "".join(re.escape(normal(part)) if isinstance(part, str) else ".*" for part in parts)
        self._unclear.append((member, re.compile(written.replace("\\ ", r"\s*"))))

    def may_be_said(self, said: str, members: Container[str] | None = None) -> bool:
        """Whether one of some members, or of all, may say a text where what it says is not clear for another reason."""
        return any(
            (members is None or member in members) and pattern.fullmatch(normal(said))
            for member, pattern in self._unclear
        )

    def match(self, said: str) -> frozenset[tuple[int, int]]:
        """The pairs of template and filling that a text is, `<slot>` standing for all that the slot can be."""
        return frozenset(pair for text, _ in self._filled(said) for pair in self._pairs.get(normal(text), ()))

    def npcs_matching(self, said: str) -> dict[str, int | None]:
        """The texts of NPCs that fit, each with the filling that its slots have; None of a text without slots."""
        wanted: dict[str, int | None] = {}
        for text, filling in self._filled(said):
            wanted[normal(text)] = filling
        found = sorted(
            (place, text, like) for like in wanted for place, text in self._by_normal.get(like, ())
        )
        return {text: wanted[like] for _, text, like in found}

    def _filled(self, said: str) -> Iterator[tuple[str, int | None]]:
        """A text with all that its slots can be in place of them, each with its filling."""
        slots = self.sentences.slots
        there = [slot.place in said for slot in slots]
        if not any(there):
            yield said, None
            return
        ranges = (
            range(len(slot.words) if is_there else 1) for slot, is_there in zip(slots, there, strict=True)
        )
        for choices in product(*ranges):
            text = said
            for slot, choice in zip(slots, choices, strict=True):
                text = text.replace(slot.place, slot.words[choice])
            digits = [choice if is_there else None for choice, is_there in zip(choices, there, strict=True)]
            yield text, self.sentences.filling(digits)

    def filling_of(self, said: str) -> int | None:
        """The filling of what the grammar can say; None where it cannot, or the template has no slots."""
        found = [
            filling
            for template, filling in self._pairs.get(normal(said), ())
            if any(slot.place in self.sentences.templates[template] for slot in self.sentences.slots)
        ]
        return min(found, default=None)

    def anything(self) -> Pattern:
        """Every utterance that a member can say."""
        pairs = frozenset(pair for found in self._pairs.values() for pair in found)
        return Pattern(pairs, "any", frozenset(self.npc_texts))

    def all_texts(self) -> Iterator[str]:
        """Every utterance as text."""
        return (self.sentences.text(template, choices) for template, choices in self.sentences.each())


def texts_of(line: Line) -> list[str]:
    """Every text that a line can be, in the order of its values; at most MAX_TEXTS."""
    choices = [[part] if isinstance(part, str) else words_of_values(part.type) for part in line.parts]
    return ["".join(chosen) for chosen in islice(product(*choices), MAX_TEXTS)]


def number_of_texts(line: Line) -> int:
    """How many texts a line can be."""
    return prod(1 if isinstance(part, str) else part.type.size for part in line.parts)


def words_of_values(type_: Type) -> list[str]:
    """The word of each value of a type; of a wide type of the first `MAX_TEXTS`, more than any text may have."""
    return [spoken(type_, value) for value in type_.values[:MAX_TEXTS]]


# -- registers: what is drawn or computed once at reset ------------------------------------------------------


@dataclass(frozen=True)
class Declaration:
    """A register before it is resolved.

    Attributes:
        path: its name, `let.exit` or `wizard.goal`. label: how messages call it.
        source, raw: the expression, or all that it can be, and where it stands. scope: what its names mean.
        expected: its type, if its declaration says it.
        range: the numbers it keeps to, if its declaration says them.
        constant: a known value needs no register.
        imagined: it is only looked at, and never drawn.
        for_each: the keys of the group of which each has one. each: what each starts with, where that is a list.
        starts_with_nothing: until it is set.
        gathers: sources set it, as those of a belief. forgets: it may hold nothing again.
    """

    path: str
    label: str
    source: DataPath
    raw: Scalar | Cases
    scope: Scope
    expected: Type | None = None
    range: Type | None = None
    constant: bool = False
    imagined: bool = False
    for_each: tuple[Const, ...] = ()
    each: tuple[tuple[DataPath, Scalar], ...] = ()
    starts_with_nothing: bool = False
    gathers: bool = False
    forgets: bool = False


@dataclass(frozen=True)
class _Resolved:
    """What a register comes to.

    Attributes:
        term: how it is read, or the known value in its place; None: it means nothing, which has been reported.
        drawn: what is given a value at reset, one for each of a group.
        starts: the values that it may start with, but for what stands for nothing.
    """

    term: Term | None
    drawn: tuple[Drawn, ...] = ()
    starts: tuple[Term, ...] = ()


class Registers:
    """All registers of a scenario.

    Attributes:
        words: types that uses settled for registers whose value is bare words, such as `pick(left | right)`, or that
            start with nothing.
        learned: whether it was found only now what some register holds that starts with nothing.
        set_to: the values that registers are set to, of those that have room for whatever that is.
        remembered: what is computed at the start of every step, for `prev`.
    """

    def __init__(self, resolver: Resolver, words: Mapping[str, Type], ranges: Mapping[str, Type]) -> None:
        self._resolver = resolver
        self._declared: dict[str, Declaration] = {}
        self._resolved: dict[str, _Resolved] = {}
        self._busy: list[str] = []
        self.remembered: list[Drawn] = []
        self._settled: dict[str, tuple[Type, Span]] = {}
        self.words = dict(words)
        self.learned = False
        self._given_ranges = dict(ranges)
        self.set_to: dict[str, list[Term]] = {}
        self._noted: dict[str, list[Term]] = {}

    def __len__(self) -> int:
        """How many registers are declared or hold a known value."""
        return len(self._declared) + len(self._resolved)

    def declare(self, declaration: Declaration) -> None:
        """Make a register known; it is resolved later."""
        self._declared[declaration.path] = declaration

    def known(self, path: str, value: Const) -> None:
        """A register that is a known value."""
        self._resolved[path] = _Resolved(value)

    def put(self, path: str, value: SitedTerm) -> Read:
        """A register that takes a value at reset which is resolved already."""
        read = Read(value.term.type, path)
        self._resolved[path] = _Resolved(read, (Drawn(path, read.type, value),), (value.term,))
        return read

    def remember(self, value: SitedTerm) -> Read:
        """A register that takes a value at the start of every step."""
        known = next((drawn for drawn in self.remembered if drawn.value.term == value.term), None)
        if known is None:
            known = Drawn(f"{NOTED}{len(self.remembered)}", value.term.type, value)
            self.remembered.append(known)
            self._noted.setdefault(known.path, []).append(value.term)
        return Read(known.type, known.path, may_miss=may_find_nothing(value.term))

    @contextmanager
    def apart(self) -> Iterator[None]:
        """What is asked in it about the step before is no part of the scenario's program."""
        known = len(self.remembered)
        try:
            yield
        finally:
            del self.remembered[known:]

    def remembered_in(self, parts: object) -> tuple[Drawn, ...]:
        """The registers for `prev` that are read in terms, or parts of plans."""
        used = {part.path for part in walk(parts) if hasattr(part, "path")}
        return tuple(drawn for drawn in self.remembered if drawn.path in used)

    def __contains__(self, path: str) -> bool:
        return path in self._declared or path in self._resolved

    def declaration(self, path: str) -> Declaration | None:
        """The declaration of a register, None of one that is none of the author's own."""
        return self._declared.get(path)

    def drawn(self) -> list[Drawn]:
        """All registers that are not constants, in the order declared, behind those that were `put`; unused ones are
        resolved now.
        """
        for path in self._declared:
            with suppress(ReportedError):
                self.read(path)
        kept = [path for path, declaration in self._declared.items() if not declaration.imagined]
        put = [path for path in self._resolved if path not in self._declared]
        return [drawn for path in (*put, *kept) for drawn in self._drawn(path)]

    def _drawn(self, path: str) -> tuple[Drawn, ...]:
        return self._resolved[path].drawn if path in self._resolved else ()

    def read(self, path: str, expected: Type | None = None, span: Span | None = None) -> Term:
        """The register (or its constant) as a term; `expected` and `span` are those of the use."""
        if path in self._busy:
            raise self._circle(path)
        declaration = self._declared.get(path)
        if declaration is not None and expected is not None and span is not None and self.is_wordy(path):
            self._settle(declaration, expected, span)
        if path not in self._resolved:
            assert declaration is not None, f"internal: no register {path}"
            self._resolve(declaration)
        term = self._resolved[path].term
        if term is None:
            raise ReportedError
        return term

    def keys(self, path: str) -> tuple[Const, ...]:
        """The keys of registers that there are for each of a group; none of a single one."""
        declaration = self._declared.get(path)
        return declaration.for_each if declaration is not None else ()

    def of_key(self, path: str, key: Term) -> Read | ReadEach:
        """Of registers that there are for each of a group, that of a key."""
        base, keys = self.read(path), self.keys(path)
        assert isinstance(base, Read), "internal: a register that is set is no constant"
        registers = tuple(replace(base, path=self._called(path, each)) for each in keys)
        term = ReadEach(base.type, key, tuple(each.value for each in keys), registers)
        return term.known() or term

    def _called(self, path: str, key: Const) -> str:
        """The path of the register of a key: `ann.trust(bob)`."""
        return f"{path}({self._resolver.symbols.word(key)})"

    def is_wordy(self, path: str) -> bool:
        """Whether a register's value consists of bare words, so that its type depends on its uses."""
        declaration = self._declared.get(path)
        if declaration is None or declaration.expected is not None or not isinstance(declaration.raw, str):
            return False
        if declaration.starts_with_nothing:
            return False
        try:
            node = self._resolver.findings.expression(declaration.source, declaration.raw)
        except ReportedError:
            return False
        return self._resolver.is_wordy(node, declaration.scope)

    def _settle(self, declaration: Declaration, expected: Type, span: Span) -> None:
        settled = self._settled.setdefault(declaration.path, (expected, span))
        if (settled[0].kind, settled[0].words) != (expected.kind, expected.words):
            first, place = settled
            raise self._resolver.findings.fail(
                "S209",
                f"`{declaration.label}` is used as {described(expected)} here, but as {described(first)} before",
                span,
                hint=f"the other use is at line {place.line}, column {place.column}",
            )
        self.words[declaration.path] = expected

    def drawn_at_reset(self, path: str) -> Term | None:
        """The value that a register gets at reset and keeps; None for a constant, or if rules can set it."""
        drawn, declaration = self._drawn(path), self._declared.get(path)
        gathers = declaration is not None and (declaration.gathers or declaration.forgets)
        return drawn[0].value.term if len(drawn) == 1 and not (gathers or self.is_set(path)) else None

    def is_set(self, path: str) -> bool:
        """Whether a register is one that rules can set: of a frame's `let`, or of `state`."""
        path = path.partition("(")[0]
        source = self._declared[path].source if path in self._declared else ()
        return source[:1] in (("state",), ("looks",)) or ("frames" in source and "let" in source)

    def starts_with_nothing(self, path: str) -> bool:
        """Whether a register holds nothing until it is set."""
        return self._declared[path].starts_with_nothing

    def holds(self, path: str) -> Type | None:
        """What a register holds; None if it starts with nothing and it is not known yet what that will be."""
        declaration = self._declared[path]
        if declaration.starts_with_nothing and declaration.range is None and path not in self.words:
            return None
        return self.read(path).type

    def widen(self, path: str, value: Term) -> None:
        """Make room in a register for a value it is set to; one with a range of its own keeps to it."""
        declaration, type_ = self._declared[path], value.type
        if declaration.range is not None:
            return
        if declaration.starts_with_nothing and path not in self.words:
            self.words[path] = type_
            self.learned = True
        if _counts(type_):
            self.set_to.setdefault(path, []).append(value)

    def values_of(self, path: str) -> list[Term]:
        """All that a register may hold but nothing: what it starts with, is set to, or notes for `prev`, be it `apart`.

        Empty where it has a range of its own.
        """
        declaration = self._declared.get(path)
        if declaration is not None and declaration.range is not None:
            return []
        starts = self._resolved[path].starts if path in self._resolved else ()
        return [*starts, *self._noted.get(path, ()), *self.set_to.get(path, ())]

    def type_of(self, path: str) -> Type | None:
        """The type that a register has been resolved with; None if it means nothing."""
        term = self._resolved[path].term if path in self._resolved else None
        return term.type if term is not None else None

    def _resolve(self, declaration: Declaration) -> None:
        path = declaration.path
        self._resolved[path] = _Resolved(None)
        self._busy.append(path)
        try:
            starts = self._starts(declaration)
        finally:
            self._busy.pop()
        (first, _), *_ = starts
        if declaration.constant and isinstance(first.term, Const):
            self._resolved[path] = _Resolved(first.term)
            return
        type_ = self._common_type(declaration, [start.term for start, _ in starts])
        if path in self._given_ranges and _counts(type_):
            type_ = union(type_, self._given_ranges[path])
        empties = declaration.starts_with_nothing or declaration.forgets
        empties = empties or any(may_be_nothing(start.term) for start, _ in starts)
        nothing = nothing_of(type_) if empties else None
        values = () if declaration.starts_with_nothing else tuple(start.term for start, _ in starts)
        if nothing is not None:
            empty, always = Const(type_, nothing), declaration.starts_with_nothing
            starts = [
                (replace(start, term=empty if always else _or_empty(start.term, empty)), called)
                for start, called in starts
            ]
        drawn = tuple(Drawn(called, type_, start, nothing) for start, called in starts)
        self._resolved[path] = _Resolved(Read(type_, path, nothing), drawn, values)

    def _starts(self, declaration: Declaration) -> list[tuple[SitedTerm, str]]:
        """What each register of a declaration starts with, and its path."""
        path, scope = declaration.path, declaration.scope
        expected = declaration.expected or self.words.get(path)
        span = self._resolver.findings.at(declaration.source)
        if declaration.starts_with_nothing:
            holds = declaration.range or expected
            if holds is None:
                message = f"no rule or step sets `{declaration.label}`, so its type is unknown"
                raise self._resolver.findings.fail("S318", message, span, hint="set it in a rule or a step")
            start = SitedTerm(Const(holds, holds.low), scope.draws.site, span)
            return [(start, self._called(path, key)) for key in declaration.for_each] or [(start, path)]
        if not declaration.for_each:
            value = self._resolver.written(
                declaration.raw, expected, scope.at(declaration.source, scope.draws.site)
            )
            return [(SitedTerm(value, scope.draws.site, span), path)]
        starts = []
        for i, key in enumerate(declaration.for_each):
            source, raw = declaration.each[i] if declaration.each else (declaration.source, declaration.raw)
            own = replace(scope.at(source, f"{scope.draws.site}[{i}]"), it=key)
            term = self._resolver.written(raw, expected, own)
            starts.append((SitedTerm(term, own.draws.site, span), self._called(path, key)))
        return starts

    def _common_type(self, declaration: Declaration, starts: list[Term]) -> Type:
        """The type that has room for all that the registers of a declaration start with."""
        type_ = self._within_range(declaration, starts[0])
        for start in starts[1:]:
            other = self._within_range(declaration, start)
            if not same_kind(other, type_) or other.words != type_.words:
                findings = self._resolver.findings
                message = f"`{declaration.label}` starts with values of different kinds"
                raise findings.fail("S204", message, findings.at(declaration.source))
            type_ = union(type_, other)
        return type_

    def _within_range(self, declaration: Declaration, term: Term) -> Type:
        """The type of the register; its start must lie in the range that is given."""
        given = declaration.range
        if given is None:
            return term.type
        findings = self._resolver.findings
        if term.type.kind != "int" or term.type.words:
            message = f"`{declaration.label}` has a range, so it must start with a number"
            raise findings.fail("S204", message, findings.at(declaration.source))
        if not given.low <= term.type.low <= term.type.high <= given.high:
            bounds = f"{term.type.low}..{term.type.high}" if term.type.size > 1 else f"{term.type.low}"
            message = (
                f"`{declaration.label}` starts with {bounds}, outside of its range {given.low}..{given.high}"
            )
            raise findings.fail("S106", message, findings.at(declaration.source))
        return given

    def _circle(self, path: str) -> ReportedError:
        circle = [self._declared[p] for p in self._busy[self._busy.index(path) :]]
        labels = [d.label for d in circle]
        needs = " and ".join(
            f"`{a}` needs `{b}`" if a != b else f"`{a}` needs itself"
            for a, b in zip(labels, labels[1:] + labels[:1], strict=True)
        )
        findings = self._resolver.findings
        return findings.fail("S208", needs, findings.places.key_span(circle[0].source))


def _counts(type_: Type) -> bool:
    """Whether values are numbers, or things, of which a register may need a wider range."""
    return type_.kind == "entity" or (type_.kind == "int" and not type_.words)


def _or_empty(start: Term, empty: Const) -> Term:
    """What a register starts with, and `empty` where that is another that holds nothing."""
    if not may_be_nothing(start):
        return start
    # A value is cut to its type, so that has room for what stands for nothing.
    room = replace(empty.type, low=min(empty.type.low, empty.value), words=())
    return Select(room, (holds_nothing(start),), (empty,), start)


def union(a: Type, b: Type) -> Type:
    """The first type with room for the values of another of its kind."""
    return a.ranging(min(a.low, b.low), max(a.high, b.high))


# -- the resolver --------------------------------------------------------------------------------------------


MAX_NESTED: Final = 64
MAX_PARTS: Final = 2_000
MAX_ALL_PARTS: Final = 100_000
"""How deep an expression may lead, and how many parts it and all of them may have, definitions written out."""

INT = Type("int", 0, 0)
"""Expected: any number."""
ANY_TEXT = Type("text", 0, -1)
"""Expected: any text."""
ENTITY = Type("entity", 0, 0)
"""Expected: an inhabitant of the room."""

VOCABULARIES = (COLOR, DIRECTION, ACTION, TURN, SIDE)
"""The types whose words belong to the language."""

SAYABLE = ("text", "noun", "color", "int", "status", "look", "direction", "action")
"""Kinds of values that can stand in a text."""

WORDED = ("text", "noun", "color", "status", "look")
"""Kinds of values that are called by words, which values of another kind may be called as well."""


class Resolver(ABC):
    """Gives meaning to the expressions of one scenario: what each part of the language is resolved with.

    Attributes:
        words: those of the language.
        symbols: what the scenario declares.
        findings: where mistakes go.
        registers: what is drawn or computed at reset, resolved when first needed.
        utterances: what the agent can say, and what NPCs say.
        frames: member -> the frame it plays.
        readings: how everything was written that has been given a meaning.
        used: where the definitions and draws stand that something uses.
        missing_keys: table and word of what may be looked up and is not there, once it has been reported.
        reported: other mistakes that are reported once, by a name of their own.
        slot_words: value of a slot of what the agent said -> the slot, and the word that stands for the value.
        addresses: whether the agent or an NPC addresses a single hearer.
        tables, links, moved_inside: what `tables` and `object_facts` have found out already.
    """

    words: ClassVar[Words]

    def __init__(
        self,
        symbols: Symbols,
        findings: Findings,
        frames: Mapping[str, PlayedFrame],
        words: Mapping[str, Type],
        ranges: Mapping[str, Type],
    ) -> None:
        self.symbols = symbols
        self.findings = findings
        self.frames = frames
        self.registers = Registers(self, words, ranges)
        self.utterances = Utterances(symbols.sentences)
        self.readings = Readings()
        self.used: set[DataPath] = set()
        self.missing_keys: set[tuple[str, str]] = set()
        self.reported: set[str] = set()
        self.slot_words: dict[Term, tuple[FilledSlot, Term]] = {}
        said_to = (entry.to for frame in frames.values() for entry in frame.model.all_effects())
        self.addresses = symbols.scenario.grammar.to is not None or any(to is not None for to in said_to)
        self._within: list[tuple[ast.Expr, Scope]] = []
        self._parts = self._all_parts = 0
        self.tables: dict[str, tuple[tuple[str, ...], tuple[Term, ...]] | None] = {}
        self.links: dict[str, dict[int, tuple[int, ...]]] = {}
        self.moved_inside: set[str] | None = None

    @abstractmethod
    def meaning(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree by what kind of node it is; `value` keeps how it was written as well."""

    def written(self, raw: Scalar | Cases, expected: Type | None, scope: Scope) -> Term:
        """The value that is written at the scope's path, or has these cases; ReportedError once it is reported."""
        if isinstance(raw, tuple):
            values = [self.written(one.raw, expected, scope.at(one.path, scope.draws.site)) for one in raw]
            return select(raw, values)
        if isinstance(raw, str) and expected is not None and expected.kind in ("text", "noun"):
            literal = self._literal(raw, expected)
            if literal is not None:
                return literal
        return self.value(self.findings.expression(scope.path, raw), expected, scope)

    def sited(self, raw: Scalar, expected: Type | None, scope: Scope) -> SitedTerm:
        """The same with its place and the site of its draws."""
        return SitedTerm(self.written(raw, expected, scope), scope.draws.site, self.findings.at(scope.path))

    def undrawn(self, sited: SitedTerm, message: str) -> SitedTerm:
        """A value in which nothing may be drawn; the message says why."""
        if draws(sited.term):
            raise self.findings.fail("S204", message, sited.span, hint="draw it in `let`, and use that")
        return sited

    def _literal(self, raw: str, expected: Type) -> Term | None:
        """A text of several words needs no quotes where a text is expected."""
        text = raw.strip()
        if expected.kind == "noun" and text in expected.words:
            return Const(expected, expected.words.index(text))
        if expected.kind == "text" and is_plain(text) and " " in text:
            return text_value(text)
        return None

    def value(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree, of the expected type if one is given."""
        reading = self.readings.begin(node)
        term: Term | None = None
        self._within.append((node, scope))
        try:
            self._limit()
            term = self.meaning(node, expected, scope)
        finally:
            self._within.pop()
            self.readings.end(reading, term, scope.draws.site)
        return term

    def _limit(self) -> None:
        """What names lead to, and theirs, could go as deep and grow as large as a file likes."""
        if len(self._within) == 1:
            self._parts = 0
        self._parts += 1
        self._all_parts += 1
        if len(self._within) > MAX_NESTED:
            message = f"names and definitions lead to one another more than {MAX_NESTED} deep"
        elif self._parts > MAX_PARTS:
            message = f"with its definitions written out, this has more than {MAX_PARTS} parts"
        elif self._all_parts > MAX_ALL_PARTS:
            message = f"with all definitions written out, the scenario has more than {MAX_ALL_PARTS} parts"
        else:
            return
        raise self.fail("S212", message, *self._within[0])

    def fail(
        self, code: str, message: str, node: ast.Expr, scope: Scope, **more: Unpack[Advice]
    ) -> ReportedError:
        """Report what is wrong with a part of an expression; raising the result gives the expression up."""
        return self.findings.fail(code, message, self.findings.node(scope.path, node), **more)

    def instead(self, text: str, node: ast.Expr, scope: Scope, also: str = "") -> cures.Cure | str:
        """The proposal to write something else in the place of a part of an expression."""
        return cures.write(text, self.findings.instead(scope.path, node, text), also)

    def around(self, node: ast.Expr) -> ast.Expr | None:
        """The expression that a part of it, which is being resolved, is right in."""
        return next((whole for whole, _ in reversed(self._within) if node in whole.children()), None)

    def is_subject(self, node: ast.Expr) -> bool:
        """Whether something is asked of what a name stands for that is being resolved: it is no text then."""
        around = (part for part, _ in reversed(self._within))
        return any(isinstance(part, ast.Attribute | ast.Call) and part.subject is node for part in around)

    def subjects_around(self) -> Iterator[str]:
        """The names of which something is asked in the expression, a part of which is being resolved."""
        for whole, _ in self._within[:1]:
            for part in ast.walk(whole):
                if isinstance(part, ast.Attribute | ast.Call) and isinstance(part.subject, ast.Name):
                    yield part.subject.id

    def no_such(
        self, word: str, message: str, node: ast.Expr, scope: Scope, **more: Unpack[Advice]
    ) -> ReportedError:
        """Report a name in an expression that means nothing there."""
        return self.findings.no_such(word, message, self.findings.node(scope.path, node), **more)

    def fit(self, term: Term, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
        """The term itself if it is of the expected type, or the word of that type it stands for."""
        if expected is None or same_kind(term.type, expected):
            return term
        if isinstance(term, Const) and expected.words and term.type.kind in (*WORDED, "int"):
            word = spoken(term.type, term.value)
            if word in expected.words:
                return Const(expected, expected.low + expected.words.index(word))
        if expected.kind == "int" and not expected.words and term.type.kind == "noun":
            value = _number_of(term)
            if value is not None:
                return value
        message = f"`{quoted(node)}` is {described(term.type)}, but {described(expected)} is expected here"
        hint: cures.Hint = None
        if expected.kind == "bool" and term.type.kind == "text":
            hint = "write `true` or `false`"
        elif expected == DIRECTION and term.type.kind in ("entity", "cell"):
            towards = "toward" if scope.path[-1:] == ("facing",) else "dir_to"
            hint = self.instead(f"{towards}({quoted(node)})", node, scope)
        elif expected.words and expected.kind not in ("noun", "bool"):
            hint = f"one of {words_of(expected)}"
        elif expected.kind == "entity" and term.type == COLOR:
            around = self.around(node)
            if isinstance(around, ast.Compare):
                thing = around.right if around.left is node else around.left
                hint = self.instead(f"{quoted(thing)}.color", thing, scope)
        elif expected.kind == "int" and term.type.kind == "noun":
            other = next(word for word in term.type.words if not is_number(word))
            hint = f"it is a number only if every noun is one; `{other}` is none"
        raise self.fail("S204", message, node, scope, hint=hint)

    def computed(self, op: str, args: tuple[Term, ...], node: ast.Expr, scope: Scope) -> Term:
        """An operation on numbers, which must fit into the engine's 64 bits whatever they are."""
        term = arithmetic(op, *args)
        low, high = term.type.low, term.type.high
        if low >= -LARGEST and high <= LARGEST:
            return term
        far = high if high > LARGEST else low
        raise self.fail(
            "S214",
            f"`{quoted(node)}` can be {far:.1e}, and numbers go up to {LARGEST:.1e}",
            node,
            scope,
            hint="use smaller numbers, or bound a part of it: `min(..., 1000)`",
        )

    def somewhere(self, node: ast.Expr, scope: Scope) -> Term:
        """Something that has a place: an object, a member of the cast, or a cell."""
        term = self.value(node, None, scope)
        return term if term.type.kind == "cell" else self.fit(term, ENTITY, node, scope)

    # -- bare words ------------------------------------------------------------------------------------------

    def is_bare(self, node: ast.Expr, scope: Scope) -> bool:
        """Whether a value takes its type from its use: a word that names nothing, a text, a number, a wordy `let`."""
        if isinstance(node, ast.Name):
            register = self._register_of(node, scope)
            if register is not None:
                return self.registers.is_wordy(register)
            return not self._names_something(node.id, scope)
        if isinstance(node, ast.Conditional):
            return self.lead(node, scope) is None
        return isinstance(node, ast.Text)

    def lead(self, node: ast.Expr, scope: Scope) -> ast.Expr | None:
        """Of the values that an expression chooses from the first that has a type of its own, if one has."""
        if isinstance(node, ast.Conditional):
            return self.lead(node.value, scope) or self.lead(node.other, scope)
        return None if self.is_bare(node, scope) else node

    def _register_of(self, node: ast.Name, scope: Scope) -> str | None:
        if node.id in scope.variables:
            return None
        frame = scope.frame
        if frame is not None and frame.register(node.id) in self.registers:
            return frame.register(node.id)
        if node.id in self.symbols.scenario.state:
            return f"state.{node.id}"
        return f"let.{node.id}" if node.id in self.symbols.scenario.let else None

    def means_nothing(self, word: str, scope: Scope) -> bool:
        """Whether a word is neither declared nor of the language: where a text is expected, it is one."""
        known = (
            any(word in type_.words for type_ in VOCABULARIES)
            or word in self.words.reserved
            or word in self.words.values
        )
        return not known and not self._names_something(word, scope)

    def _names_something(self, word: str, scope: Scope) -> bool:
        frame = scope.frame
        if (
            word in scope.variables
            or word in self.symbols.declared
            or word in ("t", "W", "H", "self", "it", "cells")
        ):
            return True
        if frame is not None and (
            word in frame.model.slots or word in frame.model.let or word in frame.defines
        ):
            return True
        in_vocabulary = any(word in type_.words for type_ in VOCABULARIES)
        return word in self.words.values and not in_vocabulary

    def is_wordy(self, node: ast.Expr, scope: Scope) -> bool:
        """Whether an expression comes down to bare words that several vocabularies have, such as `left`."""
        match node:
            case ast.Name(id=word):
                several = sum(word in type_.words for type_ in VOCABULARIES) > 1
                return several and self.is_bare(node, scope)
            case ast.Alternatives(options=options):
                return any(self.is_wordy(option, scope) for option in options)
            case ast.Arithmetic(op="*", right=right):
                return self.is_wordy(right, scope)
            case ast.Call(name="pick", args=(only,)):
                return self.is_wordy(only, scope)
            case ast.Quantifier(name="pick" | "first", group=group):
                return self.is_wordy(group, scope)
            case ast.Conditional(value=value, other=other):
                return self.is_wordy(value, scope) or self.is_wordy(other, scope)
        return False


def text_value(text: str) -> Const:
    """A known text."""
    return Const(Type("text", 0, 0, (text,)), 0)


def _number_of(noun: Term) -> Term | None:
    """A noun as the number that it is; None if some noun is none."""
    words = noun.type.words
    if not all(map(is_number, words)):
        return None
    values = [int(word) for word in words]
    if isinstance(noun, Const):
        return number(values[noun.value])
    found = beside_word(noun, values, integer(min(values), max(values)))
    return where_there_is(noun, found) if isinstance(found, Select) else found


def same_kind(actual: Type, expected: Type) -> bool:
    """Whether a value of one type is also of the other; numbers of any range are."""
    if actual.kind != expected.kind:
        return False
    if actual.kind == "int":
        return bool(actual.words) == bool(expected.words) and (
            not actual.words or actual.words == expected.words
        )
    return actual.kind not in ("status", "noun", "look") or actual.words == expected.words
