"""The list of entities: the agent, the NPCs, the objects, with their voices, kinds and statuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import CastMember
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import contents
from socialai_dsl.semantics.alternatives import select
from socialai_dsl.semantics.build import number as number_of
from socialai_dsl.semantics.entities import AGENT
from socialai_dsl.semantics.findings import surviving
from socialai_dsl.semantics.plans import Entity
from socialai_dsl.semantics.resolver import INT, Resolver
from socialai_dsl.semantics.scope import Objects, reset_scope
from socialai_dsl.semantics.statuses import initial
from socialai_dsl.semantics.terms import Const, Read, Term
from socialai_dsl.semantics.wording import with_article

VIEW = 7
"""Side of the view square where none is given."""


def entities_of(resolver: Resolver) -> Iterator[Entity]:
    """The agent, the NPCs in cast order, the objects in file order."""
    symbols = resolver.symbols
    kinds: list[str] = []
    for name in (AGENT, *(n for n in symbols.cast if n != AGENT)):
        members = symbols.alternatives[name]
        member = members[0]
        codes = [] if name == AGENT else [_code(one, kinds) for one in members]
        with surviving():
            _check_shared(resolver, name)
            near, far = _voice(resolver, name, member)
            number = symbols.numbers[name]
            group = symbols.group_of(name)
            yield Entity(
                number=number,
                key=name if group is None else group[0],
                index=None if group is None else group[1],
                role="agent" if name == AGENT else "npc",
                span=resolver.findings.places.key_span(("cast", name)),
                kind=""
                if name == AGENT
                else " or ".join(dict.fromkeys(one.kind or "peer" for one in members)),
                kind_code=max(codes, default=0),
                kind_drawn=select(resolver.registers.drawn_file(name), [number_of(c) for c in codes])
                if len(set(codes)) > 1
                else None,
                name=resolver.registers.read(f"{name}.name"),
                near=near,
                far=far,
                audible=member.audible == "always",
                view=member.view if member.view is not None else VIEW,
            )
    statuses = initial(resolver)
    for objects in symbols.objects.values():
        yield from _objects(resolver, objects, statuses)


def _code(member: CastMember, kinds: list[str]) -> int:
    """The status code in the picture: the place of its kind in order of first appearance, if none is given."""
    kind = member.kind or "peer"
    if kind not in kinds:
        kinds.append(kind)
    return member.kind_code if member.kind_code is not None else kinds.index(kind)


def _check_shared(resolver: Resolver, name: str) -> None:
    """What the files of a `one_of` must have in common."""
    members = resolver.symbols.alternatives[name]
    for key in ("earshot", "view", "audible"):
        other = next(
            (i for i, one in enumerate(members) if getattr(one, key) != getattr(members[0], key)), None
        )
        if other is not None:
            span = resolver.findings.places.key_span(resolver.symbols.member_path(name, key, other))
            message = f"what is drawn by `one_of` has one and the same `{key}`"
            hint = f"give `{key}` beside `one_of`"
            raise resolver.findings.fail("S315", message, span, hint=hint)


def _objects(
    resolver: Resolver,
    objects: Objects,
    statuses: Mapping[int, int | Read],
) -> Iterator[Entity]:
    described = resolver.symbols.scenario.objects[objects.name]
    holding, rolled = contents.contained(resolver), _pushed_by_rolling(resolver, objects)
    _check_timer(resolver, objects)
    _check_exclusive(resolver, objects)
    for index, number in enumerate(objects.numbers):
        status = statuses.get(number, objects.type.initial)
        yield Entity(
            number=number,
            key=objects.name,
            index=None if objects.single else index,
            role="object",
            span=resolver.findings.places.key_span(("objects", objects.name)),
            type=objects.type,
            status=status if isinstance(status, int) else objects.type.initial,
            initial=None if isinstance(status, int) else status,
            unlocks=resolver.unlocks.get(number, ()),
            opens=resolver.opens.get(number, ()),
            timer=described.timer or 0,
            exclusive=tuple(objects.numbers) if described.exclusive else (),
            pushed_by_rolling=rolled,
            contains=holding.get(number, ()),
        )


def _pushed_by_rolling(resolver: Resolver, objects: Objects) -> bool:
    """Whether only something that rolls can push an object: `pushed_by: marble`."""
    pusher = resolver.symbols.scenario.objects[objects.name].pushed_by
    if pusher is None:
        return False
    path: DataPath = ("objects", objects.name, "pushed_by")
    findings, types = resolver.findings, resolver.symbols.types
    span = findings.at(path, 0, len(pusher))
    if not objects.type.pushed:
        findings.error(
            "S204", f"{with_article(objects.type.name)} cannot be pushed", findings.places.key_span(path)
        )
    elif pusher not in types or not types[pusher].rolls:
        rolling = [name for name, type_ in types.items() if type_.rolls]
        message = f"`{pusher}` does not roll, so it pushes nothing"
        near = did_you_mean(pusher, rolling)
        hint = None if near else "what rolls: " + ", ".join(rolling)
        findings.error("S204", message, span, suggestion=near, hint=hint)
    return True


def _check_timer(resolver: Resolver, objects: Objects) -> None:
    described = resolver.symbols.scenario.objects[objects.name]
    if described.timer is not None and not objects.type.expired:
        able = [name for name, type_ in resolver.symbols.types.items() if type_.expired]
        span = resolver.findings.places.key_span(("objects", objects.name, "timer"))
        message = f"a timer ends no status of {with_article(objects.type.name)}"
        resolver.findings.error("S204", message, span, hint="what has one that ends: " + ", ".join(able))


def _check_exclusive(resolver: Resolver, objects: Objects) -> None:
    if objects.single and resolver.symbols.scenario.objects[objects.name].exclusive:
        span = resolver.findings.places.key_span(("objects", objects.name, "exclusive"))
        message = "`exclusive` is for a group, of which one is used: give `count`"
        resolver.findings.error("S204", message, span)


def _voice(resolver: Resolver, name: str, member: CastMember) -> tuple[int, int]:
    """Least and greatest Manhattan distance at which a voice is heard."""
    symbols = resolver.symbols
    if member.earshot is None:
        path: DataPath = ("earshot",)
        raw = symbols.scenario.earshot
    else:
        path = symbols.member_path(name, "earshot")
        raw = member.earshot
    if raw == "next_to":
        return 1, 1
    if raw == "room":
        return 0, symbols.width[1] + symbols.height[1]
    with surviving():
        term: Term = resolver.written(path, raw, INT, reset_scope(path))
        if isinstance(term, Const) and term.value >= 0:
            return 0, term.value
        findings = resolver.findings
        findings.error("S204", "`earshot` is next_to, room, or a known number of cells", findings.at(path))
    return 1, 1
