"""The entries of `probes`: when each is asked, its text, its right answer, its possible answers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from socialai_dsl.grammar.ast import every
from socialai_dsl.schema.scenario import Expression, Probe
from socialai_dsl.semantics.groups import values_of
from socialai_dsl.semantics.plans import Drawn, ProbePlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import ReportedError, spoken, step_scope, surviving
from socialai_dsl.semantics.terms import BOOL, SitedTerm, Term
from socialai_dsl.semantics.texts import parts, sayable
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import TRUTHS, normal

_MOST: Final = 64
"""The most possible answers that need not be written out."""
_MOST_VALUES: Final = 1_000
"""The most values of the texts of all probes."""
_ASK_ANOTHER: Final = "ask for a value that differs between episodes, or give further `answers`"

Text = tuple[str | Drawn, ...]


def probes(resolver: Resolver) -> tuple[ProbePlan, ...]:
    """The entries in the order written; those with a mistake are left out once it has been reported."""
    with resolver.registers.apart():
        return tuple(_plans(resolver))


def _plans(resolver: Resolver) -> Iterator[ProbePlan]:
    left = _MOST_VALUES
    for name, entry in resolver.symbols.scenario.probes.items():
        with surviving():
            plan = _Entry(resolver, name, entry).plan()
            left -= len(list(every(Drawn, (plan.ask, plan.answer, plan.answers))))
            if left < 0:
                message = f"the probes of a scenario have at most {_MOST_VALUES} values in their texts"
                raise resolver.findings.fail("S106", message, plan.span)
            yield plan


class NotedValues:
    """Reads conditions and texts, and gives each value in them a register of its own.

    Args:
        resolver: resolves them.
        name: what their registers begin with.
        undrawn: why nothing may be drawn in them.

    Attributes:
        values: those read so far.
    """

    def __init__(self, resolver: Resolver, name: str, undrawn: str) -> None:
        self._resolver, self._name, self._why = resolver, name, undrawn
        self.values: list[Drawn] = []

    def condition(self, path: DataPath, raw: Expression) -> SitedTerm:
        """The condition at a path, in which nothing is drawn."""
        return self.undrawn(self._resolver.sited(raw, BOOL, step_scope(path)))

    def text(self, part: str, path: DataPath, raw: str) -> Text:
        """The pieces of a text and the values in it."""
        findings, scope = self._resolver.findings, step_scope(path)
        text = findings.text(path, raw)
        pieces: list[str | Drawn] = []
        for piece in parts(self._resolver, text, scope):
            if isinstance(piece, Term):
                sited = self.undrawn(SitedTerm(piece, scope.draws.site, findings.at(path)))
                pieces.append(self.value(f"{part}[{len(pieces)}]", sited))
            else:
                pieces.append(piece)
        return tuple(pieces)

    def value(self, part: str, sited: SitedTerm) -> Drawn:
        """A value with a register of its own."""
        type_ = sited.term.type
        if not type_.is_kept:
            raise self._resolver.findings.too_large(
                "this", type_.farthest, sited.span, hint="bound it: `min(..., 100)`"
            )
        self.values.append(Drawn(f"probes.{self._name}.{part}", type_, sited))
        return self.values[-1]

    def undrawn(self, sited: SitedTerm) -> SitedTerm:
        """The same, in which nothing is drawn: who asks changes nothing."""
        return self._resolver.undrawn(sited, self._why)


class _Entry:
    """One entry, and where it stands."""

    def __init__(self, resolver: Resolver, name: str, entry: Probe) -> None:
        self._resolver, self._findings = resolver, resolver.findings
        self._name, self._entry = name, entry
        self._path: DataPath = ("probes", name)
        self._noted = NotedValues(resolver, name, "a probe draws nothing itself")

    def plan(self) -> ProbePlan:
        """The entry with everything resolved."""
        when, ask, answer, answers = self._parts()
        own = self._resolver.registers.remembered_in((when, self._noted.values))
        span = self._findings.places.key_span(self._path)
        return ProbePlan(self._name, span, when, ask, answer, answers, own)

    def _parts(self) -> tuple[SitedTerm | None, Text, Drawn, tuple[Text, ...]]:
        """When, question, answer and answers, after the mistakes in each of them have been reported."""
        when: SitedTerm | None = None
        ask: Text | None = None
        answers: tuple[Text, ...] | None = None
        fine = False
        with surviving():
            if self._entry.when is not None:
                when = self._noted.condition((*self._path, "when"), self._entry.when)
            fine = True
        with surviving():
            ask = self._noted.text("ask", (*self._path, "ask"), self._entry.ask)
        with surviving():
            answer = self._answer()
            answers = tuple(self._answers(answer))
        if not fine or ask is None or answers is None:
            raise ReportedError
        return when, ask, answer, answers

    def _answer(self) -> Drawn:
        """What is right."""
        path = (*self._path, "answer")
        node = self._findings.expression(path, self._entry.answer)
        scope = step_scope(path)
        term = sayable(self._resolver, node, scope, or_condition=True)
        sited = SitedTerm(term, scope.draws.site, self._findings.at(path))
        return self._noted.value("answer", self._noted.undrawn(sited))

    def _answers(self, answer: Drawn) -> Iterator[Text]:
        """What can be answered: what is written, else all that the answer can be."""
        possible = self._possible(answer)
        if not self._entry.answers:
            if possible is None:
                message = f"the answer can be anything from {answer.type.low} to {answer.type.high}"
                hint = f"list what can be answered in `answers`, or bound it to {_MOST} values"
                raise self._findings.fail("S106", message, answer.value.span, hint=hint)
            self._check_number(len(possible))
            yield from ((word,) for word in possible)
            return
        places = self._findings.each((*self._path, "answers"), self._entry.answers)
        written = [self._noted.text(f"answers[{i}]", path, text) for i, (path, text) in enumerate(places)]
        self._check_written(written, possible)
        yield from written

    def _place(self, number: int) -> DataPath:
        path = (*self._path, "answers")
        return (*path, number) if self._findings.is_list(path) else path

    def _possible(self, answer: Drawn) -> list[str] | None:
        """What the answer can be as far as its declaration says; None if that is too much to list."""
        term = answer.value.term
        if answer.type.kind == "bool":
            return [TRUTHS[value] for value in sorted(values_of(self._resolver, term), reverse=True)]
        if answer.type.size > _MOST_VALUES:
            return None
        values = sorted(values_of(self._resolver, term))
        return list(dict.fromkeys(spoken(term.type, v) for v in values)) if len(values) <= _MOST else None

    def _check_written(self, written: list[Text], possible: list[str] | None) -> None:
        """Answers that are written twice, and those that are missing."""
        known: dict[str, int] = {}
        for i, text in enumerate(written):
            if all(isinstance(piece, str) for piece in text):
                said = normal("".join(map(str, text)))
                if said in known:
                    message = f"`{self._entry.answers[i]}` is among the answers already"
                    raise self._findings.fail("S213", message, self._findings.at(self._place(i)))
                known[said] = i
        self._check_number(len(written))
        if len(known) < len(written):
            return  # what the others are is known only when it is asked
        span = self._findings.at((*self._path, "answers"))
        missing = [word for word in possible or () if normal(word) not in known]
        if missing:
            message = f"the answer can be `{missing[0]}`, which is not among `answers`"
            self._findings.warning(
                "W403",
                message,
                span,
                hint="add it; it would be offered only where it is right, which reveals it",
            )

    def _check_number(self, number: int) -> None:
        if number < 2:
            span = self._findings.at((*self._path, "answers" if self._entry.answers else "answer"))
            message = f"`{self._name}` has only one answer, so nobody is asked"
            self._findings.warning("W404", message, span, hint=_ASK_ANOTHER)
