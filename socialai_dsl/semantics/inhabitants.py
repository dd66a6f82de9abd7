"""The list of entities: the agent, the NPCs, the objects, with their voices, kinds and statuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import CastMember
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.entities import AGENT
from socialai_dsl.semantics.findings import surviving
from socialai_dsl.semantics.places import lies_in_wall
from socialai_dsl.semantics.scope import Objects, reset_scope
from socialai_dsl.semantics.terms import Const, Entity, Placing, Term, Type

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver


def entities_of(resolver: Resolver, placings: Mapping[int, Placing]) -> Iterator[Entity]:
    """The agent, the NPCs in cast order, the objects in file order."""
    symbols = resolver.symbols
    kinds: list[str] = []
    for name in (AGENT, *(n for n in symbols.cast if n != AGENT)):
        member = symbols.cast[name]
        kind = member.kind or "peer"
        if name != AGENT and kind not in kinds:
            kinds.append(kind)
        near, far = _voice(resolver, name, member)
        code = member.kind_code
        with surviving():
            number = symbols.numbers[name]
            yield Entity(
                number=number,
                key=name,
                index=None,
                role="agent" if name == AGENT else "npc",
                span=resolver.findings.places.key_span(("cast", name)),
                kind="" if name == AGENT else kind,
                kind_code=0 if name == AGENT else code if code is not None else kinds.index(kind),
                name=resolver.registers.read(f"{name}.name"),
                near=near,
                far=far,
                audible=member.audible == "always",
                in_wall=number in placings and lies_in_wall(resolver, placings[number]),
            )
    for objects in symbols.objects.values():
        yield from _objects(resolver, objects, placings)


def _objects(resolver: Resolver, objects: Objects, placings: Mapping[int, Placing]) -> Iterator[Entity]:
    state = resolver.symbols.scenario.objects[objects.name].state
    status = objects.type.initial
    if state is not None:
        if state in objects.type.states:
            status = objects.type.states.index(state)
        else:
            path = ("objects", objects.name, "state")
            findings = resolver.findings
            findings.error(
                "S204", f"a {objects.type.name} is never `{state}`; it is {' or '.join(objects.type.states)}",
                findings.at(path, 0, len(state)), suggestion=did_you_mean(state, objects.type.states),
            )  # fmt: skip
    for index, number in enumerate(objects.numbers):
        yield Entity(
            number=number,
            key=objects.name,
            index=None if objects.single else index,
            role="object",
            span=resolver.findings.places.key_span(("objects", objects.name)),
            type=objects.type,
            status=status,
            in_wall=number in placings and lies_in_wall(resolver, placings[number]),
        )


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
        term: Term = resolver.written(path, raw, Type("int", 0, 0), reset_scope(path))
        if isinstance(term, Const) and term.value >= 0:
            return 0, term.value
        findings = resolver.findings
        findings.error("S204", "`earshot` is next_to, room, or a known number of cells", findings.at(path))
    return 1, 1
