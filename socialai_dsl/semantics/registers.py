"""Registers: what is drawn or computed once at reset, each resolved when somebody first asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

from socialai_dsl.grammar import ast
from socialai_dsl.schema import Scenario
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.alternatives import select
from socialai_dsl.semantics.build import NOTED
from socialai_dsl.semantics.findings import FailedError, Findings, Scalar
from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.terms import Const, Read, Sited, Term, Type
from socialai_dsl.semantics.wording import described
from socialai_dsl.source import Span


@dataclass(frozen=True)
class Declaration:
    """A register before it is resolved.

    Attributes:
        path: its name, `let.exit` or `wizard.goal`. label: how messages call it.
        source, raw: the expression and where it stands. scope: what its names mean.
        others: what stands in its place in the other files of a `one_of` whose first file `source` is in.
        expected: its type, if its declaration says it.
        range: the numbers it keeps to, if its declaration says them.
        constant: a known value needs no register.
        imagined: it is only looked at, and never drawn.
    """

    path: str
    label: str
    source: DataPath
    raw: Scalar
    scope: Scope
    expected: Type | None = None
    range: Type | None = None
    constant: bool = False
    imagined: bool = False
    others: tuple[tuple[DataPath, Scalar], ...] = ()


class Reader(Protocol):
    """What gives a meaning to the expressions of registers."""

    findings: Findings

    def written(self, path: DataPath, raw: Scalar, expected: Type | None, scope: Scope) -> Term:
        """The value of the expression that is written at `path`."""

    def is_wordy(self, node: ast.Expr, scope: Scope) -> bool:
        """Whether an expression comes down to bare words that several vocabularies have."""


class Registers:
    """All registers of a scenario.

    Attributes:
        words: types that uses settled for registers whose value is bare words, such as `pick(left | right)`.
        ranges: for registers that are set, the range they were found to need.
        remembered: what is computed at the start of every step, for `prev`.
    """

    def __init__(self, reader: Reader, words: Mapping[str, Type], ranges: Mapping[str, Type]) -> None:
        self._reader = reader
        self._declared: dict[str, Declaration] = {}
        self._terms: dict[str, Term | None] = {}
        self._drawn: dict[str, Drawn] = {}
        self._busy: list[str] = []
        self._put: list[str] = []
        self.remembered: list[Drawn] = []
        self._settled: dict[str, tuple[Type, Span]] = {}
        self.words = dict(words)
        self._given_ranges = dict(ranges)
        self.ranges: dict[str, Type] = {}

    def declare(self, declaration: Declaration) -> None:
        """Make a register known; it is resolved later."""
        self._declared[declaration.path] = declaration

    def known(self, path: str, value: Const) -> None:
        """A register that is a known value."""
        self._terms[path] = value

    def put(self, path: str, value: Sited) -> Read:
        """A register that takes a value at reset which is resolved already."""
        type_ = value.term.type
        self._terms[path] = Read(type_, path)
        self._drawn[path] = Drawn(path, type_, value)
        self._put.append(path)
        return Read(type_, path)

    def remember(self, value: Sited) -> Read:
        """A register that takes a value at the start of every step."""
        known = next((drawn for drawn in self.remembered if drawn.value.term == value.term), None)
        if known is None:
            known = Drawn(f"{NOTED}{len(self.remembered)}", value.term.type, value)
            self.remembered.append(known)
        return Read(known.type, known.path)

    def __contains__(self, path: str) -> bool:
        return path in self._declared or path in self._terms

    def source(self, path: str) -> DataPath:
        """Where a register is declared."""
        return self._declared[path].source

    def drawn(self) -> list[Drawn]:
        """All registers that are not constants, in the order declared; those nobody asked for are resolved now."""
        for path in self._declared:
            with suppress(FailedError):
                self.read(path)
        kept = [path for path, declaration in self._declared.items() if not declaration.imagined]
        return [self._drawn[path] for path in (*self._put, *kept) if path in self._drawn]

    def read(self, path: str, expected: Type | None = None, span: Span | None = None) -> Term:
        """The register (or its constant) as a term; `expected` and `span` are those of the use."""
        if path in self._busy:
            raise self._circle(path)
        declaration = self._declared.get(path)
        if declaration is not None and expected is not None and span is not None and self.is_wordy(path):
            self._settle(declaration, expected, span)
        if path not in self._terms:
            assert declaration is not None, f"internal: no register {path}"
            self._resolve(declaration)
        term = self._terms[path]
        if term is None:
            raise FailedError
        return term

    def is_wordy(self, path: str) -> bool:
        """Whether a register's value consists of bare words, so that its type depends on its uses."""
        declaration = self._declared.get(path)
        if declaration is None or declaration.expected is not None or not isinstance(declaration.raw, str):
            return False
        try:
            node = self._reader.findings.expression(declaration.source, declaration.raw)
        except FailedError:
            return False
        return self._reader.is_wordy(node, declaration.scope)

    def _settle(self, declaration: Declaration, expected: Type, span: Span) -> None:
        settled = self._settled.setdefault(declaration.path, (expected, span))
        if (settled[0].kind, settled[0].words) != (expected.kind, expected.words):
            first, place = settled
            raise self._reader.findings.fail(
                "S209",
                f"`{declaration.label}` is used as {described(expected)} here, but as {described(first)} before",
                span,
                hint=f"the other use is at line {place.line}, column {place.column}",
            )
        self.words[declaration.path] = expected

    def draw_file(self, member: str, value: Sited) -> None:
        """Which file of a member's `one_of` is drawn."""
        self.put(f"{member}.one_of", value)

    def drawn_file(self, member: str) -> Term | None:
        """The number of the file of a member's `one_of` that was drawn; None if there is nothing to draw."""
        return self._terms.get(f"{member}.one_of")

    def drawn_at_reset(self, path: str) -> Term | None:
        """What a register is given at reset and keeps for the episode; None for a constant, or if rules can set it."""
        drawn = self._drawn.get(path)
        return drawn.value.term if drawn is not None and not self.is_set(path) else None

    def is_set(self, path: str) -> bool:
        """Whether a register is one that rules can set: of a frame's `let`, or of `state`."""
        source = self._declared[path].source if path in self._declared else ()
        return source[:1] == ("state",) or ("frames" in source and "let" in source)

    def widen(self, path: str, type_: Type) -> None:
        """Make room in a register for the values it is set to; one with a range of its own keeps to it."""
        if self._declared[path].range is None and type_.kind == "int" and not type_.words:
            own = self.ranges.get(path) or self._drawn[path].value.term.type
            self.ranges[path] = _union(own, type_)

    def _resolve(self, declaration: Declaration) -> None:
        path = declaration.path
        self._terms[path] = None
        self._busy.append(path)
        try:
            expected = declaration.expected or self.words.get(path)
            term = self._written(declaration, expected)
        finally:
            self._busy.pop()
        if declaration.constant and isinstance(term, Const):
            self._terms[path] = term
            return
        widened = self._within_range(declaration, term)
        if path in self._given_ranges and widened.kind == "int" and not widened.words:
            widened = _union(widened, self._given_ranges[path])
        findings = self._reader.findings
        sited = Sited(term, declaration.scope.draws.site, findings.at(declaration.source))
        self._terms[path] = Read(widened, path)
        self._drawn[path] = Drawn(path, widened, sited)

    def _within_range(self, declaration: Declaration, term: Term) -> Type:
        """The type of the register; its start must lie in the range that is given."""
        given = declaration.range
        if given is None:
            return term.type
        findings = self._reader.findings
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

    def _written(self, declaration: Declaration, expected: Type | None) -> Term:
        """The value of a declaration: what its expression says, or what that of the file says which was drawn."""
        scope = declaration.scope
        written = [(declaration.source, declaration.raw), *declaration.others]
        terms = [
            self._reader.written(source, raw, expected, scope.at(source, scope.draws.site))
            for source, raw in written
        ]
        if len(terms) == 1:
            return terms[0]
        assert scope.member is not None, "internal: only members of the cast have alternatives"
        return select(self.drawn_file(scope.member), terms)

    def _circle(self, path: str) -> FailedError:
        circle = [self._declared[p] for p in self._busy[self._busy.index(path) :]]
        labels = [d.label for d in circle]
        needs = " and ".join(
            f"`{a}` needs `{b}`" if a != b else f"`{a}` needs itself"
            for a, b in zip(labels, labels[1:] + labels[:1], strict=True)
        )
        findings = self._reader.findings
        return findings.fail("S208", needs, findings.places.key_span(circle[0].source))


def _union(a: Type, b: Type) -> Type:
    return replace(a, low=min(a.low, b.low), high=max(a.high, b.high))


# -- ranges of registers that are set --------------------------------------------------------------------------


_WIDEN_AFTER = 12
_MOST_ROUNDS = 20


class Ranges:
    """Finds, over repeated resolutions, ranges that hold whatever is set.

    Attributes:
        now: register -> the range to resolve with.
        unbounded: registers whose growth depends on their size, so that no range can be given.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.now: dict[str, Type] = {}
        self.unbounded: list[str] = []
        self._growth: dict[str, int] = {}
        self._rounds = 0
        self._wide: dict[str, Type] | None = None
        self._steps = scenario.horizon * _setters(scenario)

    def settled(self, needed: Mapping[str, Type]) -> bool:
        """Take note of the ranges that a resolution asked for; whether it had them already."""
        self._rounds += 1
        fits = all(_within(type_, self.now.get(path)) for path, type_ in needed.items())
        if self._wide is not None and (not fits or self.now is self._wide):
            return self._back()
        if fits:
            return self._rounds <= _WIDEN_AFTER + 1 or not self._narrow(needed)
        if self._rounds <= _WIDEN_AFTER:
            self._growth = {path: _excess(type_, self.now.get(path)) for path, type_ in needed.items()}
            self.now = dict(needed)
            return False
        if self._rounds == _WIDEN_AFTER + 1:
            self.now = {path: self._widened(type_, self.now[path]) for path, type_ in needed.items()}
            return False
        self.unbounded = [p for p, t in needed.items() if _excess(t, self.now[p]) > self._growth[p]]
        return True

    def _narrow(self, needed: Mapping[str, Type]) -> bool:
        """After widening, try what is really needed: `min(asked + 1, 9)` never leaves 0..9. Whether that is less."""
        if self._rounds > _MOST_ROUNDS or needed == self.now:
            return False
        self._wide, self.now = self.now, dict(needed)
        return True

    def _back(self) -> bool:
        """The narrower ranges do not hold: the last ones that did are taken. Whether they are taken already."""
        assert self._wide is not None, "internal: nothing was narrowed"
        done = self.now is self._wide
        self.now = self._wide
        return done

    def _widened(self, needed: Type, now: Type) -> Type:
        """A range that still grows, by as much as it can in a whole episode."""
        low = needed.low - (now.low - needed.low) * self._steps if needed.low < now.low else needed.low
        high = needed.high + (needed.high - now.high) * self._steps if needed.high > now.high else needed.high
        return replace(needed, low=low, high=high)


def _within(type_: Type, range_: Type | None) -> bool:
    return range_ is not None and range_.low <= type_.low and type_.high <= range_.high


def _excess(type_: Type, range_: Type | None) -> int:
    """By how much a type goes beyond a range."""
    if range_ is None:
        return 0
    return max(0, range_.low - type_.low) + max(0, type_.high - range_.high)


def _setters(scenario: Scenario) -> int:
    """How many rules and steps set something."""
    rules = [
        rule
        for frame in scenario.frames.values()
        for state in (frame.states or {}).values()
        for rule in (*state.first, *state.then)
    ]
    steps = [step for frame in scenario.frames.values() for step in frame.steps or ()]
    own = sum(bool(entry.set) for entry in (*rules, *steps))
    return own + sum(bool(rule.set) for rule in scenario.rules)
