"""What can be carried, and what is asked of hands: `carries`, `carried`, `empty_handed`, and receivers."""

from __future__ import annotations

from collections.abc import Sequence

from socialai_dsl import cures
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import ReportedError, Scope, quoted, with_article
from socialai_dsl.semantics.terms import (
    Compare,
    Const,
    FieldOf,
    Not,
    Term,
    Type,
    Variable,
    all_of,
    arithmetic,
    as_number,
    entity,
    number,
)
from socialai_dsl.source import Span

CARRYABLE = "what can be carried says so: `carryable: true`"


def carryable(resolver: Resolver) -> tuple[int, ...]:
    """Numbers of the objects that can be carried."""
    described = resolver.symbols.scenario.objects
    return tuple(
        number
        for objects in resolver.symbols.objects.values()
        if described[objects.name].carryable
        for number in objects.numbers
    )


def is_member(resolver: Resolver, term: Term) -> bool:
    """Whether a term stands for members of the cast only."""
    return term.type.kind == "entity" and term.type.high < len(resolver.symbols.numbers)


def carries(resolver: Resolver, who: Term, what: ast.Expr, node: ast.Expr, scope: Scope) -> Term:
    """`ann.carries(x)`; of a group, any of it."""
    _check_hands(resolver, who, node, scope)
    if groups.is_group(resolver, what, scope):
        return groups.any_member(resolver, what, scope, lambda one: _in_hands(resolver, who, one))
    thing = resolver.value(what, ENTITY, scope)
    check_carried(resolver, thing, what, scope)
    return _in_hands(resolver, who, thing)


def _may_be_carried(resolver: Resolver, thing: Term) -> bool:
    known = carryable(resolver)
    return thing.type.kind == "entity" and any(thing.type.low <= n <= thing.type.high for n in known)


def check_carried(resolver: Resolver, thing: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what nobody can carry."""
    if is_member(resolver, thing):
        message = f"`{quoted(node)}` is somebody, and only things are carried"
        raise resolver.fail("S204", message, node, scope)
    if not _may_be_carried(resolver, thing):
        raise resolver.fail("S204", f"`{quoted(node)}` cannot be carried", node, scope, hint=CARRYABLE)


def empty_handed(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """Whether a member carries nothing."""
    _check_hands(resolver, who, node, scope)
    things = map(entity, carryable(resolver))
    return all_of([Not(_in_hands(resolver, who, thing)) for thing in things])


def carried(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """`ann.carried`: what she carries, if anything."""
    _check_hands(resolver, who, node, scope)
    numbers = carryable(resolver)
    type_ = Type("entity", min(numbers), max(numbers))
    members = groups.Group(type_, tuple(Const(type_, number) for number in numbers))
    name = f"carried#{scope.nested}"
    condition = _in_hands(resolver, who, Variable(type_, name))
    return groups.quantification("first", members, name, condition, scope)


def nothing_carried(resolver: Resolver, message: str, span: Span) -> ReportedError:
    """Report that nothing can be carried, once: all that is asked of hands then fails for the same reason."""
    if "carryable" in resolver.reported:
        return ReportedError()
    resolver.reported.add("carryable")
    return resolver.findings.fail("S204", message, span, hint=CARRYABLE)


def _check_hands(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what has no hands, and a scenario in which nothing is carried."""
    if not is_member(resolver, who):
        raise resolver.fail("S204", "only members of the cast carry something", node, scope)
    if not carryable(resolver):
        raise nothing_carried(
            resolver, "nothing here can be carried", resolver.findings.node(scope.path, node)
        )


def _in_hands(resolver: Resolver, who: Term, thing: Term) -> Term:
    """Whether a thing is carried: its register holds 0, or 1 + the number of its carrier."""
    members = len(resolver.symbols.numbers)
    by = arithmetic("+", as_number(who), number(1))
    return Compare("==", FieldOf(Type("int", 0, members), thing, "carrier"), by)


def check_arguments(
    resolver: Resolver, name: str, terms: Sequence[Term], nodes: Sequence[ast.Expr], scope: Scope
) -> None:
    """Report what cannot be fetched, given or brought, and to whom or where."""
    if len(terms) == 2 and not _may_be_carried(resolver, terms[0]) and _may_be_carried(resolver, terms[1]):
        message = f"`{quoted(nodes[0])}` cannot be carried, and `{quoted(nodes[1])}` can"
        swapped = f"{name}({quoted(nodes[1])}, {quoted(nodes[0])})"
        edits = (
            resolver.findings.instead(scope.path, nodes[0], quoted(nodes[1])),
            resolver.findings.instead(scope.path, nodes[1], quoted(nodes[0])),
        )
        hint = cures.propose(f"write `{swapped}`", *edits)
        raise resolver.fail("S204", message, nodes[0], scope, hint=hint)
    check_carried(resolver, terms[0], nodes[0], scope)
    for where, node in zip(terms[1:], nodes[1:], strict=True):
        _check_recipient(resolver, name, where, node, scope)


def _check_recipient(resolver: Resolver, name: str, where: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what nothing can be given to, or laid down on."""
    if where.type.kind == "cell" or is_member(resolver, where):
        return
    called = quoted(node)
    if name == "give":
        raise resolver.fail("S204", f"`{called}` is nobody; things are given to somebody", node, scope)
    for one in where.type.values:
        objects = resolver.symbols.object_of(one)
        if objects is None:
            message = f"`{called}` may be somebody, or a thing in the room: say which of them"
            raise resolver.fail("S204", message, node, scope)
        if not objects.type.walkable:
            message = f"nothing can be laid down on {with_article(objects.type.name)}"
            hint = f"bring it to a cell: `nearest(c in cells where c.next_to({called}) to self)` in a `let`"
            raise resolver.fail("S204", message, node, scope, hint=hint)
