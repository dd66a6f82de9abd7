"""Facts about objects: containment, links, statuses, and beliefs about them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

from socialai_dsl.diagnostics import advice_on, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem, parse_expression
from socialai_dsl.schema.scenario import Belief, Register, Scenario
from socialai_dsl.semantics import groups, hands
from socialai_dsl.semantics.believing import BeliefResolver
from socialai_dsl.semantics.cast import fillings, members
from socialai_dsl.semantics.plans import Activity, BeliefPlan, ComputedStatus, FramePlan, StatePlan
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import (
    Objects,
    ReportedError,
    Scope,
    Symbols,
    frames_of,
    object_scope,
    of_each,
    quoted,
    reset_scope,
    step_scope,
    surviving,
    with_article,
)
from socialai_dsl.semantics.terms import (
    BOOL,
    Const,
    FieldOf,
    Read,
    Select,
    SitedTerm,
    Term,
    Type,
    arithmetic,
    as_number,
    chosen,
    number,
    numbers_of,
    walk,
    where_there_is,
)
from socialai_dsl.source import DataPath, Span


def holders(resolver: Resolver) -> tuple[int, int] | None:
    """Least and greatest number of the objects that can hold others; None if there are none."""
    numbers = [
        number
        for objects in resolver.symbols.objects.values()
        if "opened" in objects.type.states
        for number in objects.numbers
    ]
    return (min(numbers), max(numbers)) if numbers else None


def inside_of(resolver: Resolver, objects: Objects, index: int, path: DataPath, raw: str) -> Term:
    """The object that another lies in at first."""
    scope = object_scope(objects, index, path, "inside", at_reset=True)
    node = resolver.findings.expression(path, raw)
    holder = resolver.value(node, ENTITY, scope)
    check_holder(resolver, holder, node, scope, (objects.numbers[index],))
    return holder


def check_holder(
    resolver: Resolver, holder: Term, node: ast.Expr, scope: Scope, contents: Iterable[int]
) -> None:
    """Report what cannot hold anything, and contents that nobody can carry."""
    if hands.is_member(resolver, holder):
        for number in contents:
            objects = resolver.symbols.object_of(number)
            if number not in hands.carryable(resolver):
                called = objects.name if objects is not None else resolver.symbols.member_of(number)
                raise resolver.fail(
                    "S204", f"`{called}` cannot be carried", node, scope, hint=hands.CARRYABLE
                )
        return
    for entity in holder.type.values:
        objects = resolver.symbols.object_of(entity)
        if objects is None or "opened" not in objects.type.states:
            able = [name for name, type_ in resolver.symbols.types.items() if "opened" in type_.states]
            message = f"nothing can lie in `{quoted(node)}`"
            raise resolver.fail(
                "S204", message, node, scope, hint="what can hold something: " + ", ".join(able)
            )


def container(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """`x.inside`: what something lies in."""
    known = holders(resolver)
    for entity in who.type.values:
        objects = resolver.symbols.object_of(entity)
        if objects is None or known is None or not can_lie_inside(resolver, objects):
            message = f"`{quoted(node)}`: it never lies inside anything"
            hint = "an object is put into another with `inside:`, or by the effect `x.move_into(box)`"
            if entity in hands.carryable(resolver):
                hint = "ask who carries it: `ann.carries(x)`; `inside: box` puts it into another object"
            raise resolver.fail("S204", message, node, scope, hint=hint)
        if scope.at_reset and "object" not in _first_inside(resolver, objects):
            message = f"`{quoted(node)}`: it lies inside nothing when an episode begins"
            hint = "`inside: box` puts it into another object; a register or belief may begin empty: `start: none`"
            raise resolver.fail("S204", message, node, scope, hint=hint)
    assert known is not None, "internal: looked at above"
    named = filter(None, map(resolver.symbols.object_of, who.type.values))
    may_miss = not all(_first_inside(resolver, objects) == {"object"} for objects in named)
    return FieldOf(Type("entity", *known), who, "inside", may_miss)


def can_lie_inside(resolver: Resolver, objects: Objects) -> bool:
    """Whether objects of this name ever lie in others: at first, or because an effect moves them there."""
    if resolver.moved_inside is None:
        resolver.moved_inside = _moved_inside(resolver.symbols)
    return "object" in _first_inside(resolver, objects) or objects.name in resolver.moved_inside


Holding = Literal["object", "member"]
"""What something is in: an object that it lies in, or the hands of a member of the cast."""


def _first_inside(resolver: Resolver, objects: Objects) -> set[Holding]:
    """What objects of this name may be in at first."""
    group = resolver.symbols.scenario.objects[objects.name]
    if group.inside is None:
        return set()
    return _holding(resolver.symbols, _nodes(group.inside)) if group.carryable else {"object"}


def _holding(symbols: Symbols, nodes: Iterable[ast.Node]) -> set[Holding]:
    """What an expression that says where something is put may stand for: both, if that is not known."""
    names = _meant(symbols.scenario, nodes)
    holders = {name for name, objects in symbols.objects.items() if "opened" in objects.type.states}
    members = {*symbols.numbers, *symbols.groups, *symbols.roles, "self", "speaker", "cast"}
    found: set[Holding] = {"object"} if names & {*holders, "objects"} else set()
    found |= {"member"} if names & members else set()
    return found or {"object", "member"}


def _moved_inside(symbols: Symbols) -> set[str]:
    """All names in what is moved into objects, and in what these names stand for."""
    subjects = [
        node.subject
        for effect in _effects(symbols.scenario)
        for node in _nodes(effect)
        if isinstance(node, ast.Call) and node.name == "move_into" and node.subject is not None
        if "object" in _holding(symbols, (inner for arg in node.args for inner in arg.walk()))
    ]
    return _meant(symbols.scenario, (node for subject in subjects for node in subject.walk()))


def _meant(scenario: Scenario, nodes: Iterable[ast.Node]) -> set[str]:
    """All names in an expression, and in what these names stand for."""
    waiting = [node.id for node in nodes if isinstance(node, ast.Name)]
    sources, found = _sources(scenario), set[str]()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            nodes = (node for source in sources.get(name, ()) for node in _nodes(source))
            waiting += [node.id for node in nodes if isinstance(node, ast.Name)]
    return found


def _nodes(source: object) -> list[ast.Node]:
    """The nodes of an expression; none of what is not one, which is reported elsewhere."""
    try:
        return list(parse_expression(str(source)).walk())
    except ParseProblem:
        return []


def _sources(scenario: Scenario) -> dict[str, list[object]]:
    """Name -> the expressions that it may stand for: lets, definitions, registers with what they are set to, slots."""
    found: dict[str, list[object]] = {}
    declared: list[Mapping[str, object]] = [scenario.let, scenario.define]
    for _, frame in frames_of(scenario):
        declared += [frame.let, frame.define, *(entry.set for entry in frame.all_effects())]
    for mapping in declared:
        for name, source in mapping.items():
            value = source.start if isinstance(source, Register) else source
            found.setdefault(name.partition("(")[0].strip(), []).append(value)
    for version in (version for member in members(scenario).values() for version in member.versions):
        for slot, filling in fillings(version).items():
            found.setdefault(slot, []).append(filling)
    return found


def _effects(scenario: Scenario) -> Iterator[object]:
    """Every effect as it is written."""
    for rule in scenario.rules:
        yield from rule.cause
    for _, frame in frames_of(scenario):
        for entry in frame.all_effects():
            yield from entry.cause


def contained(resolver: Resolver) -> dict[int, tuple[int, ...]]:
    """Object that can hold others -> what may ever lie in it."""
    contents = tuple(
        number
        for objects in resolver.symbols.objects.values()
        if can_lie_inside(resolver, objects)
        for number in objects.numbers
    )
    found: dict[int, tuple[int, ...]] = {}
    for objects in resolver.symbols.objects.values():
        if contents and "opened" in objects.type.states:
            with surviving():
                found |= {number: tuple(c for c in contents if c != number) for number in objects.numbers}
    return found


# -- links: what a switch unlocks, and what unlocks a door ---------------------------------------------------


@dataclass(frozen=True)
class LinkKind:
    """A kind of link: its key, and the statuses that what it works on must be able to have."""

    key: str
    verb: str
    needs: frozenset[str]
    lack: str


UNLOCKS = LinkKind("unlocks", "unlock", frozenset({"locked"}), "has no lock")
OPENS = LinkKind("opens", "open", frozenset({"open", "closed"}), "cannot be opened")


def links(resolver: Resolver, kind: LinkKind) -> Mapping[int, tuple[int, ...]]:
    """Object -> the objects it unlocks, or that are open while it is active; reports what cannot be linked, once."""
    if kind.key not in resolver.links:
        found: dict[int, tuple[int, ...]] = {}
        for objects in resolver.symbols.objects.values():
            with surviving():
                found |= _links_of(resolver, objects, kind)
        resolver.links[kind.key] = found
    return resolver.links[kind.key]


def _links_of(resolver: Resolver, objects: Objects, kind: LinkKind) -> dict[int, tuple[int, ...]]:
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
    if groups.is_group(resolver, node, scope):
        members = groups.group(resolver, node, None, scope)
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
    for key, locks in links(resolver, UNLOCKS).items():
        for lock in locks:
            if lock in found and who.type.low <= lock <= who.type.high:
                message = f"several things unlock `{resolver.symbols.called(lock)}`"
                raise resolver.fail("S204", message, node, scope, hint="name the one that is meant")
            found[lock] = key
    numbers = numbers_of(who)
    for lock in numbers:
        if lock not in found and _some_failed(resolver):
            raise ReportedError  # perhaps it is what that one was to unlock
        if lock not in found:
            message = f"nothing unlocks `{resolver.symbols.called(lock)}`"
            hint = "an object unlocks another with `unlocks:`"
            raise resolver.fail("S204", message, node, scope, hint=hint)
    keys = [found[lock] for lock in numbers]
    type_ = Type("entity", min(keys), max(keys))
    if len(set(keys)) == 1:
        return where_there_is(who, Const(type_, keys[0]))
    shifts = {key - lock for lock, key in zip(numbers, keys, strict=True)}
    if len(shifts) == 1:
        # Objects that stand in the same order in two groups are found by adding to their number.
        return replace(arithmetic("+", as_number(who), number(shifts.pop())), type=type_)
    return where_there_is(who, chosen(who, numbers, [Const(type_, key) for key in keys], type_))


def _some_failed(resolver: Resolver) -> bool:
    """Whether it is not known, after a mistake that has been reported, what something unlocks."""
    symbols = resolver.symbols
    linked = [name for name, group in symbols.scenario.objects.items() if group.unlocks is not None]
    return any(symbols.objects[name].numbers[0] not in links(resolver, UNLOCKS) for name in linked)


# -- statuses: the one an object begins with, and those that follow from a condition -------------------------


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
    for index, entity in enumerate(objects.numbers):
        scope = object_scope(objects, index, (*base, key), key, at_reset=True)
        condition = resolver.written(getattr(group, key), BOOL, scope)
        if isinstance(condition, Const):
            found[entity] = status if condition.value else objects.type.initial
            continue
        states = objects.type.states
        type_ = Type("status", 0, len(states) - 1, states)
        value = Select(type_, (condition,), (Const(type_, status),), Const(type_, objects.type.initial))
        sited = SitedTerm(value, scope.draws.site, resolver.findings.at((*base, key)))
        found[entity] = resolver.registers.put(f"{objects.called(index)}.initial", sited)
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


def computed(resolver: Resolver) -> tuple[ComputedStatus, ...]:
    """Statuses that follow from conditions, each after those it reads."""
    found: dict[int, ComputedStatus] = {}
    for objects in resolver.symbols.objects.values():
        for key, left_for in _COMPUTED.items():
            with surviving():
                for one in _computed(resolver, objects, key, left_for):
                    _add(resolver, found, one, objects, key)
    return tuple(_in_order(resolver, found))


def _computed(
    resolver: Resolver, objects: Objects, key: str, left_for: str | None
) -> Iterator[ComputedStatus]:
    raw = getattr(resolver.symbols.scenario.objects[objects.name], key)
    if raw is None:
        return
    path: DataPath = ("objects", objects.name, key)
    on = _status(resolver, objects, key, None, path)
    states = objects.type.states
    off = states.index(left_for) if left_for in states else objects.type.initial
    for index, entity in enumerate(objects.numbers):
        scope = object_scope(objects, index, path, key, at_reset=False)
        message = f"`{key}` follows from how things are, so nothing can be drawn in it"
        yield ComputedStatus(entity, on, off, resolver.undrawn(resolver.sited(raw, BOOL, scope), message))


def _add(
    resolver: Resolver, found: dict[int, ComputedStatus], one: ComputedStatus, objects: Objects, key: str
) -> None:
    span = resolver.findings.places.key_span(("objects", objects.name, key))
    if one.entity in found:
        raise resolver.findings.fail("S107", "only one status of an object can be computed", span)
    if key == "locked" and any(one.entity in locks for locks in links(resolver, UNLOCKS).values()):
        message = f"`{objects.name}` is unlocked by something (`unlocks`) and computed (`locked`); only one can decide"
        raise resolver.findings.fail("S107", message, span)
    found[one.entity] = one


def _in_order(resolver: Resolver, found: dict[int, ComputedStatus]) -> Iterator[ComputedStatus]:
    done: set[int] = set()
    path: list[int] = []

    def visit(entity: int) -> Iterator[ComputedStatus]:
        if entity in done or entity not in found:
            return
        if entity in path:
            names = [resolver.symbols.called(one) for one in [*path[path.index(entity) :], entity]]
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
            yield from part.entity.type.values


# -- beliefs: what a member of the cast takes for true, because it saw it last -------------------------------


def register_of(member: str, key: str) -> str:
    """The register that holds a belief."""
    return f"{member}.believes.{key}"


def _beliefs(symbols: Symbols) -> Iterator[tuple[str, str, Belief]]:
    """Every belief, with who has it and its name."""
    for member in symbols.cast.values():
        yield from ((member.key, key, belief) for key, belief in (member.value("beliefs") or {}).items())


def declare(resolver: Resolver) -> None:
    """Make every belief known; by default it starts with what is true when the episode begins."""
    for name, key, belief in _beliefs(resolver.symbols):
        with surviving():
            resolver.registers.declare(BeliefResolver(resolver, name, key, belief).declaration())


def beliefs(resolver: Resolver) -> Iterator[BeliefPlan]:
    """The beliefs that members update at the start of their turns."""
    for name, key, belief in _beliefs(resolver.symbols):
        with surviving():
            if register_of(name, key) in resolver.registers:
                yield from BeliefResolver(resolver, name, key, belief).plans()


def accepting(resolver: Resolver) -> Iterator[tuple[int, str]]:
    """Members who do not take everything they are given, each with the register of the step that says whether."""
    for name, member in resolver.symbols.cast.items():
        accepts, *_ = member.cases("accepts")
        if accepts.raw is None:
            continue
        with surviving():
            scope = step_scope(accepts.path, f"cast.{name}.accepts", name)
            asked = resolver.sited(accepts.raw, BOOL, scope)
            if not hands.carryable(resolver):
                message = "nothing here can be given"
                raise hands.nothing_carried(resolver, message, asked.span)
            message = "`accepts` is asked in every step, so nothing can be drawn in it"
            noted = resolver.registers.remember(resolver.undrawn(asked, message))
            yield resolver.symbols.numbers[name], noted.path


def watching(member: str, number: int, span: Span) -> FramePlan:
    """The frame of a member with beliefs and no frame of its own: it stays, and looks."""
    state = StatePlan("looking", (), Activity("stay", (), "", span), (), span)
    return FramePlan(member, "looks on", number, span, state.name, (state,), written=False)


def believed(resolver: Resolver, owner: ast.Attribute, node: ast.Attribute, scope: Scope) -> Term:
    """`sally.believes.toy_in`; of several members, what the one believes who is meant."""
    who = resolver.value(owner.subject, ENTITY, scope)
    members = resolver.symbols.members_of(who.type.values)
    if None in members:
        raise resolver.fail("S211", "only a member of the cast believes something", owner, scope)
    for member in map(str, members):
        known = resolver.symbols.cast[member].value("beliefs") or {}
        if node.name not in known:
            if member == scope.member and scope.frame is not None and scope.frame.looked_at:
                raise ReportedError  # who believes it plays this frame elsewhere
            hint = f"declare it: `beliefs: {{{node.name}: {{of: ..., when: sees(...)}}}}`"
            called = (resolver.symbols.group_of(member) or (member, 0))[0]
            message = f"`{called}` has no belief `{node.name}`"
            raise resolver.no_such(node.name, message, node, scope, **advice_on(node.name, known, hint))
    if any(register_of(str(member), node.name) not in resolver.registers for member in members):
        raise ReportedError  # what it starts with is missing, which has been reported
    return of_each(who, [resolver.registers.read(register_of(str(m), node.name)) for m in members])


def unnamed(subject: str) -> str:
    """The message about `sally.believes` without the name of a belief."""
    return f"`believes` needs the name of a belief after a dot: `{subject}.believes.where_it_is`"
