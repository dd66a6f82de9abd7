"""Links between objects: what a switch unlocks, and what unlocks a door."""

from __future__ import annotations

from dataclasses import dataclass, replace

from socialai_dsl.grammar import ast
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import resolve_groups
from socialai_dsl.semantics.build import arithmetic, number
from socialai_dsl.semantics.findings import FailedError, surviving
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import Objects, Scope, reset_scope
from socialai_dsl.semantics.terms import Compare, Const, Select, Term, Type
from socialai_dsl.semantics.wording import quoted, with_article


@dataclass(frozen=True)
class _Kind:
    """A kind of link: its key, and the statuses that what it works on must be able to have."""

    key: str
    verb: str
    needs: frozenset[str]
    lack: str


_UNLOCKS = _Kind("unlocks", "unlock", frozenset({"locked"}), "has no lock")
_OPENS = _Kind("opens", "open", frozenset({"open", "closed"}), "cannot be opened")


def unlocked(resolver: Resolver) -> dict[int, tuple[int, ...]]:
    """Object -> the objects it unlocks; reports what is no lock, or has nothing to do with one."""
    return _all_links(resolver, _UNLOCKS)


def opened(resolver: Resolver) -> dict[int, tuple[int, ...]]:
    """Object -> the objects that are open while it is active; reports what cannot be."""
    return _all_links(resolver, _OPENS)


def _all_links(resolver: Resolver, kind: _Kind) -> dict[int, tuple[int, ...]]:
    found: dict[int, tuple[int, ...]] = {}
    for objects in resolver.symbols.objects.values():
        with surviving():
            found |= _links_of(resolver, objects, kind)
    return found


def _links_of(resolver: Resolver, objects: Objects, kind: _Kind) -> dict[int, tuple[int, ...]]:
    raw = getattr(resolver.symbols.scenario.objects[objects.name], kind.key)
    if raw is None:
        return {}
    path: DataPath = ("objects", objects.name, kind.key)
    findings, scope = resolver.findings, reset_scope(path)
    node = findings.expression(path, raw)
    if not objects.type.active:
        message = f"{with_article(objects.type.name)} cannot {kind.verb} anything"
        able = [name for name, type_ in resolver.symbols.types.items() if type_.active]
        raise resolver.fail("S204", message, node, scope, hint="what can: " + ", ".join(able))
    targets = _objects_at(resolver, node, scope)
    for target in targets:
        type_ = resolver.symbols.object_of(target)
        assert type_ is not None, "internal: a target is an object"
        if not kind.needs <= set(type_.type.states):
            message = f"{with_article(type_.type.name)} {kind.lack}: it is {' or '.join(type_.type.states)}"
            raise resolver.fail("S204", message, node, scope)
    numbers = list(objects.numbers)
    if len(numbers) == len(targets):
        return {a: (b,) for a, b in zip(numbers, targets, strict=True)}
    if len(numbers) == 1 or len(targets) == 1:
        return dict.fromkeys(numbers, tuple(targets))
    message = f"{len(numbers)} of `{objects.name}` cannot be linked to {len(targets)} of `{quoted(node)}`"
    hint = "as many as there are, or one for all"
    raise resolver.fail("S106", message, node, scope, hint=hint)


def _objects_at(resolver: Resolver, node: ast.Expr, scope: Scope) -> list[int]:
    if resolve_groups.is_group(resolver, node, scope):
        members = resolve_groups.group(resolver, node, None, scope)
        terms: tuple[Term, ...] = members.items if members.type.kind == "entity" else ()
    else:
        terms = (resolver.value(node, ENTITY, scope),)
    known = [term.value for term in terms if isinstance(term, Const)]
    if not known or len(known) < len(terms) or any(resolver.symbols.object_of(n) is None for n in known):
        message = f"`{quoted(node)}` is not an object of the room"
        raise resolver.fail("S204", message, node, scope, hint="name an object, or a group of them")
    return known


def unlocker(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """`door.unlocked_by`: what unlocks it, whichever of its group it is."""
    found: dict[int, int] = {}
    for key, locks in resolver.unlocks.items():
        for lock in locks:
            if lock in found and who.type.low <= lock <= who.type.high:
                message = f"several things unlock `{_called(resolver, lock)}`"
                raise resolver.fail("S204", message, node, scope, hint="name the one that is meant")
            found[lock] = key
    numbers = [who.value] if isinstance(who, Const) else range(who.type.low, who.type.high + 1)
    for lock in numbers:
        if lock not in found and _some_failed(resolver):
            raise FailedError  # perhaps it is what that one was to unlock
        if lock not in found:
            message = f"nothing unlocks `{_called(resolver, lock)}`"
            hint = "an object unlocks another with `unlocks:`"
            raise resolver.fail("S204", message, node, scope, hint=hint)
    keys = [found[lock] for lock in numbers]
    type_ = Type("entity", min(keys), max(keys))
    if len(set(keys)) == 1:
        return Const(type_, keys[0])
    shifts = {key - lock for lock, key in zip(numbers, keys, strict=True)}
    if len(shifts) == 1:
        return _shifted(who, shifts.pop(), type_)
    *others, last = zip(numbers, keys, strict=True)
    return Select(
        type_,
        tuple(Compare("==", who, Const(who.type, lock)) for lock, _ in others),
        tuple(Const(type_, key) for _, key in others),
        Const(type_, last[1]),
    )


def _some_failed(resolver: Resolver) -> bool:
    """Whether it is not known, after a mistake that has been reported, what something unlocks."""
    symbols = resolver.symbols
    linked = [name for name, group in symbols.scenario.objects.items() if group.unlocks is not None]
    return any(symbols.objects[name].numbers[0] not in resolver.unlocks for name in linked)


def _shifted(who: Term, shift: int, type_: Type) -> Term:
    """Objects that stand in the same order in two groups are found by adding to their number."""
    as_number = replace(who, type=Type("int", who.type.low, who.type.high))
    return replace(arithmetic("+", as_number, number(shift)), type=type_)


def _called(resolver: Resolver, entity: int) -> str:
    objects = resolver.symbols.object_of(entity)
    if objects is None:
        return resolver.symbols.member_of(entity) or "agent"
    return objects.called(entity - objects.numbers[0])
