"""What a scenario claims about itself: the entries of `check`, resolved like conditions on the outcome."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Literal, get_args

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import Property
from socialai_dsl.schema.base import Expression
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.build import draws, walk
from socialai_dsl.semantics.findings import FailedError, dotted, surviving
from socialai_dsl.semantics.plans import Drawn, OutcomePlan, PropertyPlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import at_every_step, reset_scope
from socialai_dsl.semantics.terms import (
    BOOL,
    Chance,
    Compare,
    Const,
    Logic,
    Not,
    Quantified,
    Sited,
    Term,
    Variable,
)

_Kind = Literal["reachable", "never", "within", "oracle", "script", "needs", "only_through", "knowable"]
KINDS: tuple[_Kind, ...] = get_args(_Kind)
DEADLY = "deadly"

_WITH = {"share": ("reachable", "within", "script", "needs", "knowable"), "draw": ("needs",)}
"""Keys that say more, and what they can be said about."""

Draw = tuple[str, tuple[int, ...]]
"""A register, and its values; one that is drawn with a greater chance is there several times."""


def properties(
    resolver: Resolver, outcomes: Sequence[OutcomePlan], drawn: Iterable[Drawn]
) -> Iterator[PropertyPlan]:
    """The entries of `check`, in the order written; those with a mistake are left out once it has been reported."""
    lets = {item.path: item for item in drawn if item.path.startswith("let.")}
    for i, entry in enumerate(resolver.symbols.scenario.check):
        with surviving():
            yield _Entry(resolver, entry, ("check", i)).plan(outcomes, lets)


class _Entry:
    """One entry, and where it stands."""

    def __init__(self, resolver: Resolver, entry: Property, path: DataPath) -> None:
        self._resolver, self._findings = resolver, resolver.findings
        self._entry, self._path = entry, path

    def plan(self, outcomes: Sequence[OutcomePlan], lets: dict[str, Drawn]) -> PropertyPlan:
        """The entry with everything resolved."""
        kind, entry = self._kind(), self._entry
        place = (*self._path, kind)
        plan = PropertyPlan(
            kind, "", dotted(self._path), self._findings.places.key_span(place), share=entry.share
        )
        match kind:
            case "reachable" | "never":
                raw = entry.reachable if kind == "reachable" else entry.never
                assert raw is not None, "internal: there is a value for this key"
                goals = _outcomes_called(str(raw), outcomes)
                if goals:
                    return replace(plan, text=f"{kind}: {raw}", goals=goals)
                condition, remembered = self._condition(place, raw)
                return replace(
                    plan, text=f"{kind}: {raw}", condition=condition, remembered=remembered, share=entry.share
                )
            case "within":
                return replace(
                    plan, text=f"within: {entry.within}", steps=entry.within or 0, share=entry.share
                )
            case "oracle":
                return replace(plan, text=f"oracle: {entry.oracle:g}", share=entry.oracle)
            case "knowable":
                text = f"knowable: {str(entry.knowable).lower()}"
                return replace(plan, text=text, expected=bool(entry.knowable))
            case "script":
                return replace(plan, text=f"script: {entry.script}")
            case "needs":
                members = self._members(place, entry.needs or ())
                tried = (
                    list(lets) if entry.draw is None else [self._let((*self._path, "draw"), entry.draw, lets)]
                )
                found = tuple((path, values) for path in tried if len(set(values := _values(lets[path]))) > 1)
                if entry.draw is not None and not found:
                    raise self._not_a_pick((*self._path, "draw"), entry.draw)
                return replace(
                    plan, text=f"needs: {', '.join(members)}", members=members, draws=found, share=entry.share
                )
            case "only_through":
                assert entry.only_through is not None, "internal: there is a value for this key"
                word, by = entry.only_through.draw, entry.only_through.by
                path = self._let((*place, "draw"), word, lets)
                members = self._members((*place, "by"), by)
                if len(set(values := _values(lets[path]))) < 2:
                    raise self._not_a_pick((*place, "draw"), word)
                text = f"only_through: {word} by {', '.join(members)}"
                return replace(plan, text=text, members=members, draws=((path, values),))

    def _kind(self) -> _Kind:
        given = [kind for kind in KINDS if getattr(self._entry, kind) is not None]
        if len(given) != 1:
            listed = ", ".join(f"`{kind}`" for kind in KINDS)
            message = f"a property has {'only one' if given else 'one'} of {listed}"
            span = self._findings.places.value_span(self._path)
            raise self._findings.fail("S107" if given else "S105", message, span)
        for key, kinds in _WITH.items():
            if getattr(self._entry, key) is not None and given[0] not in kinds:
                listed = ", ".join(f"`{kind}`" for kind in kinds)
                message = f"`{key}` says nothing about `{given[0]}`; it goes with {listed}"
                raise self._findings.fail("S107", message, self._findings.places.key_span((*self._path, key)))
        return given[0]

    def _condition(self, path: DataPath, raw: Expression) -> tuple[Sited, tuple[Drawn, ...]]:
        """A condition, and what it alone asks about the step before."""
        remembered = self._resolver.registers.remembered
        asked = len(remembered)
        scope = at_every_step(reset_scope(path))
        try:
            term = self._resolver.written(path, raw, BOOL, scope)
            used = {part.path for part in walk(term) if hasattr(part, "path")}
            own = tuple(drawn for drawn in remembered if drawn.path in used)
        finally:
            del remembered[asked:]
        if draws(term) or any(isinstance(part, Chance) for part in walk(term)):
            message = "a property draws nothing itself"
            hint = "draw it in `let`, and use that"
            raise self._findings.fail("S204", message, self._findings.at(path), hint=hint)
        return Sited(term, scope.draws.site, self._findings.at(path)), own

    def _members(self, path: DataPath, names: Sequence[str]) -> tuple[str, ...]:
        symbols = self._resolver.symbols
        npcs = [name for name in symbols.cast if name != "agent"]
        members: list[str] = []
        for i, name in enumerate(names):
            if name not in npcs and name not in symbols.groups:
                place = (*path, i) if self._findings.is_list(path) else path
                near = did_you_mean(name, [*npcs, *symbols.groups])
                message = f"`{name}` is no NPC of the cast"
                raise self._findings.fail(
                    "S201", message, self._findings.at(place, width=len(name)), suggestion=near
                )
            members += symbols.groups.get(name, (name,))
        return tuple(dict.fromkeys(members))

    def _let(self, path: DataPath, word: str, lets: dict[str, Drawn]) -> str:
        if f"let.{word}" not in lets:
            if word in self._resolver.symbols.scenario.let and self._findings.bag.has_errors:
                raise FailedError  # its value means nothing, which has been reported
            near = did_you_mean(word, [known.removeprefix("let.") for known in lets])
            message = f"`{word}` is not drawn in `let`"
            raise self._findings.fail(
                "S201", message, self._findings.at(path, width=len(word)), suggestion=near
            )
        self._resolver.used.add(("let", word))
        return f"let.{word}"

    def _not_a_pick(self, path: DataPath, word: str) -> Exception:
        message = f"`{word}` is no free choice of several values"
        hint = "name a `let` that is a pick whose condition, if any, reads nothing that is drawn"
        return self._findings.fail("S204", message, self._findings.at(path, width=len(word)), hint=hint)


def _outcomes_called(word: str, outcomes: Sequence[OutcomePlan]) -> tuple[str, ...]:
    """The ways to end that a word names: `success`, `failure`, `deadly`, or an outcome's id."""
    match word.strip():
        case "success":
            return tuple(outcome.name for outcome in outcomes if outcome.success)
        case "failure":
            return (*(outcome.name for outcome in outcomes if not outcome.success), DEADLY)
        case "deadly":
            return (DEADLY,)
        case name:
            return tuple(outcome.name for outcome in outcomes if outcome.name == name)


def _values(drawn: Drawn) -> tuple[int, ...]:
    """The values that a draw has in every room, as often as they weigh; none if that depends on other draws."""
    term = drawn.value.term
    if not isinstance(term, Quantified) or term.op != "pick" or term.cells:
        return ()
    found = []
    for item in term.items:
        kept = 1 if term.condition is None else _constant(term.condition, {term.variable: item.value})
        if kept is None:
            return ()
        found += [item.value] * bool(kept)
    return tuple(found)


def _constant(term: Term, variables: dict[str, int]) -> int | None:
    """The value of a term that depends on nothing but variables; None if it depends on more."""
    match term:
        case Const(value=value):
            return value
        case Variable(name=name):
            return variables.get(name)
        case Not(arg=arg):
            truth = _constant(arg, variables)
            return None if truth is None else int(not truth)
        case Logic(op=op, args=args):
            values = [_constant(arg, variables) for arg in args]
            if None in values:
                return None
            return int(all(values) if op == "and" else any(values))
        case Compare(op=op, left=left, right=right):
            a, b = _constant(left, variables), _constant(right, variables)
            if a is None or b is None:
                return None
            return int({"==": a == b, "!=": a != b, "<": a < b, "<=": a <= b}[op])
    return None
