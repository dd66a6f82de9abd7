"""Conditional values: `a if condition else b`, of one type whichever is taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.semantics.resolver import INT, SAYABLE, Resolver, same_kind
from socialai_dsl.semantics.scope import Draws, ReportedError, Scope, common_type, described, quoted, spoken
from socialai_dsl.semantics.terms import (
    BOOL,
    Compare,
    Const,
    Operation,
    Select,
    Term,
    Type,
    constants,
    is_own_noun,
    may_be_nothing,
    numbers_of,
)

_MOST_WORDS: Final = 256
"""The most texts that one value may be read as, where another is a text."""


@dataclass(frozen=True)
class _Branch:
    """What is taken on a condition; the last of a chain of `else` has none."""

    node: ast.Expr
    value: Term
    condition: Term | None


def conditional(resolver: Resolver, node: ast.Conditional, expected: Type | None, scope: Scope) -> Term:
    """The term of a conditional value; one whose condition is known is the value that is taken."""
    hint = expected if expected is not None else _type_of_lead(resolver, node, scope)
    branches: list[_Branch] = []
    failed = False
    rest: ast.Expr | None = node
    while rest is not None:
        chosen = rest.value if isinstance(rest, ast.Conditional) else rest
        try:
            value = _value(resolver, chosen, expected, hint, scope)
            asked = rest.condition if isinstance(rest, ast.Conditional) else None
            condition = resolver.value(asked, BOOL, scope) if asked is not None else None
            branches.append(_Branch(chosen, value, condition))
        except ReportedError:
            failed = True  # the others may have mistakes of their own
        rest = rest.other if isinstance(rest, ast.Conditional) else None
    if failed:
        raise ReportedError
    return _taken(_of_one_type(resolver, node, branches, scope))


def _type_of_lead(resolver: Resolver, node: ast.Expr, scope: Scope) -> Type | None:
    """The type of the first value that has one of its own; it is only looked at, so its picks are not numbered."""
    lead = resolver.lead(node, scope)
    if lead is None:
        return None
    return resolver.value(lead, None, replace(scope, draws=Draws(scope.draws.site))).type


def _value(
    resolver: Resolver, node: ast.Expr, expected: Type | None, hint: Type | None, scope: Scope
) -> Term:
    """A value that may be taken; a bare word is of the type of the others, unless it is a text that is none of them."""
    if expected is None and resolver.is_bare(node, scope):
        is_text = isinstance(node, ast.Text) and hint is not None and node.plain not in hint.words
        return resolver.value(node, None if is_text else hint, scope)
    return resolver.value(node, expected, scope)


def _of_one_type(resolver: Resolver, node: ast.Expr, branches: list[_Branch], scope: Scope) -> list[_Branch]:
    kinds = {branch.value.type.kind for branch in branches}
    if kinds == {"int", "noun"}:
        return [replace(b, value=resolver.fit(b.value, INT, b.node, scope)) for b in branches]
    if "text" in kinds and kinds <= {*SAYABLE}:
        return _as_texts(resolver, branches, scope)
    first = branches[0]
    for other in branches[1:]:
        if not same_kind(other.value.type, first.value.type):
            a, b = described(first.value.type), described(other.value.type)
            message = (
                f"`{quoted(first.node)}` is {a}, but `{quoted(other.node)}` is {b}: one value has one type"
            )
            both_places = {first.value.type.kind, other.value.type.kind} == {"entity", "cell"}
            hint = "the cell of something is `x.cell`" if both_places else None
            raise resolver.fail("S204", message, other.node, scope, hint=hint)
    return branches


def _taken(branches: Sequence[_Branch]) -> Term:
    """The value beside the first condition that holds, with room for all that it can be."""
    *asked, last = branches
    kept: list[_Branch] = []
    for branch in asked:
        if not isinstance(branch.condition, Const):
            kept.append(branch)
        elif branch.condition.value:
            last = branch
            break
    if not kept:
        return _needed(last.value)
    values = [_needed(branch.value) for branch in (*kept, last)]
    conditions = tuple(branch.condition for branch in kept if branch.condition is not None)
    return Select(common_type(values), conditions, tuple(values[:-1]), values[-1])


def _needed(value: Term) -> Term:
    """The value of a branch as an operand, so that an empty register is not found, also in a comparison."""
    return (
        Operation(value.type, "max", (value, Const(value.type, value.type.low)))
        if may_be_nothing(value)
        else value
    )


# -- texts, which have words of their own ----------------------------------------------------------------------


def _as_texts(resolver: Resolver, branches: list[_Branch], scope: Scope) -> list[_Branch]:
    """The same with every value a text, of a type that has the words of all."""
    words: dict[str, None] = {}
    for branch in branches:
        if branch.value.type.size > _MOST_WORDS:
            message = f"`{quoted(branch.node)}` can be {branch.value.type.size} numbers, too many to be texts"
            raise resolver.fail("S204", message, branch.node, scope, hint="bound it: `min(..., 99)`")
        words |= {spoken(branch.value.type, value): None for value in numbers_of(branch.value)}
    type_ = Type("text", 0, len(words) - 1, tuple(words))
    return [replace(branch, value=_as_text(branch.value, type_)) for branch in branches]


def _as_text(term: Term, type_: Type) -> Term:
    """A value as one of the words of `type_`."""
    if isinstance(term, Const):
        return Const(type_, type_.words.index(spoken(term.type, term.value)))
    if isinstance(term, Select):
        values = tuple(_as_text(value, type_) for value in term.values)
        return Select(type_, term.conditions, values, _as_text(term.default, type_))
    known = constants(term.type)
    # As a text a noun is needed: where there is none, nothing is found.
    asked = replace(term, type=replace(term.type, kind="text")) if is_own_noun(term) else term
    *texts, last = (_as_text(value, type_) for value in known)
    cases = tuple(Compare("==", asked, value) for value in known[:-1])
    if may_be_nothing(term):  # as a text it is needed as well
        cases, texts = (Compare("<", term, known[0]), *cases), [last, *texts]
    return Select(type_, cases, tuple(texts), last) if cases else last
