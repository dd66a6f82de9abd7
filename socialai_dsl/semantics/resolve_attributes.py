"""Attributes and conditions without brackets, and the subjects of verbs."""

from __future__ import annotations

from dataclasses import replace

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import beliefs, contents, hearing, links
from socialai_dsl.semantics.alternatives import of_each
from socialai_dsl.semantics.build import any_of, arithmetic, entity, number
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import VALUE_SYNONYMS, VALUES, Signature
from socialai_dsl.semantics.subjects import (
    check_moment,
    check_points,
    check_toggled,
    must_be_agent,
    subject_of,
)
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    CELL,
    COLOR,
    DIRECTION,
    CellOf,
    Compare,
    Const,
    FieldOf,
    Here,
    PokedNow,
    Read,
    Term,
    Type,
    World,
)
from socialai_dsl.semantics.wording import quoted, usage, with_article

_POINTING = Type("int", 0, 4)


def toggled_by(who: Const, what: Term) -> Term:
    """Whether the agent toggled at something in this step, or an NPC did so in its last turn."""
    if who.value == 0:
        return PokedNow(what)
    return Compare("==", FieldOf(what.type, who, "toggled"), what)


def without_arguments(
    resolver: Resolver, name: str, subject: ast.Expr | None, node: ast.Expr, scope: Scope
) -> Term:
    """`subject.name` or `subject.name()`: an attribute, a condition, or a status."""
    signature = VALUES.get(name)
    statuses = {state for type_ in resolver.symbols.types.values() for state in type_.states}
    if signature is None or signature.takes:
        if name in statuses:
            signature = Signature(name, "object", (), "condition", "value", "")
        else:
            raise _unknown_attribute(resolver, name, signature, statuses, node, scope)
    check_moment(resolver, signature, node, scope)
    if signature.subject == "agent":
        assert isinstance(node, ast.Call | ast.Attribute | ast.Name), "internal: an attribute has a name"
        if name == "spoke":
            return hearing.spoke(resolver, node, scope)
        must_be_agent(resolver, node, scope)
        return _of_the_agent(resolver, name)
    who = subject_of(resolver, subject, signature, node, scope)
    if who is None:
        return _cell_coordinate(resolver, name)
    if name == "unlocked_by":
        return links.unlocker(resolver, who, node, scope)
    if signature.subject == "object" and name not in ("inside", "toggled"):
        return _status(resolver, name, who, node, scope)
    return _attribute(resolver, name, who, node, scope)


def _unknown_attribute(
    resolver: Resolver,
    name: str,
    signature: Signature | None,
    statuses: set[str],
    node: ast.Expr,
    scope: Scope,
) -> FailedError:
    if signature is not None:
        return resolver.fail(
            "S211", f"`{name}` needs something in brackets: `{usage(signature)}`", node, scope
        )
    if name == "believes" and isinstance(node, ast.Attribute):
        return resolver.fail("S211", beliefs.unnamed(quoted(node.subject)), node, scope)
    synonym = VALUE_SYNONYMS.get(name)
    if synonym:
        return resolver.fail(
            "S205", f"nothing here has a `{name}`; write `{usage(VALUES[synonym])}`", node, scope
        )
    known = [s.name for s in VALUES.values() if not s.takes and s.subject != "none"]
    near = did_you_mean(name, [*known, *sorted(statuses), *_of_frame(resolver, node)])
    near = near or did_you_mean(name, [s.name for s in VALUES.values() if s.subject != "none"])
    return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, suggestion=near)


def _of_frame(resolver: Resolver, node: ast.Expr) -> list[str]:
    """The registers and slots of the member of the cast that is named before the dot."""
    subject = node.subject if isinstance(node, ast.Attribute) else None
    played = resolver.frames.get(subject.id) if isinstance(subject, ast.Name) else None
    return [*played.model.slots, *played.model.let] if played is not None else []


def _of_the_agent(resolver: Resolver, name: str) -> Term:
    match name:
        case "noun":
            return World(resolver.symbols.nouns, "noun")
    assert name == "action", f"internal: the agent has no `{name}`"
    return World(ACTION, "action")


def _cell_coordinate(resolver: Resolver, name: str) -> Term:
    high = (resolver.symbols.width if name == "x" else resolver.symbols.height)[1]
    return Here(Type("int", 0, high - 1), "x" if name == "x" else "y")


def _attribute(resolver: Resolver, name: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    match name:
        case "color":
            return FieldOf(COLOR, who, "color")
        case "facing":
            return FieldOf(DIRECTION, who, "dir")
        case "x" | "y":
            high = (resolver.symbols.width if name == "x" else resolver.symbols.height)[1]
            return FieldOf(Type("int", -1, high - 1), who, "x" if name == "x" else "y")
        case "gone":
            return FieldOf(BOOL, who, "gone")
        case "was_poked":
            if resolver.symbols.object_of(who.type.high) is not None:
                message = "only an NPC remembers that it was poked"
                raise resolver.fail(
                    "S204", message, node, scope, hint="`x.poked` is whether it was in this step"
                )
            return FieldOf(BOOL, who, "poked")
        case "poked":
            return PokedNow(who)
        case "index":
            return _index(resolver, who, node, scope)
        case "cell":
            return CellOf(CELL, who)
        case "pointing":
            check_points(resolver, name, who, node, scope)
            return Compare("!=", FieldOf(_POINTING, who, "pointing"), Const(_POINTING, 0))
        case "inside":
            return contents.container(resolver, who, node, scope)
        case "toggled":
            check_toggled(resolver, name, who, node, scope)
            everybody = range(len(resolver.symbols.numbers))
            return any_of(toggled_by(entity(number), who) for number in everybody)
        case "turns_in_state":
            return _turns_in_state(resolver, who, node, scope)
        case "kind":
            return _kind(resolver, who, node, scope)
    assert name == "name", f"internal: no meaning for the attribute `{name}`"
    return _name(resolver, who, node, scope)


def _name(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    numbers = [who.value] if isinstance(who, Const) else range(who.type.low, who.type.high + 1)
    members = [resolver.symbols.member_of(number) for number in numbers]
    names = [resolver.registers.read(f"{member}.name") for member in members if member is not None]
    if len(names) < len(members):
        raise resolver.fail("S204", "only a member of the cast has a name", node, scope)
    return of_each(who, names)


def _turns_in_state(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """The clock of a member's frame, which `after` compares as well."""
    numbers = [who.value] if isinstance(who, Const) else range(who.type.low, who.type.high + 1)
    members = [resolver.symbols.member_of(number) for number in numbers]
    if not all(member in resolver.frames for member in members):
        hint = "members of the cast follow one with `frame:`"
        raise resolver.fail("S204", "only who follows a frame is in a state", node, scope, hint=hint)
    turns = Type("int", 0, resolver.symbols.scenario.horizon)
    return of_each(who, [Read(turns, f"{member}.clock") for member in members])


def _kind(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    kinds = {_kind_of(resolver, n) for n in range(who.type.low, who.type.high + 1)}
    if len(kinds) > 1:
        raise resolver.fail("S204", "`kind` is known of one thing, or of things of one kind", node, scope)
    return Const(Type("text", 0, 0, (kinds.pop(),)), 0)


def _kind_of(resolver: Resolver, entity: int) -> str:
    objects = resolver.symbols.object_of(entity)
    if objects is not None:
        return objects.type.name
    member = resolver.symbols.member_of(entity)
    assert member is not None, "internal: an entity is an object or in the cast"
    return resolver.symbols.cast[member].kind or "peer"


def _index(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    members = [resolver.symbols.member_of(number) for number in (who.type.low, who.type.high)]
    groups = [resolver.symbols.group_of(member) for member in members if member is not None]
    if len(groups) == 2 and groups[0] is not None and groups[1] is not None and groups[0][0] == groups[1][0]:
        first = who.type.low - groups[0][1]
        return (
            number(who.value - first)
            if isinstance(who, Const)
            else arithmetic("-", _as_number(who), number(first))
        )
    objects = resolver.symbols.object_of(who.type.low)
    if objects is None or who.type.high not in objects.numbers:
        raise resolver.fail("S204", "only one of a group has an `index`, its place in it", node, scope)
    first = objects.numbers[0]
    if isinstance(who, Const):
        return number(who.value - first)
    return arithmetic("-", _as_number(who), number(first))


def _as_number(term: Term) -> Term:
    """An entity's number as a number."""
    return replace(term, type=Type("int", term.type.low, term.type.high))


def _status(resolver: Resolver, status: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    field = status_of(resolver, who, node, scope)
    if status not in field.type.words:
        what = resolver.symbols.object_of(who.type.low)
        assert what is not None, "internal: a status belongs to an object"
        message = f"{with_article(what.type.name)} is never `{status}`; it is {' or '.join(field.type.words)}"
        raise resolver.fail("S204", message, node, scope, suggestion=did_you_mean(status, field.type.words))
    return Compare("==", field, Const(field.type, field.type.words.index(status)))


def status_of(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> FieldOf:
    """The status of one object, or of one of several objects of the same type."""
    found = [resolver.symbols.object_of(n) for n in range(who.type.low, who.type.high + 1)]
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
