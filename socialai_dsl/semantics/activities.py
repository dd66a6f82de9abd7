"""Activities (`do:`) and effects (`cause:`)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import contents, resolve_groups
from socialai_dsl.semantics.entities import AGENT
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.plans import Activity, Effect
from socialai_dsl.semantics.resolve_attributes import status_of
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.sequences import performed
from socialai_dsl.semantics.signatures import ACTIVITIES, EFFECTS, SYNONYMS
from socialai_dsl.semantics.terms import ACTION, DIRECTION, TURN, Const, FieldOf, Measure, Term, Type
from socialai_dsl.semantics.wording import described, quoted, with_article, wrong_count

_STATUS_AFTER = {"reveal": "opened", "open": "open", "close": "closed", "lock": "locked", "unlock": "locked"}
"""The status that an object must be able to have for an effect to make sense."""

_TYPES = {"entity": ENTITY, "direction": DIRECTION, "turn": TURN, "int": INT}
"""What is expected of an argument, by what the signature takes."""
_TO_CELLS = frozenset({"go_to", "go_next_to", "face"})
"""Activities for which a cell will do."""

_WANDERING = ("forward", "left", "right")


def activity(resolver: Resolver, path: DataPath, raw: str | None, scope: Scope) -> Activity:
    """The body action of a state, step or rule; without one it stays."""
    span = resolver.findings.at(path)
    site = scope.draws.site
    if raw is None:
        return Activity("stay", (), site, span)
    node = resolver.findings.expression(path, raw)
    name, args = _head(resolver, node, scope)
    signature = ACTIVITIES.get(name)
    if signature is None:
        raise _unknown(resolver, name, args, node, scope)
    if len(args) != len(signature.takes):
        raise resolver.fail("S211", wrong_count(signature, len(args)), node, scope)
    _check_mover(resolver, name, node, scope)
    if name == "wander":
        actions = tuple(Const(ACTION, ACTION.words.index(word)) for word in _WANDERING)
        return Activity("choose", actions, site, span, (1, 1, 1), scope.draws.number())
    if name == "choose":
        return _choice(resolver, path, args[0], scope)
    if name == "perform":
        return Activity("perform", performed(resolver, args[0], scope), site, span)
    if name in ("push", "point", "follow"):
        return _at_something(resolver, name, args, Activity("stay", (), site, span), scope)
    terms = tuple(
        _argument(resolver, name, arg, _TYPES[takes], scope)
        for takes, arg in zip(signature.takes, args, strict=True)
    )
    return Activity(name, terms, site, span)


def _check_mover(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> None:
    """The agent has no arm to point with, so a frame that it follows cannot either."""
    looked_at = scope.frame is not None and scope.frame.looked_at
    if name in ("point", "stop_pointing") and scope.member == AGENT and not looked_at:
        raise resolver.fail("S204", "the agent cannot point; only NPCs do", node, scope)


def _at_something(
    resolver: Resolver, name: str, args: tuple[ast.Expr, ...], written: Activity, scope: Scope
) -> Activity:
    """push(x, direction); point(x), which is the direction in which x lies; follow(x), walking next to it for ever."""
    if name == "follow":
        return replace(written, name="go_next_to", args=(_argument(resolver, name, args[0], ENTITY, scope),))
    if name == "point":
        assert scope.member is not None, "internal: an activity is somebody's"
        own = resolver.symbols.numbers[scope.member]
        way = Measure(
            DIRECTION, "dir_to", (Const(Type("entity", own, own), own), resolver.somewhere(args[0], scope))
        )
        return replace(written, name="point", args=(way,))
    what = _argument(resolver, name, args[0], ENTITY, scope)
    for number in range(what.type.low, what.type.high + 1):
        objects = resolver.symbols.object_of(number)
        if objects is None or not objects.type.pushed:
            message = f"`{quoted(args[0])}` cannot be pushed"
            able = [key for key, type_ in resolver.symbols.types.items() if type_.pushed]
            raise resolver.fail("S204", message, args[0], scope, hint="what can be: " + ", ".join(able))
    return replace(written, name="push", args=(what, resolver.value(args[1], DIRECTION, scope)))


def _head(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[str, tuple[ast.Expr, ...]]:
    match node:
        case ast.Name(id=name):
            return name, ()
        case ast.Call(name=name, args=args, subject=None):
            return name, args
    raise resolver.fail(
        "S205", f"`{quoted(node)}` is not an activity", node, scope, hint="activities are " + ", ".join(ACTIVITIES)
    )  # fmt: skip


def _unknown(
    resolver: Resolver, name: str, args: tuple[ast.Expr, ...], node: ast.Expr, scope: Scope
) -> FailedError:
    given = f"({', '.join(map(quoted, args))})" if args else ""
    synonym = SYNONYMS.get(name)
    if synonym:
        takes = ACTIVITIES[synonym].takes
        usage = synonym + (given or "(x)" if takes else "")
        purpose = {"use": "to toggle something ", "enter": "to go through something "}.get(synonym, "")
        return resolver.fail("S205", f"unknown activity `{name}`; {purpose}write `{usage}`", node, scope)
    near = did_you_mean(name, ACTIVITIES)
    hint = None if near else "activities are " + ", ".join(ACTIVITIES)
    return resolver.fail("S205", f"unknown activity `{name}`", node, scope, suggestion=near, hint=hint)


def _argument(resolver: Resolver, name: str, node: ast.Expr, expected: Any, scope: Scope) -> Term:
    if expected is ENTITY and resolve_groups.is_group(resolver, node, scope):
        group = quoted(node)
        more = ", ..." if len(ACTIVITIES[name].takes) > 1 else ""
        hint = f"`{name}(nearest(d in {group} to self){more})`, or draw one in `let` with `pick({group})`"
        raise resolver.fail("S204", f"`{group}` is a group: say which of them", node, scope, hint=hint)
    if name in _TO_CELLS:
        return resolver.somewhere(node, scope)
    term = resolver.value(node, expected, scope)
    if name == "enter":
        _check_entrance(resolver, term, node, scope)
    return term


def _check_entrance(resolver: Resolver, term: Term, node: ast.Expr, scope: Scope) -> None:
    """Only objects of one type that can be walked on can be entered."""
    if term.type.low < len(resolver.symbols.numbers):
        raise resolver.fail(
            "S204", f"`{quoted(node)}` is no object; only objects can be entered", node, scope
        )
    status_of(resolver, term, node, scope)
    objects = resolver.symbols.object_of(term.type.low)
    assert objects is not None, "internal: what has a status is an object"
    if not objects.type.walkable:
        raise resolver.fail("S204", f"{with_article(objects.type.name)} can never be entered", node, scope)


def _choice(resolver: Resolver, path: DataPath, node: ast.Expr, scope: Scope) -> Activity:
    ordinal = scope.draws.number()
    members = resolve_groups.group(resolver, _with_stay(node), ACTION, scope)
    if members.type != ACTION:
        raise resolver.fail(
            "S204", f"`{quoted(node)}` are not actions; write choose(forward | left)", node, scope
        )
    weights = {item: members.items.count(item) for item in members.items}
    span = resolver.findings.at(path)
    return Activity("choose", tuple(weights), scope.draws.site, span, tuple(weights.values()), ordinal)


def _with_stay(node: ast.Expr) -> ast.Expr:
    """`stay` among the options is the action `none`: the word that stands alone in a `do:` may stand here too."""
    if isinstance(node, ast.Alternatives):
        return replace(node, options=tuple(map(_with_stay, node.options)))
    return replace(node, id="none") if isinstance(node, ast.Name) and node.id == "stay" else node


def effect(resolver: Resolver, path: DataPath, raw: object, scope: Scope) -> Effect:
    """One entry of `cause:`."""
    node = resolver.findings.expression(path, cast(Any, raw))
    match node:
        case ast.Attribute(subject=subject, name=name):
            args: tuple[ast.Expr, ...] = ()
        case ast.Call(subject=subject, name=name, args=args) if subject is not None:
            pass
        case ast.Name(id=name) | ast.Call(name=name) if name in EFFECTS:
            example = f"self.{name}" if EFFECTS[name].subject == "entity" else f"door.{name}"
            raise resolver.fail("S211", f"`{name}` needs what it is about: `{example}`", node, scope)
        case _:
            message = f"`{quoted(node)}` is not an effect"
            raise resolver.fail(
                "S205", message, node, scope, hint="effects are x.open, x.close, x.vanish, ..."
            )
    signature = EFFECTS.get(name)
    if signature is None:
        near = did_you_mean(name, EFFECTS)
        hint = None if near else "effects are " + ", ".join(EFFECTS)
        raise resolver.fail("S205", f"unknown effect `{name}`", node, scope, suggestion=near, hint=hint)
    if len(args) != len(signature.takes):
        raise resolver.fail("S211", wrong_count(signature, len(args)), node, scope)
    entities = _entities(resolver, subject, scope)
    if name == "vanish" and any(entity.type.low == 0 for entity in entities):
        raise resolver.fail("S204", _not_the_agent(subject, entities, "vanish"), node, scope)
    value = None
    if name in ("put", "move_into"):
        value = _target(resolver, name, subject, entities, args[0], scope)
    elif name == "reset":
        _check_objects(resolver, subject, entities, scope)
    elif signature.subject == "object":
        value = _new_status(resolver, name, entities, args, node, scope)
    return Effect(cast(Any, name), entities, resolver.findings.at(path), value, scope.draws.site)


def _entities(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[Term, ...]:
    """What an effect is about: one thing, a group, or all `objects`."""
    if isinstance(node, ast.Name) and node.id == "objects":
        first, last = len(resolver.symbols.numbers), resolver.symbols.entities
        return tuple(Const(Type("entity", number, number), number) for number in range(first, last))
    if not resolve_groups.is_group(resolver, node, scope):
        return (resolver.value(node, ENTITY, scope),)
    members = resolve_groups.group(resolver, node, None, scope)
    if members.type.kind != "entity":
        message = f"`{quoted(node)}` is {described(members.type)}, but {described(ENTITY)} is expected here"
        raise resolver.fail("S204", message, node, scope)
    return tuple(members.items)


def _target(
    resolver: Resolver, name: str, subject: ast.Expr, entities: tuple[Term, ...], node: ast.Expr, scope: Scope
) -> Term:
    """Where something is put: a cell or what is on it; an object that can hold it."""
    if name == "put" and isinstance(node, ast.Name) and node.id == "nowhere":
        message = f"what is taken out of the room vanishes: `{quoted(subject)}.vanish`"
        raise resolver.fail("S204", message, node, scope)
    if name == "put":
        return resolver.somewhere(node, scope)
    holder = resolver.value(node, ENTITY, scope)
    contents.check_holder(resolver, holder, node, scope)
    for entity in entities:
        contents.container(resolver, entity, subject, scope)
    return holder


def _check_objects(resolver: Resolver, node: ast.Expr, entities: tuple[Term, ...], scope: Scope) -> None:
    """The agent cannot be put back to where it started."""
    if any(entity.type.low == 0 for entity in entities):
        raise resolver.fail("S211", _not_the_agent(node, entities, "be reset"), node, scope)


def _not_the_agent(node: ast.Expr, entities: tuple[Term, ...], what: str) -> str:
    if all(isinstance(entity, Const) for entity in entities):
        return f"the agent cannot {what}"
    return f"`{quoted(node)}` may be the agent, which cannot {what}"


def _new_status(
    resolver: Resolver,
    name: str,
    entities: tuple[Term, ...],
    args: tuple[ast.Expr, ...],
    node: ast.Expr,
    scope: Scope,
) -> Term | None:
    """The status that `become` gives; for the others, only whether the object can have what they make of it."""
    fields: list[FieldOf] = [status_of(resolver, entity, node, scope) for entity in entities]
    type_ = fields[0].type
    if name == "become":
        return resolver.value(args[0], type_, scope)
    status = _STATUS_AFTER.get(name)
    if status is not None and status not in type_.words:
        assert isinstance(node, ast.Attribute | ast.Call), "internal: an effect on nothing"
        message = (
            f"`{name}` cannot happen to `{quoted(node.subject or node)}`: it is {' or '.join(type_.words)}"
        )
        raise resolver.fail("S204", message, node, scope, hint="`x.become(status)` sets a status")
    return None
