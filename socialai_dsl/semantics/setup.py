"""What is drawn at reset, in the order it is done: what something needs comes before it."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, pairwise

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema import CastMember, ObjectGroup
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import contents, places, resolve_groups, tables
from socialai_dsl.semantics.alternatives import by_value, drawn
from socialai_dsl.semantics.build import walk
from socialai_dsl.semantics.entities import AGENT
from socialai_dsl.semantics.findings import FailedError, surviving
from socialai_dsl.semantics.plans import Coloring, Drawn, Facing, Placing, Setup
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import Objects, Scope, object_scope, reset_scope
from socialai_dsl.semantics.terms import (
    COLOR,
    DIRECTION,
    CellBeside,
    CellOf,
    Compare,
    Const,
    FieldOf,
    Measure,
    Read,
    Sees,
    Select,
    Sited,
    Term,
    Test,
)
from socialai_dsl.semantics.wording import quoted

_FACING_TESTS = frozenset({"faces", "faces_toward", "eye_contact", "looks_at"})


# -- placements --------------------------------------------------------------------------------------------------


def placings(resolver: Resolver) -> dict[int, tuple[Placing, ...]]:
    """Entity -> where it is put; several, each with its condition, where the files of a `one_of` differ."""
    found: dict[int, tuple[Placing, ...]] = {}
    for name, members in resolver.symbols.alternatives.items():
        with surviving():
            number = resolver.symbols.numbers[name]
            keys = [(member.place, member.at) for member in members]
            found[number] = tuple(
                replace(_member_placing(resolver, name, members[numbers[0]], numbers[0]), when=when)
                for numbers, when in _distinct(resolver, name, keys)
            )
    for objects in resolver.symbols.objects.values():
        with surviving():
            for placing in _object_placings(resolver, objects):
                found[placing.entity] = (placing,)
    return found


def _distinct(
    resolver: Resolver, name: str, keys: Sequence[Hashable]
) -> Iterator[tuple[list[int], Term | None]]:
    """The alternatives of a member that have the same keys, with the condition that one of them was drawn."""
    for numbers in by_value(keys).values():
        yield numbers, drawn(resolver.registers.drawn_file(name), numbers)


def _member_placing(resolver: Resolver, name: str, member: CastMember, which: int) -> Placing:
    key = "at" if member.at is not None else "place"
    path = resolver.symbols.member_path(name, key, which)
    spot = places.Spot(resolver.symbols.numbers[name], path, f"cast.{name}.cell", 0)
    scope = reset_scope(path, f"cast.{name}.{key}", name)
    if member.at is not None:
        if member.place is not None:
            _both_places(resolver, path)
        return places.at(resolver, spot, member.at, scope)
    placing = places.place(resolver, spot, member.place or "anywhere", scope)
    if placing.nowhere and name == AGENT:
        raise resolver.findings.fail("S204", "the agent has to be somewhere in the room", placing.span)
    return placing


def _both_places(resolver: Resolver, path: DataPath) -> None:
    span = resolver.findings.places.key_span(path)
    raise resolver.findings.fail("S107", "only one of `place` and `at` can be given", span)


def _object_placings(resolver: Resolver, objects: Objects) -> Iterator[Placing]:
    group = resolver.symbols.scenario.objects[objects.name]
    base: DataPath = ("objects", objects.name)
    count = len(objects.numbers)
    if group.inside is not None:
        yield from _inside(resolver, objects, group)
        return
    if group.at is not None:
        if group.place is not None:
            _both_places(resolver, (*base, "at"))
        nested = any(isinstance(cell, tuple) for cell in group.at)
        cells = [cell if isinstance(cell, tuple) else (cell,) for cell in group.at] if nested else [group.at]
        _check_length(resolver, len(cells), count, (*base, "at"))
        for i, cell in enumerate(cells):
            path = (*base, "at", i) if nested else (*base, "at")
            spot = _spot(objects, i, path, count)
            yield places.at(resolver, spot, cell, object_scope(objects, i, path, "at", at_reset=True))  # type: ignore[arg-type]
        return
    listed = group.place or ("anywhere",)
    single = not (group.place and resolver.findings.is_list((*base, "place")))
    if not single:
        _check_length(resolver, len(listed), count, (*base, "place"))
    for i in range(count):
        path = (*base, "place") if single else (*base, "place", i)
        raw = listed[0 if single else i]
        scope = object_scope(objects, i, path, "place", at_reset=True)
        placing = places.place(resolver, _spot(objects, i, path, count), str(raw), scope)
        yield replace(placing, overlap=group.overlap)


def _inside(resolver: Resolver, objects: Objects, group: ObjectGroup) -> Iterator[Placing]:
    """Things that lie in others at first."""
    base: DataPath = ("objects", objects.name)
    for key in ("place", "at"):
        if getattr(group, key) is not None:
            span = resolver.findings.places.key_span((*base, key))
            raise resolver.findings.fail("S107", f"only one of `inside` and `{key}` can be given", span)
    path = (*base, "inside")
    for i in range(len(objects.numbers)):
        spot = _spot(objects, i, path, len(objects.numbers))
        holder = contents.inside_of(resolver, objects, i, path, str(group.inside))
        span = resolver.findings.at(path)
        site = f"objects.{objects.called(i)}.inside"
        yield Placing(spot.entity, spot.site, spot.number, span, inside=holder, where_site=site)


def _spot(objects: Objects, index: int, path: DataPath, count: int) -> places.Spot:
    return places.Spot(objects.numbers[index], path, f"objects.{objects.name}.cell", index, index, count)


def _check_length(resolver: Resolver, given: int, count: int, path: DataPath) -> None:
    if given != count:
        message = f"{given} given for {count}: a list has one for each member of the group"
        raise resolver.findings.fail("S106", message, resolver.findings.at(path))


# -- colours and directions --------------------------------------------------------------------------------------


def colorings(resolver: Resolver) -> Iterator[Coloring]:
    """The colour of every entity."""
    for name, members in resolver.symbols.alternatives.items():
        with surviving():
            for numbers, when in _distinct(resolver, name, [member.color for member in members]):
                path = resolver.symbols.member_path(name, "color", numbers[0])
                scope = reset_scope(path, f"cast.{name}.color", name)
                color = members[numbers[0]].color
                if color == "distinct":
                    yield _distinct_color(resolver, name, path)
                    continue
                value = None if color is None else _color(resolver, path, color, scope)
                number = resolver.symbols.numbers[name]
                yield Coloring(number, f"cast.{name}.color", 0, resolver.findings.at(path), value, when=when)
    for objects in resolver.symbols.objects.values():
        with surviving():
            yield from _object_colors(resolver, objects, resolver.symbols.scenario.objects[objects.name])


def _distinct_color(resolver: Resolver, name: str, path: DataPath) -> Coloring:
    """The colour of one of a group of the cast that nobody before it in the group has."""
    symbols = resolver.symbols
    group = symbols.group_of(name)
    if group is None:
        message = "`distinct` colours are for a group: give `count`"
        raise resolver.findings.fail("S204", message, resolver.findings.at(path))
    before = tuple(symbols.numbers[one] for one in symbols.groups[group[0]][: group[1]])
    if len(before) >= COLOR.size:
        message = f"{len(symbols.groups[group[0]])} distinct colours are asked for; there are {COLOR.size}"
        raise resolver.findings.fail("S106", message, resolver.findings.at(path))
    number = symbols.numbers[name]
    return Coloring(number, f"cast.{group[0]}.color", group[1], resolver.findings.at(path), None, before)


def _color(resolver: Resolver, path: DataPath, raw: object, scope: Scope) -> Sited | None:
    """A colour; None for a random one."""
    if raw == "random":
        return None
    term = resolver.written(path, raw, COLOR, scope)  # type: ignore[arg-type]
    return Sited(term, scope.draws.site, resolver.findings.at(path))


def _object_colors(resolver: Resolver, objects: Objects, group: ObjectGroup) -> Iterator[Coloring]:
    base: DataPath = ("objects", objects.name, "color")
    site = f"objects.{objects.name}.color"
    count = len(objects.numbers)
    given = group.color or (resolver.symbols.default_colors.get(objects.type.name, "random"),)
    single = not (group.color and resolver.findings.is_list(base))
    if not single:
        _check_length(resolver, len(given), count, base)
    distinct = single and given[0] == "distinct"
    if distinct and count > COLOR.size:
        message = f"{count} distinct colours are asked for; there are {COLOR.size}"
        raise resolver.findings.fail("S106", message, resolver.findings.at(base))
    for i, number in enumerate(objects.numbers):
        path = base if single else (*base, i)
        raw = given[0 if single else i]
        span = resolver.findings.at(path)
        if distinct:
            yield Coloring(number, site, i, span, None, tuple(objects.numbers[:i]))
            continue
        scope = object_scope(objects, i, path, "color", at_reset=True)
        value = _of_group(resolver, path, raw, i, count, scope) or _color(resolver, path, raw, scope)
        yield Coloring(number, site, i, span, value)


def _of_group(
    resolver: Resolver, path: DataPath, raw: object, index: int, count: int, scope: Scope
) -> Sited | None:
    """`color: doors.color` gives each member the colour of its counterpart; `permuted(doors.color)` that of another."""
    if not isinstance(raw, str):
        return None
    node = resolver.findings.expression(path, raw)
    match node:
        case ast.Call(name="permuted", args=(ast.Attribute(name="color") as colors,), subject=None):
            return _permuted(resolver, path, colors, index, count, scope)
    if not isinstance(node, ast.Attribute) or not resolve_groups.is_group(resolver, node.subject, scope):
        return None
    others = resolve_groups.group(resolver, node.subject, None, scope)
    if node.name != "color":
        message = f"`{node.name}` gives no colours; write `{quoted(node.subject)}.color`"
        raise resolver.fail("S205", message, node, scope)
    if len(others.items) != count:
        message = f"`{quoted(node)}` gives {len(others.items)} values for {count}"
        raise resolver.fail("S106", message, node, scope)
    return Sited(FieldOf(COLOR, others.items[index], "color"), scope.draws.site, resolver.findings.at(path))


def _permuted(
    resolver: Resolver, path: DataPath, node: ast.Attribute, index: int, count: int, scope: Scope
) -> Sited:
    """The colour of one of a group, another one for each, in an order that is drawn."""
    others = resolve_groups.group(resolver, node.subject, None, scope)
    if len(others.items) != count:
        message = f"`{quoted(node)}` gives {len(others.items)} values for {count}"
        raise resolver.fail("S106", message, node, scope)
    place = tables.permutation(resolver, f"{path[0]}.{path[1]}.order", count, path)[index]
    colors = tuple(FieldOf(COLOR, other, "color") for other in others.items)
    cases = tuple(Compare("==", place, Const(place.type, i)) for i in range(count - 1))
    value = Select(COLOR, cases, colors[:-1], colors[-1])
    return Sited(value, scope.draws.site, resolver.findings.at(path))


def facings(resolver: Resolver) -> Iterator[Facing]:
    """The direction of every member of the cast."""
    for name, members in resolver.symbols.alternatives.items():
        with surviving():
            for numbers, when in _distinct(resolver, name, [member.facing for member in members]):
                facing = _facing(resolver, name, members[numbers[0]], numbers[0])
                yield replace(facing, when=when)


def _facing(resolver: Resolver, name: str, member: CastMember, which: int) -> Facing:
    path = resolver.symbols.member_path(name, "facing", which)
    span, site = resolver.findings.at(path), f"cast.{name}.facing"
    number = resolver.symbols.numbers[name]
    if member.facing is None or member.facing == "random":
        return Facing(number, site, span)
    scope = reset_scope(path, site, name)
    node = resolver.findings.expression(path, member.facing)
    if isinstance(node, ast.Call) and node.name == "toward" and node.subject is None:
        if len(node.args) != 1:
            raise resolver.fail("S211", "`toward` takes who or what to turn to: toward(agent)", node, scope)
        return Facing(number, site, span, toward=resolver.value(node.args[0], ENTITY, scope))
    term = resolver.value(node, DIRECTION, scope)
    return Facing(number, site, span, Sited(term, scope.draws.site, span))


# -- the order ---------------------------------------------------------------------------------------------------


def ordered(
    resolver: Resolver,
    placed: Mapping[int, Sequence[Placing]],
    colors: Sequence[Coloring],
    turned: Sequence[Facing],
    registers: Sequence[Drawn],
) -> tuple[Setup, ...]:
    """Everything drawn at reset: placements in their order, what they need before them, the rest after."""
    items: dict[str, list[Setup]] = {}
    for number in _placement_order(resolver):
        if number in placed:
            items[f"cell {number}"] = list(placed[number])
    for coloring in colors:
        items.setdefault(f"color {coloring.entity}", []).append(coloring)
    items |= {drawing.path: [drawing] for drawing in registers}
    for facing in turned:
        items.setdefault(f"facing {facing.entity}", []).append(facing)
    return tuple(_Sorter(resolver, items).sorted())


def _placement_order(resolver: Resolver) -> list[int]:
    """`order:` first, then objects, NPCs, the agent."""
    symbols = resolver.symbols
    numbers: dict[str, Sequence[int]] = {name: o.numbers for name, o in symbols.objects.items()}
    for name, number in symbols.numbers.items():
        group = symbols.group_of(name)
        called = group[0] if group is not None else name
        if number:
            numbers[called] = [*numbers.get(called, ()), number]
    numbers["agent"] = (0,)
    first: list[str] = []
    for i, name in enumerate(symbols.scenario.order):
        span = resolver.findings.at(("order", i), 0, len(name))
        if name not in numbers:
            near = did_you_mean(name, numbers)
            resolver.findings.error("S201", f"unknown name `{name}`", span, suggestion=near)
        elif name in first:
            resolver.findings.error("S106", f"`{name}` is in the order twice", span)
        else:
            first.append(name)
    return [n for name in dict.fromkeys([*first, *numbers]) for n in numbers[name]]


class _Sorter:
    """Depth-first: an item comes after everything it needs."""

    def __init__(self, resolver: Resolver, items: Mapping[str, Sequence[Setup]]) -> None:
        self._resolver = resolver
        self._items = items
        self._done: dict[str, Sequence[Setup]] = {}
        self._path: list[str] = []
        self._circular: set[str] = set()

    def sorted(self) -> Iterator[Setup]:
        for key in self._items:
            with surviving():
                self._visit(key)
        return chain.from_iterable(self._done.values())

    def _visit(self, key: str) -> None:
        if key in self._done or key not in self._items:
            return
        if key in self._path:
            circle = self._path[self._path.index(key) :]
            if self._circular & set(circle):
                raise FailedError  # the same circle, entered elsewhere
            self._circular |= set(circle)
            raise self._circle([*circle, key])
        self._path.append(key)
        try:
            for item in self._items[key]:
                for need in needs(item):
                    self._visit(need)
        finally:
            self._path.pop()
        self._done[key] = self._items[key]

    def _circle(self, keys: list[str]) -> FailedError:
        names = [self._called(key) for key in keys]
        message = " and ".join(f"{a} needs {b}" for a, b in pairwise(names))
        item = self._items[keys[0]][0]
        span = item.value.span if isinstance(item, Drawn) else item.span
        return self._resolver.findings.fail("S208", message, span)

    def _called(self, key: str) -> str:
        kind, _, number = key.partition(" ")
        if not number:
            return f"`{key.removeprefix('let.')}`"
        symbols = self._resolver.symbols
        objects = symbols.object_of(int(number))
        name = objects.name if objects is not None else symbols.member_of(int(number))
        what = {"cell": "the place", "color": "the colour", "facing": "the direction"}[kind]
        return f"{what} of `{name}`"


def needs(item: Setup) -> list[str]:
    """Keys of what has to be known before an item: registers, cells, colours, directions."""
    found: dict[str, None] = {}
    if isinstance(item, Coloring):
        found |= {f"color {n}": None for n in item.distinct_from}
    if isinstance(item, Facing) and item.toward is not None:
        found |= {f"cell {n}": None for n in (item.entity, *_numbers(item.toward))}
    if isinstance(item, Placing):
        for region in item.regions:
            for term in region.args if region.name in ("next_to", "in_front_of") else ():
                found |= {f"cell {n}": None for n in _numbers(term)}
                if region.name == "in_front_of":
                    found |= {f"facing {n}": None for n in _numbers(term)}
    if isinstance(item, Placing) and item.inside is not None:
        found |= {f"cell {n}": None for n in _numbers(item.inside)}
    for term in walk(item):
        found |= dict.fromkeys(_needs(term))
    return list(found)


def _needs(term: Term) -> Iterator[str]:
    match term:
        case Read(path=path):
            yield path
        case FieldOf(entity=entity, name=name):
            kind = {"x": "cell", "y": "cell", "inside": "cell", "dir": "facing", "color": "color"}.get(name)
            yield from (f"{kind} {n}" for n in _numbers(entity) if kind)
        case Test(name=name, subject=subject, object=other):
            entities = [*_numbers(other), *(_numbers(subject) if subject is not None else ())]
            yield from (f"cell {n}" for n in entities)
            if name in _FACING_TESTS or name == "in_front_of":
                yield from (f"facing {n}" for n in entities)
        case Measure(args=args):
            yield from (f"cell {n}" for arg in args for n in _numbers(arg))
        case Sees(viewer=viewer, target=target, facing=facing):
            yield from (f"cell {n}" for one in (viewer, target) for n in _numbers(one))
            if facing is None:
                yield from (f"facing {n}" for n in _numbers(viewer))
        case CellOf(entity=entity) | CellBeside(entity=entity):
            yield from (f"cell {n}" for n in _numbers(entity))


def _numbers(term: Term) -> range:
    """The entities that a term can stand for."""
    return range(term.type.low, term.type.high + 1) if term.type.kind == "entity" else range(0)
