"""Whom an utterance addresses: by a slot of the grammar, `to: <whom>`, or in a rule beside `say`, `to: speaker`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema.scenario import Rule
from socialai_dsl.semantics import slots
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import ReportedError, Scope, quoted, surviving
from socialai_dsl.semantics.terms import Line, numbers_of
from socialai_dsl.semantics.texts import Alternative
from socialai_dsl.source import DataPath

_PATH: DataPath = ("grammar", "to")


def of_slot(resolver: Resolver) -> tuple[str, tuple[int, ...]] | None:
    """The slot that says who is addressed, and the member that each of its words addresses."""
    symbols, findings = resolver.symbols, resolver.findings
    written = symbols.scenario.grammar.to
    assert written is not None, "internal: no slot says who is addressed"
    name = written[1:-1]
    slot = symbols.slots.get(name)
    with surviving():
        if slot is None:
            if name in symbols.scenario.grammar.slots:
                raise ReportedError  # it cannot be filled, which has been reported
            near = did_you_mean(name, symbols.slots)
            message = f"the grammar has no slot `{name}`"
            suggestion = f"<{near}>" if near else None
            raise findings.fail("S201", message, findings.places.whole_span(_PATH), suggestion=suggestion)
        members = [value.value for value in slot.values if value.type.kind == "entity"]
        if not members or max(members) >= len(symbols.numbers):
            message = f"the slot `{name}` has something else than members of the cast, whom one can address"
            raise findings.fail("S204", message, findings.at(_PATH))
        return name, tuple(members)
    return None


def addressed(resolver: Resolver, line: Line, raw: str | int | bool, scope: Scope) -> Line:
    """The line as it is said to a member of the cast."""
    findings, symbols = resolver.findings, resolver.symbols
    node = findings.expression(scope.path, raw)
    if scope.member == "agent":
        message = "the agent addresses somebody by what it says: `to: <whom>` in `grammar` names a slot"
        raise resolver.fail("S204", message, node, scope)
    to = resolver.sited(raw, ENTITY, scope)
    numbers = numbers_of(to.term)
    if numbers[-1] >= len(symbols.numbers):
        message = f"`{quoted(node)}` is no member of the cast, so nobody can address it"
        raise resolver.fail("S204", message, node, scope)
    called = tuple(
        (one, slots.name_of(symbols, str(symbols.member_of(one)), scope.path, findings)) for one in numbers
    )
    return replace(line, to=to, called=called)


def only(resolver: Resolver, heard: Sequence[Alternative], rule: Rule, path: DataPath) -> list[Alternative]:
    """What a rule hears, of that only what is said to its member, or only what is not."""
    span = resolver.findings.places.key_span((*path, "addressed"))
    if not rule.hears:
        message = "`addressed` needs `hears`: it is about what was heard"
        resolver.findings.error("S105", message, span, hint="`hears: any` is all that is said")
    elif not resolver.addresses:
        message = "nobody addresses anybody here"
        hint = (
            "`to: <whom>` in `grammar` says whom the agent addresses, `to: ...` beside `say` whom an NPC does"
        )
        resolver.findings.error("S204", message, span, hint=hint)
    return [
        [(replace(pattern, addressed=rule.addressed), condition) for pattern, condition in one]
        for one in heard
    ]
