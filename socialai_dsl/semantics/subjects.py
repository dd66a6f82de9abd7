"""The subjects of verbs and attributes: what may stand before the dot, and when it may be asked."""

from __future__ import annotations

from socialai_dsl.grammar import ast
from socialai_dsl.semantics import resolve_groups
from socialai_dsl.semantics.build import entity
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import CELL, Here, Term
from socialai_dsl.semantics.wording import quoted, usage

OF_CELLS = frozenset({"in_line", "unobstructed", "distance", "dir_to", "x", "y"})
"""What a cell that is no candidate for a placement can be asked as well."""


def check_points(resolver: Resolver, name: str, who: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what cannot point: an object, and the agent, which has no arm to do it with."""
    if who.type.high >= len(resolver.symbols.numbers):
        raise resolver.fail("S204", f"only NPCs point, so only they have `{name}`", node, scope)
    if who.type.high == 0:
        raise resolver.fail("S204", "the agent never points; only NPCs do", node, scope)


def check_toggled(resolver: Resolver, name: str, who: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what nobody uses."""
    if who.type.low < len(resolver.symbols.numbers):
        message = f"only objects are toggled, so only they have `{name}`"
        raise resolver.fail("S204", message, node, scope, hint="an NPC is poked: `anna.poked`")


def check_moment(resolver: Resolver, signature: Signature, node: ast.Expr, scope: Scope) -> None:
    """Report what speaks of a step where there is none yet."""
    if signature.momentary and scope.at_reset:
        message = (
            f"`{signature.name}` speaks of a step, but this value is computed once, before the first step"
        )
        hint = "a `define` is recomputed at every use" if "let" in scope.path else None
        if "beliefs" in scope.path:
            hint = "a belief is there from the start, so it is about something that is true before the first step"
        raise resolver.fail("S204", message, node, scope, hint=hint)


def subject_of(
    resolver: Resolver, subject: ast.Expr | None, signature: Signature, node: ast.Expr, scope: Scope
) -> Term | None:
    """Who a verb is about: what stands before the dot, else the NPC itself. None: the candidate cell."""
    if subject is None:
        if scope.member is None:
            example = "agent" if signature.subject != "object" else "door"
            raise resolver.fail(
                "S211", f"`{signature.name}` needs somebody: `{example}.{signature.name}`", node, scope
            )
        return entity(resolver.symbols.numbers[scope.member])
    if isinstance(subject, ast.Name) and subject.id == "here" and "here" not in scope.variables:
        if not scope.here:
            raise resolver.fail(
                "S201", "`here` is the candidate cell; it means something only in a place", subject, scope
            )
        if signature.name in OF_CELLS and not signature.cell:
            return Here(CELL, "cell")
        if not signature.cell:
            raise resolver.fail("S211", f"a cell cannot be asked for `{signature.name}`", node, scope)
        return None
    if resolve_groups.is_group(resolver, subject, scope):
        group = quoted(subject)
        letter = group[0] if group[0].isalpha() else "x"
        asked = f"{letter}.{usage(signature)}"
        hint = f"`any({letter} in {group} where {asked} ...)`, or `all`, `first`, `pick`"
        raise resolver.fail("S204", f"`{group}` is a group: say which of them", subject, scope, hint=hint)
    who = resolver.value(subject, None, scope)
    if who.type.kind == "cell" and (signature.cell or signature.name in OF_CELLS):
        return who
    return resolver.fit(who, ENTITY, subject, scope)


def must_be_agent(resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope) -> None:
    """Report what is known of the agent only, asked of somebody else."""
    subject = None if isinstance(node, ast.Name) else node.subject
    if subject is None and scope.member == "agent":
        return
    if not (isinstance(subject, ast.Name) and subject.id == "agent"):
        name = node.id if isinstance(node, ast.Name) else node.name
        hint = "what an NPC has heard is `heard(...)`, or `hears:` in a rule" if name == "said" else None
        raise resolver.fail(
            "S211", f"`{name}` is known of the agent only: `agent.{name}`", node, scope, hint=hint
        )
