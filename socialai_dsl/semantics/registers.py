"""Registers: what is drawn or computed once at reset, each resolved when somebody first asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import alternatives, resolve_names
from socialai_dsl.semantics.build import NOTED
from socialai_dsl.semantics.findings import FailedError, Scalar
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.terms import Const, Drawn, Read, Sited, Term, Type
from socialai_dsl.semantics.wording import described
from socialai_dsl.source import Span

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver


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


class Registers:
    """All registers of a scenario.

    Attributes:
        words: types that uses settled for registers whose value is bare words, such as `pick(left | right)`.
        ranges: for registers that are set, the range they were found to need.
        remembered: what is computed at the start of every step, for `prev`.
    """

    def __init__(self, resolver: Resolver, words: Mapping[str, Type], ranges: Mapping[str, Type]) -> None:
        self._resolver = resolver
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
            node = self._resolver.findings.expression(declaration.source, declaration.raw)
        except FailedError:
            return False
        return resolve_names.is_wordy(self._resolver, node, declaration.scope)

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
        findings = self._resolver.findings
        sited = Sited(term, declaration.scope.draws.site, findings.at(declaration.source))
        self._terms[path] = Read(widened, path)
        self._drawn[path] = Drawn(path, widened, sited)

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

    def _written(self, declaration: Declaration, expected: Type | None) -> Term:
        """The value of a declaration: what its expression says, or what that of the file says which was drawn."""
        scope = declaration.scope
        written = [(declaration.source, declaration.raw), *declaration.others]
        terms = [
            self._resolver.written(source, raw, expected, scope.at(source, scope.draws.site))
            for source, raw in written
        ]
        if len(terms) == 1:
            return terms[0]
        assert scope.member is not None, "internal: only members of the cast have alternatives"
        return alternatives.select(self._resolver, scope.member, terms)

    def _circle(self, path: str) -> FailedError:
        circle = [self._declared[p] for p in self._busy[self._busy.index(path) :]]
        labels = [d.label for d in circle]
        needs = " and ".join(
            f"`{a}` needs `{b}`" if a != b else f"`{a}` needs itself"
            for a, b in zip(labels, labels[1:] + labels[:1], strict=True)
        )
        findings = self._resolver.findings
        return findings.fail("S208", needs, findings.places.key_span(circle[0].source))


def _union(a: Type, b: Type) -> Type:
    return replace(a, low=min(a.low, b.low), high=max(a.high, b.high))
