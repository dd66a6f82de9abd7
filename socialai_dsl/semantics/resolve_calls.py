"""Verbs, attributes and functions: what the signature table promises, made into terms."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import resolve_groups, resolve_names
from socialai_dsl.semantics.build import arithmetic, number
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import ACTIVITIES, EFFECTS, PLACES, QUANTIFIERS, VALUES, Signature
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    COLOR,
    DIRECTION,
    Compare,
    Const,
    FieldOf,
    InState,
    Measure,
    PokedNow,
    Spoke,
    Term,
    Test,
    Type,
    World,
)
from socialai_dsl.semantics.wording import described, quoted

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver

ENTITY = Type("entity", 0, 0)
"""Expected: somebody or something in the room."""

_RELATIONS = ("at", "next_to", "in_front_of", "faces", "faces_toward", "eye_contact", "in_line", "can_reach")
_FINISHED = "finished"


def call(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`verb(...)`, `subject.verb(...)` or a definition with arguments."""
    defined = _definition(resolver, node, scope)
    if defined is not None:
        define, arguments = defined
        return resolve_names.expanded(resolver, define, arguments, node, expected, scope)
    signature = VALUES.get(node.name)
    if signature is None:
        _unknown(resolver, node, scope)
    _check_count(resolver, signature, node, scope)
    if signature.subject == "none":
        return _function(resolver, node, expected, scope)
    if not signature.takes:
        return without_arguments(resolver, node.name, node.subject, node, scope)
    _check_moment(resolver, signature, node, scope)
    argument = node.args[0]
    match node.name:
        case "said":
            _agent(resolver, node, scope)
            return resolver.utterances.said(argument, scope)
        case "heard":
            _listener(resolver, node, scope)
            return resolver.utterances.heard(argument, scope)
        case "did":
            _agent(resolver, node, scope)
            return _did(resolver, argument, scope)
        case "is":
            return _is_in_state(resolver, node, scope)
    subject = subject_of(resolver, node.subject, signature, node, scope)
    if node.name in _RELATIONS:
        return _relation(resolver, node.name, subject, argument, scope)
    other = resolver.value(argument, ENTITY, scope)
    assert subject is not None, "internal: only relations have the candidate cell as a subject"
    if node.name == "distance":
        (_, width), (_, height) = resolver.symbols.width, resolver.symbols.height
        return Measure(Type("int", 0, width + height - 2), "distance", (subject, other))
    assert node.name == "dir_to", f"internal: no meaning for `{node.name}`"
    return Measure(DIRECTION, "dir_to", (subject, other))


def _definition(resolver: Resolver, node: ast.Call, scope: Scope) -> tuple[Any, dict[str, ast.Expr]] | None:
    if node.subject is not None:
        return None
    define = scope.frame.defines.get(node.name) if scope.frame is not None else None
    define = define or resolver.symbols.defines.get(node.name)
    if define is None:
        return None
    if len(node.args) != len(define.parameters):
        wanted = ", ".join(define.parameters) or "nothing"
        message = f"`{define.name}` takes {wanted}; {len(node.args)} given"
        resolver.fail("S211", message, node, scope)
    return define, dict(zip(define.parameters, node.args, strict=True))


def _unknown(resolver: Resolver, node: ast.Call, scope: Scope) -> None:
    if node.name in ACTIVITIES or node.name in EFFECTS or node.name in PLACES:
        kind = "an activity" if node.name in ACTIVITIES else "an effect" if node.name in EFFECTS else "a place"
        resolver.fail("S204", f"`{node.name}` is {kind}; here a condition or value is expected", node, scope)
    candidates = [*VALUES, *resolver.symbols.defines, *(scope.frame.defines if scope.frame else ())]
    near = did_you_mean(node.name, candidates)
    kind = "word" if node.subject is None else "verb"
    resolver.fail("S205", f"unknown {kind} `{node.name}`", node, scope, suggestion=near)


def _check_count(resolver: Resolver, signature: Signature, node: ast.Call, scope: Scope) -> None:
    most = len(signature.takes)
    if most - signature.optional <= len(node.args) <= most:
        return
    takes = "nothing in brackets" if not most else ", ".join(signature.takes)
    resolver.fail("S211", f"`{node.name}` takes {takes}; {len(node.args)} given", node, scope)


def _check_moment(resolver: Resolver, signature: Signature, node: ast.Expr, scope: Scope) -> None:
    if signature.momentary and scope.at_reset:
        message = f"`{signature.name}` speaks of a step, but this value is computed once, before the first step"
        resolver.fail("S204", message, node, scope, hint="a `define` is recomputed at every use")


# -- functions -------------------------------------------------------------------------------------------------


def _function(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    if node.subject is not None:
        resolver.fail("S211", f"`{node.name}` has nothing before it: write `{node.name}(...)`", node, scope)
    if node.name in QUANTIFIERS:
        if node.name not in ("pick", "first", "count"):
            usage = "d in doors to agent" if node.name == "nearest" else "d in doors where ..."
            resolver.fail("S211", f"write `{node.name}({usage})`", node, scope)
        return resolve_groups.pick(resolver, node, expected, scope)
    whole = Type("int", 0, 0)
    return arithmetic(node.name, *(resolver.value(argument, whole, scope) for argument in node.args))


# -- subjects --------------------------------------------------------------------------------------------------


def subject_of(
    resolver: Resolver, subject: ast.Expr | None, signature: Signature, node: ast.Expr, scope: Scope
) -> Term | None:
    """Who a verb is about: what stands before the dot, else the NPC itself. None: the candidate cell."""
    if subject is None:
        if scope.member is None or scope.within and scope.frame is None:
            example = "agent" if signature.subject != "object" else "door"
            resolver.fail("S211", f"`{signature.name}` needs somebody: `{example}.{signature.name}`", node, scope)
        return resolve_names.entity(resolver.symbols.numbers[scope.member])
    if isinstance(subject, ast.Name) and subject.id == "here" and "here" not in scope.variables:
        if not scope.here:
            resolver.fail("S201", "`here` is the candidate cell; it means something only in a place", subject, scope)
        if not signature.cell:
            resolver.fail("S211", f"a cell cannot be asked for `{signature.name}`", node, scope)
        return None
    if resolve_groups.is_group(resolver, subject, scope):
        group = quoted(subject)
        hint = f"any(x in {group} where x.{signature.name}...), or all(...)"
        resolver.fail("S204", f"`{group}` is a group: say which of them", subject, scope, hint=hint)
    return resolver.value(subject, ENTITY, scope)


def _agent(resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope) -> None:
    subject = None if isinstance(node, ast.Name) else node.subject
    if subject is None and scope.member == "agent":
        return
    if not (isinstance(subject, ast.Name) and subject.id == "agent"):
        name = node.id if isinstance(node, ast.Name) else node.name
        hint = "what an NPC has heard is `heard(...)`, or `hears:` in a rule" if name == "said" else None
        resolver.fail("S211", f"`{name}` is known of the agent only: `agent.{name}`", node, scope, hint=hint)


def _listener(resolver: Resolver, node: ast.Call, scope: Scope) -> None:
    itself = node.subject is None or (isinstance(node.subject, ast.Name) and node.subject.id in ("self", scope.member))
    if scope.frame is None or not itself:
        message = "`heard` is known to the NPC itself, in its frame; elsewhere write `agent.said(...)`"
        resolver.fail("S211", message, node, scope)


def _relation(resolver: Resolver, name: str, subject: Term | None, argument: ast.Expr, scope: Scope) -> Term:
    if resolve_groups.is_group(resolver, argument, scope):
        return resolve_groups.any_member(resolver, argument, scope, Test, name, subject)
    return Test(cast(Any, name), subject, resolver.value(argument, ENTITY, scope))


def _did(resolver: Resolver, argument: ast.Expr, scope: Scope) -> Term:
    action = World(ACTION, "action")
    if resolve_groups.is_group(resolver, argument, scope):
        from socialai_dsl.semantics.build import one_of

        return one_of(action, resolve_groups.group(resolver, argument, ACTION, scope).items)
    return Compare("==", action, resolver.value(argument, ACTION, scope))


def _is_in_state(resolver: Resolver, node: ast.Call, scope: Scope) -> Term:
    """`dancer.is(watching)`: the state is a bare word, looked up in the member's frame."""
    member = _member(resolver, node.subject, node, scope)
    argument = node.args[0]
    frame = resolver.frames.get(member)
    if frame is None:
        resolver.fail("S310", f"`{member}` follows no frame, so it has no states", node, scope)
    states = list(frame.model.states or ())
    states += [step.state for step in frame.model.steps or () if step.state] + ([_FINISHED] if frame.model.steps else [])
    if not isinstance(argument, ast.Name):
        resolver.fail("S211", "`is` takes the name of a state", argument, scope)
    if argument.id not in states:
        message = f"`{member}` has no state `{argument.id}` (it plays `{frame.name}`: {', '.join(states)})"
        near = did_you_mean(argument.id, states)
        resolver.fail("S310", message, argument, scope, suggestion=near)
    return InState(member, frame.name, argument.id)


def _member(resolver: Resolver, subject: ast.Expr | None, node: ast.Expr, scope: Scope) -> str:
    if subject is None and scope.member is not None:
        return scope.member
    if subject is not None:
        term = resolver.value(subject, ENTITY, scope)
        member = resolver.symbols.member_of(term.value) if isinstance(term, Const) else None
        if member is not None:
            return member
    resolver.fail("S211", "a member of the cast is needed before the dot", node, scope)


# -- attributes ------------------------------------------------------------------------------------------------


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
            _unknown_attribute(resolver, name, signature, statuses, node, scope)
    _check_moment(resolver, signature, node, scope)
    if signature.subject == "agent":
        assert isinstance(node, ast.Call | ast.Attribute | ast.Name), "internal: an attribute has a name"
        _agent(resolver, node, scope)
        return _of_the_agent(resolver, name)
    who = subject_of(resolver, subject, signature, node, scope)
    if who is None:
        return _cell_coordinate(resolver, name)
    if signature.subject == "object":
        return _status(resolver, name, who, node, scope)
    return _attribute(resolver, name, who, node, scope)


def _unknown_attribute(
    resolver: Resolver, name: str, signature: Signature | None, statuses: set[str], node: ast.Expr, scope: Scope
) -> None:
    if signature is not None:
        resolver.fail("S211", f"`{name}` needs something in brackets: `{name}(...)`", node, scope)
    known = [s.name for s in VALUES.values() if not s.takes and s.subject != "none"]
    near = did_you_mean(name, [*known, *sorted(statuses)])
    near = near or did_you_mean(name, [s.name for s in VALUES.values() if s.subject != "none"])
    resolver.fail("S205", f"nothing here has a `{name}`", node, scope, suggestion=near)


def _of_the_agent(resolver: Resolver, name: str) -> Term:
    match name:
        case "spoke":
            return Spoke()
        case "noun":
            return World(resolver.symbols.nouns, "noun")
    assert name == "action", f"internal: the agent has no `{name}`"
    return World(ACTION, "action")


def _cell_coordinate(resolver: Resolver, name: str) -> Term:
    from socialai_dsl.semantics.terms import Here

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
            return FieldOf(Type("int", 0, high - 1), who, "x" if name == "x" else "y")
        case "gone":
            return FieldOf(BOOL, who, "gone")
        case "was_poked":
            return FieldOf(BOOL, who, "poked")
        case "poked":
            return PokedNow(who)
        case "index":
            return _index(resolver, who, node, scope)
        case "kind":
            return _kind(resolver, who, node, scope)
    assert name == "name", f"internal: no meaning for the attribute `{name}`"
    return _name(resolver, who, node, scope)


def _name(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    member = resolver.symbols.member_of(who.value) if isinstance(who, Const) else None
    if member is None:
        resolver.fail("S204", "only a member of the cast has a name", node, scope)
    return resolver.registers.read(f"{member}.name")


def _kind(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    kinds = {_kind_of(resolver, n) for n in range(who.type.low, who.type.high + 1)}
    if len(kinds) > 1:
        resolver.fail("S204", "`kind` is known of one thing, or of things of one kind", node, scope)
    return Const(Type("text", 0, 0, (kinds.pop(),)), 0)


def _kind_of(resolver: Resolver, entity: int) -> str:
    objects = resolver.symbols.object_of(entity)
    if objects is not None:
        return objects.type.name
    member = resolver.symbols.member_of(entity)
    assert member is not None, "internal: an entity is an object or in the cast"
    return resolver.symbols.cast[member].kind or "peer"


def _index(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    objects = resolver.symbols.object_of(who.type.low)
    if objects is None or who.type.high not in objects.numbers:
        resolver.fail("S204", "only a member of one group of objects has an `index`", node, scope)
    first = objects.numbers[0]
    if isinstance(who, Const):
        return number(who.value - first)
    shifted = arithmetic("-", replace_type(who), number(first))
    return shifted


def replace_type(term: Term) -> Term:
    """An entity's number as a number."""
    return replace(term, type=Type("int", term.type.low, term.type.high))  # type: ignore[arg-type]


def _status(resolver: Resolver, status: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    field = status_of(resolver, who, node, scope)
    if status not in field.type.words:
        what = resolver.symbols.object_of(who.type.low)
        assert what is not None, "internal: a status belongs to an object"
        message = f"a {what.type.name} is never `{status}`; it is {' or '.join(field.type.words)}"
        resolver.fail("S204", message, node, scope, suggestion=did_you_mean(status, field.type.words))
    return Compare("==", field, Const(field.type, field.type.words.index(status)))


def status_of(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> FieldOf:
    """The status of one object, or of one of several objects of the same type."""
    found = [resolver.symbols.object_of(n) for n in range(who.type.low, who.type.high + 1)]
    types = {objects.type.name: objects.type for objects in found if objects is not None}
    if None in found or len(types) != 1:
        message = f"{described(who.type)} of different types has no common status" if types else "only objects have a status"
        resolver.fail("S204", message, node, scope)
    (type_,) = types.values()
    return FieldOf(Type("status", 0, len(type_.states) - 1, type_.states), who, "status")
