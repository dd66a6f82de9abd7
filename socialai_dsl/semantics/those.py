"""`those(c in purse where condition)`: the members of a group that a rule affects, or whose registers it sets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem, parse_expression
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.plans import Assignment
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Draws, Scope, quoted
from socialai_dsl.semantics.terms import (
    BOOL,
    Const,
    Read,
    SitedTerm,
    Term,
    Type,
    Variable,
    all_of,
    between,
    changed,
)
from socialai_dsl.semantics.texts import value_for


@dataclass(frozen=True)
class ChosenMember:
    """One of the group: what it is, the condition on which it is one of those, and what its name means then."""

    item: Const
    condition: Term
    scope: Scope


def found(node: ast.Node | None) -> ast.Quantifier | None:
    """`those(...)`, if that is what stands there."""
    return node if isinstance(node, ast.Quantifier) and node.name == groups.THOSE else None


def members(
    resolver: Resolver, node: ast.Quantifier, expected: Type | None, scope: Scope
) -> list[ChosenMember]:
    """The members of the group, each with its condition."""
    groups.check_quantifier(resolver, node, scope)
    known = groups.group(resolver, node.group, expected, scope)
    name = groups.variable_called(node.var, scope)
    variable = Variable(known.type, name)
    inner = replace(scope.binding(node.var, variable), nested=scope.nested + 1)
    assert node.where is not None, "internal: `those` has a condition"
    condition = resolver.value(node.where, BOOL, inner)
    if known.bounds is not None:
        condition = all_of([between(variable, *known.bounds), condition])

    def of(item: Const) -> Callable[[Term], Term | None]:
        return lambda term: item if isinstance(term, Variable) and term.name == name else None

    return [
        ChosenMember(item, changed(condition, of(item)), scope.binding(node.var, item))
        for item in dict.fromkeys(known.items)
    ]


def _mentions(node: ast.Node, variable: str) -> bool:
    return any(isinstance(part, ast.Name) and part.id == variable for part in ast.walk(node))


def _is_about(raw: str, variable: str) -> bool:
    """Whether a value as it is written speaks of a variable; a noun of several words does not."""
    try:
        return _mentions(parse_expression(raw), variable)
    except ParseProblem:
        return False


def _among(item: Const, known: Sequence[Const]) -> bool:
    return any(item.type.kind == one.type.kind and item.value == one.value for one in known)


# -- effects -----------------------------------------------------------------------------------------------------


def affected(
    resolver: Resolver, node: ast.Quantifier, args: tuple[ast.Expr, ...], scope: Scope
) -> Iterator[tuple[list[ChosenMember], Scope, bool]]:
    """Who is affected together, the scope of what the effect takes, and whether that is about each by itself."""
    chosen = members(resolver, node, None, scope)
    if not any(_mentions(arg, node.var) for arg in args):
        yield chosen, scope, False
        return
    for one in chosen:
        yield [one], replace(one.scope, draws=copy(scope.draws)), True


# -- registers of keys -------------------------------------------------------------------------------------------


def assigned(
    resolver: Resolver, register: str, node: ast.Call, raw: object, scope: Scope, own: Scope
) -> Iterator[Assignment]:
    """`set: {trust(those(p in peers where ...)): raw}`: an assignment for each of the group.

    `scope` is that of what is written, `own` that of the key.
    """
    those = found(node.args[0])
    assert those is not None, "internal: the key is `those(...)`"
    known = resolver.registers.keys(register)
    expected = groups.of_any_range(known[0].type) if known else None
    chosen = members(resolver, those, expected, own)
    if strangers := [one.item for one in chosen if not _among(one.item, known)]:
        name = resolver.symbols.word(strangers[0])
        message = f"there is no `{node.name}` for {name}, one of `{quoted(those.group)}`"
        raise resolver.fail("S204", message, those.group, own)
    each = isinstance(raw, str) and _is_about(raw, those.var)
    for one in chosen:
        inner = one.scope.at(scope.path, scope.draws.site) if each else scope
        value = value_for(resolver, register, raw, replace(inner, draws=Draws(scope.draws.site)))
        target = resolver.registers.of_key(register, one.item)
        assert isinstance(target, Read), "internal: a known key has a register"
        only = SitedTerm(one.condition, own.draws.site, value.span)
        yield Assignment(target.path, value, only=only, each=each)
