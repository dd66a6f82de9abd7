"""The body actions that an activity needs, of which the agent has only some."""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl import cures
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.plans import Activity
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Scope, quoted
from socialai_dsl.semantics.terms import Const, Term
from socialai_dsl.semantics.words.activities import Deed
from socialai_dsl.vocabulary import PRIMITIVES


def check_actions(resolver: Resolver, found: Activity, word: Deed, node: ast.Expr, scope: Scope) -> None:
    """The agent has only the actions that the scenario gives it, so a frame that it follows has no others."""
    scenario = resolver.symbols.scenario
    lacking = [action for action in _actions_of(found, word, resolver) if action not in scenario.actions]
    if lacking:
        listed = " and ".join(f"`{action}`" for action in lacking)
        message = f"`{quoted(node)}` needs {listed}, which the agent cannot do"
        edits = (cures.added(resolver.findings.places, ("actions",), action) for action in lacking)
        hint = cures.propose(f"add {listed} to `actions`", *edits, also="or let the script do without it")
        raise resolver.fail("S320", message, node, scope, hint=hint)


def _actions_of(found: Activity, word: Deed, resolver: Resolver) -> Iterator[str]:
    """The body actions that an activity of the agent may take."""
    match found.name:
        case "choose" | "turn":
            for arg in found.args:
                words = (
                    arg.type.words
                    if not isinstance(arg, Const)
                    else (arg.type.words[arg.value - arg.type.low],)
                )
                yield from (word for word in words if word in PRIMITIVES)
        case "perform":
            yield from groups.moves_of(resolver, found.args)
        case "enter" if not _shuts(resolver, found.args[0]):
            yield from ("forward", "left", "right")
        case _:
            yield from word.actions


def _shuts(resolver: Resolver, what: Term) -> bool:
    """Whether an object can be in a status in which it has to be used before it can be entered."""
    objects = resolver.symbols.object_of(what.type.low)
    return objects is None or len(objects.type.walkable) < len(objects.type.states)
