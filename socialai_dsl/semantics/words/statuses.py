"""The status of objects: a field whose words their type declares."""

from __future__ import annotations

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Scope, with_article
from socialai_dsl.semantics.terms import FieldOf, Term, Type, equals


def has_status(resolver: Resolver, status: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """`door.open`: whether an object has a status that its type can have."""
    field = status_of(resolver, who, node, scope)
    if status not in field.type.words:
        what = resolver.symbols.object_of(who.type.low)
        assert what is not None, "internal: a status belongs to an object"
        message = f"{with_article(what.type.name)} is never `{status}`; it is {' or '.join(field.type.words)}"
        raise resolver.fail("S204", message, node, scope, suggestion=did_you_mean(status, field.type.words))
    return equals(field, field.type.words.index(status))


def status_of(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> FieldOf:
    """The status of one object, or of one of several objects of the same type."""
    found = [resolver.symbols.object_of(n) for n in who.type.values]
    types = {objects.type.name: objects.type for objects in found if objects is not None}
    if None in found or len(types) != 1:
        several = [*types, *(["member of the cast"] if None in found else [])]
        message = f"this may be a {' or a '.join(several)}, which have no status in common"
        hint: str | None = "name objects of one type, which stand next to each other in `objects`"
        if not types:
            message, hint = "only objects have a status", None
        raise resolver.fail("S204", message, node, scope, hint=hint)
    (type_,) = types.values()
    return FieldOf(Type("status", 0, len(type_.states) - 1, type_.states), who, "status")
