"""Beliefs: what a member of the cast takes for true, because it saw it last."""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.alternatives import of_each
from socialai_dsl.semantics.findings import surviving
from socialai_dsl.semantics.plans import Activity, BeliefPlan, FramePlan, StatePlan
from socialai_dsl.semantics.registers import Declaration
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import Scope, at_every_step, reset_scope
from socialai_dsl.semantics.terms import BOOL, Sited, Term
from socialai_dsl.source import Span


def register_of(member: str, key: str) -> str:
    """The register that holds a belief."""
    return f"{member}.believes.{key}"


def declare(resolver: Resolver) -> None:
    """Make every belief known; it starts with what is true when the episode begins."""
    for name, member in resolver.symbols.cast.items():
        for key, belief in member.beliefs.items():
            path = _path(resolver, name, key, "of")
            register = register_of(name, key)
            scope = reset_scope(path, f"cast.{name}.beliefs.{key}", name)
            resolver.registers.declare(Declaration(register, key, path, belief.of, scope))


def _path(resolver: Resolver, member: str, key: str, part: str) -> DataPath:
    return (*resolver.symbols.member_path(member, "beliefs"), key, part)


def beliefs(resolver: Resolver) -> Iterator[BeliefPlan]:
    """What members note at the start of their turns."""
    for name, member in resolver.symbols.cast.items():
        for key, belief in member.beliefs.items():
            with surviving():
                register = register_of(name, key)
                of, when = _path(resolver, name, key, "of"), _path(resolver, name, key, "when")
                start = resolver.registers.read(register)
                scope = at_every_step(reset_scope(of, f"cast.{name}.beliefs.{key}", name))
                value = resolver.written(of, belief.of, start.type, scope)
                condition: Sited | None = None
                if belief.when is not None:
                    asked = at_every_step(reset_scope(when, f"cast.{name}.beliefs.{key}.when", name))
                    term = resolver.written(when, belief.when, BOOL, asked)
                    condition = Sited(term, asked.draws.site, resolver.findings.at(when))
                noted = Sited(value, scope.draws.site, resolver.findings.at(of))
                yield BeliefPlan(name, register, noted, condition)


def watching(member: str, number: int, span: Span) -> FramePlan:
    """What a member does who believes something but follows no frame: it stays, and looks."""
    state = StatePlan("looking", (), Activity("stay", (), "", span), (), span)
    return FramePlan(member, "looks on", number, span, state.name, (state,), written=False)


def believed(resolver: Resolver, owner: ast.Attribute, node: ast.Attribute, scope: Scope) -> Term:
    """`sally.believes.toy_in`; of several members, what the one believes who is meant."""
    who = resolver.value(owner.subject, ENTITY, scope)
    members = [resolver.symbols.member_of(number) for number in range(who.type.low, who.type.high + 1)]
    if None in members:
        raise resolver.fail("S211", "only a member of the cast believes something", owner, scope)
    for member in map(str, members):
        known = resolver.symbols.cast[member].beliefs
        if node.name not in known:
            near = did_you_mean(node.name, known)
            hint = None if near else f"declare it: `beliefs: {{{node.name}: {{of: ..., when: sees(...)}}}}`"
            called = (resolver.symbols.group_of(member) or (member, 0))[0]
            message = f"`{called}` has no belief `{node.name}`"
            raise resolver.fail("S201", message, node, scope, suggestion=near, hint=hint)
    return of_each(who, [resolver.registers.read(register_of(str(m), node.name)) for m in members])


def unnamed(subject: str) -> str:
    """What to say of `sally.believes` without the name of a belief."""
    return f"`believes` needs the name of a belief after a dot: `{subject}.believes.where_it_is`"
