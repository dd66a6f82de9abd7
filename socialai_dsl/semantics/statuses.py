"""Statuses of objects: the one they begin with, and those that follow from a condition."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.build import draws, walk
from socialai_dsl.semantics.findings import surviving
from socialai_dsl.semantics.plans import Computed
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Objects, object_scope
from socialai_dsl.semantics.terms import BOOL, Const, FieldOf, Read, Select, Sited, Term, Type
from socialai_dsl.semantics.wording import with_article

_COMPUTED = {"locked": "closed", "tagged": None}
"""Status that follows from a condition -> the status it leaves for, None for the initial one."""

_INITIAL = ("pressed", "opened")


# -- at first ------------------------------------------------------------------------------------------------------


def initial(resolver: Resolver) -> dict[int, int | Read]:
    """Object -> the status it begins with, where a scenario gives one; a register where it is drawn or computed."""
    found: dict[int, int | Read] = {}
    for objects in resolver.symbols.objects.values():
        with surviving():
            found |= _initial(resolver, objects)
    return found


def _initial(resolver: Resolver, objects: Objects) -> dict[int, int | Read]:
    group = resolver.symbols.scenario.objects[objects.name]
    base: DataPath = ("objects", objects.name)
    given = [key for key in ("state", *_INITIAL) if getattr(group, key) is not None]
    if not given:
        return {}
    if len(given) > 1:
        span = resolver.findings.places.key_span((*base, given[1]))
        raise resolver.findings.fail("S107", f"only one of `{given[0]}` and `{given[1]}` can be given", span)
    key = given[0]
    if key == "state":
        status = _status(resolver, objects, str(group.state), (*base, "state"))
        return dict.fromkeys(objects.numbers, status)
    status = _status(resolver, objects, key, None, (*base, key))
    found: dict[int, int | Read] = {}
    for index, number in enumerate(objects.numbers):
        scope = object_scope(objects, index, (*base, key), key, at_reset=True)
        condition = resolver.written((*base, key), getattr(group, key), BOOL, scope)
        if isinstance(condition, Const):
            found[number] = status if condition.value else objects.type.initial
            continue
        states = objects.type.states
        type_ = Type("status", 0, len(states) - 1, states)
        value = Select(type_, (condition,), (Const(type_, status),), Const(type_, objects.type.initial))
        sited = Sited(value, scope.draws.site, resolver.findings.at((*base, key)))
        found[number] = resolver.registers.put(f"{objects.called(index)}.initial", sited)
    return found


def _status(
    resolver: Resolver, objects: Objects, status: str, written: DataPath | None, key: DataPath | None = None
) -> int:
    """The number of a status, which is `written` somewhere or the name of a `key`."""
    states = objects.type.states
    if status in states:
        return states.index(status)
    findings = resolver.findings
    span = findings.at(written, 0, len(status)) if written else findings.places.key_span(key or ())
    message = f"{with_article(objects.type.name)} is never `{status}`; it is {' or '.join(states)}"
    raise findings.fail("S204", message, span, suggestion=did_you_mean(status, states) if written else None)


# -- computed ------------------------------------------------------------------------------------------------------


def computed(resolver: Resolver) -> tuple[Computed, ...]:
    """Statuses that follow from conditions, each after those it reads."""
    found: dict[int, Computed] = {}
    for objects in resolver.symbols.objects.values():
        for key, left_for in _COMPUTED.items():
            with surviving():
                for one in _computed(resolver, objects, key, left_for):
                    _add(resolver, found, one, objects, key)
    return tuple(_in_order(resolver, found))


def _computed(resolver: Resolver, objects: Objects, key: str, left_for: str | None) -> Iterator[Computed]:
    raw = getattr(resolver.symbols.scenario.objects[objects.name], key)
    if raw is None:
        return
    path: DataPath = ("objects", objects.name, key)
    on = _status(resolver, objects, key, None, path)
    states = objects.type.states
    off = states.index(left_for) if left_for in states else objects.type.initial
    for index, number in enumerate(objects.numbers):
        scope = object_scope(objects, index, path, key, at_reset=False)
        condition = resolver.written(path, raw, BOOL, scope)
        if draws(condition):
            message = f"`{key}` follows from how things are, so nothing can be drawn in it"
            hint = "draw it in `let`, and use that"
            raise resolver.findings.fail("S204", message, resolver.findings.at(path), hint=hint)
        yield Computed(number, on, off, Sited(condition, scope.draws.site, resolver.findings.at(path)))


def _add(resolver: Resolver, found: dict[int, Computed], one: Computed, objects: Objects, key: str) -> None:
    span = resolver.findings.places.key_span(("objects", objects.name, key))
    if one.entity in found:
        raise resolver.findings.fail("S107", "only one status of an object can be computed", span)
    if key == "locked" and any(one.entity in locks for locks in resolver.unlocks.values()):
        message = f"`{objects.name}` is unlocked by something (`unlocks`) and computed (`locked`); only one can decide"
        raise resolver.findings.fail("S107", message, span)
    found[one.entity] = one


def _in_order(resolver: Resolver, found: dict[int, Computed]) -> Iterator[Computed]:
    done: set[int] = set()
    path: list[int] = []

    def visit(entity: int) -> Iterator[Computed]:
        if entity in done or entity not in found:
            return
        if entity in path:
            names = [_called(resolver, one) for one in [*path[path.index(entity) :], entity]]
            message = " and ".join(f"`{a}` needs `{b}`" for a, b in pairwise(names))
            span = found[entity].condition.span
            resolver.findings.error("S208", f"computed statuses in a circle: {message}", span)
            done.add(entity)
            return
        path.append(entity)
        for need in _statuses_read(found[entity].condition.term):
            yield from visit(need)
        path.pop()
        if entity not in done:
            done.add(entity)
            yield found[entity]

    for entity in found:
        yield from visit(entity)


def _statuses_read(term: Term) -> Iterator[int]:
    for part in walk(term):
        if isinstance(part, FieldOf) and part.name == "status":
            yield from range(part.entity.type.low, part.entity.type.high + 1)


def _called(resolver: Resolver, entity: int) -> str:
    objects = resolver.symbols.object_of(entity)
    assert objects is not None, "internal: only objects have statuses"
    return objects.called(entity - objects.numbers[0])
