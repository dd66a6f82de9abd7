"""Who said what a rule hears, and which noun was in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from socialai_dsl.grammar import ast
from socialai_dsl.semantics.build import changed
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.terms import Const, HeardNoun, Pattern, RulePlan, Speaker, Term, Type, World

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver


def speaker(resolver: Resolver, node: ast.Name, scope: Scope) -> Term:
    """`speaker` in a rule; which patterns it is about is filled in once they are known (`bound`)."""
    if not scope.hearing:
        message = "`speaker` is who said what a rule `hears`; there is nothing heard here"
        raise resolver.fail(
            "S211", message, node, scope, hint="add `hears:` to the rule; `hears: any` is anything"
        )
    return Speaker(Type("entity", 0, len(resolver.symbols.numbers) - 1), ())


def noun(resolver: Resolver, scope: Scope) -> Term:
    """`noun`: of what the rule heard, else of what the agent said in this step."""
    nouns = resolver.symbols.nouns
    return HeardNoun(nouns, ()) if scope.hearing else World(nouns, "noun")


def bound(plan: RulePlan, patterns: Sequence[Pattern]) -> RulePlan:
    """A rule whose `speaker` and `noun` know what it hears; what only the agent says needs no search."""
    only_agent = not any(pattern.said_by_npcs for pattern in patterns)

    def change(term: Term) -> Term | None:
        if isinstance(term, Speaker):
            return Const(Type("entity", 0, 0), 0) if only_agent else Speaker(term.type, tuple(patterns))
        if isinstance(term, HeardNoun):
            return World(term.type, "noun") if only_agent else HeardNoun(term.type, tuple(patterns))
        return None

    return changed(plan, change)  # type: ignore[no-any-return]
