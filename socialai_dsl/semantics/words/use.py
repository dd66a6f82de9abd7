"""A value's word where it is written, and the row of the table that says what it means there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Unpack

from socialai_dsl.diagnostics import Advice
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import ReportedError, Scope
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import Term, Type


@dataclass(frozen=True, slots=True)
class Use:
    """A value's word where it is written.

    Attributes:
        signature: the word.
        node: all of it, `door.next_to(x)`, for messages.
        subject: what is written before the dot; None: nothing.
        args: what is written in brackets.
        expected: the type that is wanted here; None: any.
    """

    resolver: Resolver
    signature: Signature
    node: ast.Name | ast.Attribute | ast.Call
    subject: ast.Expr | None
    args: tuple[ast.Expr, ...]
    expected: Type | None
    scope: Scope

    def subject_or_candidate(self) -> Term | None:
        """What it is asked of; None: the candidate cell of a place, `here`."""
        return groups.subject_of(self.resolver, self.subject, self.signature, self.node, self.scope)

    def about(self) -> Term:
        """What it is asked of: the part before the dot, else the member whose frame this is."""
        found = self.subject_or_candidate()
        assert found is not None, f"internal: the candidate cell has no `{self.signature.name}`"
        return found

    def value(self, place: int, expected: Type | None) -> Term:
        """An argument."""
        return self.resolver.value(self.args[place], expected, self.scope)

    def each(self, place: int, relation: Callable[[Term], Term]) -> Term:
        """A relation to an argument, or to any of it if it is a group."""
        node = self.args[place]
        if groups.is_group(self.resolver, node, self.scope):
            return groups.any_member(self.resolver, node, self.scope, relation)
        return relation(self.resolver.somewhere(node, self.scope))

    def fail(
        self, code: str, message: str, node: ast.Expr | None = None, **more: Unpack[Advice]
    ) -> ReportedError:
        """Report what is wrong with it, or with a part of it; raising the result gives it up."""
        return self.resolver.fail(code, message, node or self.node, self.scope, **more)


@dataclass(frozen=True, slots=True, kw_only=True)
class Value(Signature):
    """A word for a condition or another value; `meaning` is the term that a use of it stands for."""

    meaning: Callable[[Use], Term]
