"""The plan of a reset: the room, the placements, and every draw in its order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import Final

from socialai_dsl import cures
from socialai_dsl.diagnostics import advice_on, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import Expression, ObjectGroup, Scenario
from socialai_dsl.semantics import groups, hands, object_facts, tables
from socialai_dsl.semantics.cast import AGENT, Case
from socialai_dsl.semantics.facts import What, entities_of, needs
from socialai_dsl.semantics.plans import Coloring, Drawn, Facing, Placing, Region, RoomPlan, Setup
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import (
    Findings,
    Objects,
    ReportedError,
    Scope,
    object_scope,
    quoted,
    reset_scope,
    surviving,
    wrong_count,
)
from socialai_dsl.semantics.terms import (
    BOOL,
    COLOR,
    DIRECTION,
    Compare,
    Const,
    FieldOf,
    Here,
    Logic,
    Not,
    ObjectType,
    Operation,
    Select,
    SitedTerm,
    Term,
    World,
    chosen,
    walk,
)
from socialai_dsl.semantics.words import PLACES
from socialai_dsl.semantics.words.places import Placed
from socialai_dsl.source import DataPath, Span


@dataclass(frozen=True)
class Spot:
    """Whom a place is for: its entity, where its text stands, the site and number of its draw.

    `index` and `count`: which member of its group it is, and how many there are.
    """

    entity: int
    path: DataPath
    site: str
    number: int
    index: int = 0
    count: int = 1


def at(resolver: Resolver, spot: Spot, pair: Sequence[Expression], scope: Scope) -> Placing:
    """An exact cell, `at: [x, y]`."""
    findings = resolver.findings
    if len(pair) != 2:
        raise findings.fail(
            "S104", f"`at` is a cell [x, y]; {len(pair)} numbers given", findings.at(spot.path)
        )
    x, y = (resolver.written(raw, INT, replace(scope, path=(*spot.path, i))) for i, raw in enumerate(pair))
    span = findings.at(spot.path)
    return Placing(spot.entity, spot.site, spot.number, span, at=(x, y), where_site=scope.draws.site)


def place(resolver: Resolver, spot: Spot, raw: str, scope: Scope) -> Placing:
    """A drawn cell, `place: region where condition`."""
    node = resolver.findings.expression(spot.path, raw)
    span = resolver.findings.at(spot.path)
    where: Term | None = None
    if isinstance(node, ast.FilteredRegion):
        region, condition = node.region, node.where
    else:
        region, condition = node, None
    if isinstance(region, ast.Name) and region.id == "nowhere":
        return Placing(spot.entity, spot.site, spot.number, span, nowhere=True)
    regions = tuple(_regions(resolver, region, scope, spot))
    if condition is not None:
        where = resolver.value(condition, BOOL, replace(scope, here=True))
    return Placing(
        spot.entity, spot.site, spot.number, span, regions=regions, where=where, where_site=scope.draws.site
    )  # fmt: skip


def _regions(resolver: Resolver, node: ast.Expr, scope: Scope, spot: Spot | None = None) -> Iterator[Region]:
    """The regions of a place, which may be alternatives."""
    for option in ast.options_of(node):
        yield from _region(resolver, option, scope, spot)


def _region(resolver: Resolver, node: ast.Expr, scope: Scope, spot: Spot | None) -> tuple[Region, ...]:
    """The regions that one place word stands for."""
    name, args = _head(resolver, node, scope)
    define = resolver.symbols.defines.get(name)
    if define is not None and not args and not define.parameters:
        if name in scope.within:
            raise resolver.fail("S208", f"`{name}` needs itself", node, scope)
        resolver.used.add(define.path)
        body = resolver.findings.expression(define.path, define.raw)
        inner = replace(scope, path=define.path, within=(*scope.within, name))
        return tuple(_regions(resolver, body, inner, spot))
    word = PLACES.get(name)
    if word is None:
        raise _unknown(resolver, name, node, scope)
    most = len(word.takes)
    if not most - word.optional <= len(args) <= most:
        raise resolver.fail("S211", wrong_count(word, len(args)), node, scope)
    whose = (spot.index, spot.count) if spot is not None else (0, None)
    return word.meaning(Placed(resolver, word, node, args, scope, *whose))


def _head(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[str, tuple[ast.Expr, ...]]:
    match node:
        case ast.Name(id=name):
            return name, ()
        case ast.Call(name=name, args=args, subject=None):
            return name, args
    hint = "places are " + ", ".join(PLACES)
    if isinstance(node, ast.Conditional):
        hint = "a number in it can depend, `row(2 if c else 4)`, or its condition, `anywhere where (... if c else ...)`"
    raise resolver.fail("S204", f"`{quoted(node)}` is not a place", node, scope, hint=hint)


def _unknown(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> ReportedError:
    advice = advice_on(name, PLACES, "places are " + ", ".join(PLACES))
    if name in ("center", "centre", "middle"):
        advice = {
            "hint": "the middle is `rect(W // 2, H // 2, W // 2, H // 2)`; a cell of your choice is `at: [x, y]`"
        }
    return resolver.fail("S205", f"unknown place `{name}`", node, scope, **advice)


# -- the room: its sizes, its canvas, and what is built into it ----------------------------------------------


SMALLEST, LARGEST = 3, 30
"""Cells each way: a line of a room and its neighbours are one word of 32 bits."""

_ASSUMED = (5, 8)
"""Sizes to go on with after a mistake in them."""

Sizes = tuple[int, int]


def room_sizes(scenario: Scenario, findings: Findings) -> tuple[Sizes, Sizes]:
    """Least and greatest width and height, walls included."""
    room = scenario.room
    if room.size is not None:
        for key, other in (("width", room.width), ("height", room.height)):
            if other is not None:
                span = findings.places.key_span(("room", key))
                findings.error("S107", f"`size` gives width and height already; leave out `{key}`", span)
        size = _range(findings, ("room", "size"), room.size)
        return size, size
    if room.width is None or room.height is None:
        missing = "`size`, or `width` and `height`" if room.width is None and room.height is None else \
            "`width`" if room.width is None else "`height`"  # fmt: skip
        findings.error("S105", f"the room needs {missing}", findings.places.key_span(("room",)))
        return _ASSUMED, _ASSUMED
    return _range(findings, ("room", "width"), room.width), _range(findings, ("room", "height"), room.height)


def _range(findings: Findings, path: DataPath, raw: Expression) -> Sizes:
    try:
        low, high = _bounds(findings.expression(path, raw))
    except ReportedError:
        return _ASSUMED
    except ValueError:
        findings.error(
            "S204", f"`{path[-1]}` is a number of cells such as 8, or a range such as 5..8", findings.at(path)
        )
        return _ASSUMED
    if not SMALLEST <= low <= high <= LARGEST:
        message = f"a room has {SMALLEST} to {LARGEST} cells each way, walls included; {low}..{high} given"
        findings.error("S106", message, findings.at(path))
        return _ASSUMED
    return low, high


def _bounds(node: ast.Expr) -> Sizes:
    match node:
        case ast.Number(value=value):
            return value, value
        case ast.Interval(low=ast.Number(value=low), high=ast.Number(value=high)):
            return low, high
    raise ValueError


def room_plan(resolver: Resolver) -> RoomPlan:
    """The room with its canvas and what is built into it."""
    symbols, findings = resolver.symbols, resolver.findings
    room = symbols.scenario.room
    (_, width), (_, height) = symbols.width, symbols.height
    columns, rows = room.canvas or (width, height)
    canvas = columns, rows
    if canvas[0] < width or canvas[1] < height:
        message = f"the canvas of {canvas[0]}x{canvas[1]} is smaller than the largest room, {width}x{height}"
        findings.error("S106", message, findings.at(("room", "canvas")))
    if max(canvas) > LARGEST:
        message = f"a canvas has at most {LARGEST} cells each way, this one {canvas[0]}x{canvas[1]}"
        findings.error("S106", message, findings.at(("room", "canvas")))
    return RoomPlan(symbols.width, symbols.height, canvas, tuple(_built(resolver)), room.occlusion)


def _built(resolver: Resolver) -> Iterator[tuple[ObjectType, Region, Span]]:
    findings = resolver.findings
    for i, entry in enumerate(resolver.symbols.scenario.room.build):
        for name, raw in entry.items():
            path: DataPath = ("room", "build", i, name)
            type_ = resolver.symbols.types.get(name)
            if type_ is None:
                near = did_you_mean(name, resolver.symbols.types)
                hint = None if near else "what is built is a type with its place: `{wall: row(3)}`"
                span = findings.places.key_span(path)
                findings.error("S309", f"unknown object type `{name}`", span, suggestion=near, hint=hint)
                continue
            with surviving():
                yield from _built_regions(resolver, path, raw, type_)


def _built_regions(
    resolver: Resolver, path: DataPath, raw: str, type_: ObjectType
) -> Iterator[tuple[ObjectType, Region, Span]]:
    findings, scope = resolver.findings, reset_scope(path)
    node, where = findings.expression(path, raw), None
    if isinstance(node, ast.FilteredRegion):
        where = resolver.value(node.where, BOOL, replace(scope, here=True))
        node = node.region
    for part in _regions(resolver, node, scope):
        drawn = part.around or (part.name == "wall" and part.args)
        if drawn or not all(map(_follows_from_size, walk((part.args, where)))):
            message = "what is built into the room depends on its size alone"
            hint = "use W and H, and `here` behind `where`; put what is drawn in `objects`"
            raise findings.fail("S204", message, findings.at(path), hint=hint)
        yield type_, replace(part, where=where), findings.at(path)


def _follows_from_size(term: Term) -> bool:
    """Whether a term, apart from what it is made of, is known of a cell once the size of the room is."""
    if isinstance(term, Here):
        return term.name != "cell"
    return isinstance(term, Const | World | Operation | Compare | Not | Logic | Select)


# -- placements --------------------------------------------------------------------------------------------------


def placings(resolver: Resolver) -> dict[int, tuple[Placing, ...]]:
    """Entity -> where it is put; several, each with its condition, where that has cases."""
    found: dict[int, tuple[Placing, ...]] = {}
    for name, member in resolver.symbols.cast.items():
        with surviving():
            for version in member.versions:
                if {"place", "at"} <= version.keys():
                    _both_places(resolver, version["at"].path)
            placings = (_member_placing(resolver, name, case) for case in member.cases("at", "place"))
            found[resolver.symbols.numbers[name]] = tuple(placings)
    for objects in resolver.symbols.objects.values():
        with surviving():
            for placing in _object_placings(resolver, objects):
                found[placing.entity] = (placing,)
    _check_hands(resolver, found)
    return found


def _check_hands(resolver: Resolver, placed: Mapping[int, tuple[Placing, ...]]) -> None:
    """Report a second thing in the hands of one member of the cast."""
    full: dict[int, int] = {}
    for number, (placing, *_) in placed.items():
        holder = placing.inside
        if not isinstance(holder, Const) or not placing.in_hands:
            continue
        if holder.value in full:
            who = resolver.symbols.member_of(holder.value)
            message = f"`{who}` carries one thing at a time"
            resolver.findings.error("S204", message, placing.span, hint="put this one somewhere else")
        full[holder.value] = number


def _member_placing(resolver: Resolver, name: str, case: Case) -> Placing:
    key = case.path[-1]
    spot = Spot(resolver.symbols.numbers[name], case.path, f"cast.{name}.cell", 0)
    scope = reset_scope(case.path, f"cast.{name}.{key}", name)
    if key == "at":
        placing = at(resolver, spot, case.raw, scope)
    else:
        placing = place(resolver, spot, case.raw or "anywhere", scope)
    if placing.nowhere and name == AGENT:
        raise resolver.findings.fail("S204", "the agent has to be somewhere in the room", placing.span)
    return replace(placing, when=case.when)


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
            yield at(resolver, spot, cell, object_scope(objects, i, path, "at", at_reset=True))  # type: ignore[arg-type]
        return
    listed = group.place or ("anywhere",)
    single = not (group.place and resolver.findings.is_list((*base, "place")))
    if not single:
        _check_length(resolver, len(listed), count, (*base, "place"))
    for i in range(count):
        path = (*base, "place") if single else (*base, "place", i)
        raw = listed[0 if single else i]
        scope = object_scope(objects, i, path, "place", at_reset=True)
        placing = place(resolver, _spot(objects, i, path, count), str(raw), scope)
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
        holder = object_facts.inside_of(resolver, objects, i, path, str(group.inside))
        span = resolver.findings.at(path)
        site = f"objects.{objects.called(i)}.inside"
        in_hands = hands.is_member(resolver, holder)
        yield Placing(
            spot.entity, spot.site, spot.number, span, inside=holder, in_hands=in_hands, where_site=site
        )


def _spot(objects: Objects, index: int, path: DataPath, count: int) -> Spot:
    return Spot(objects.numbers[index], path, f"objects.{objects.name}.cell", index, index, count)


def _check_length(resolver: Resolver, given: int, count: int, path: DataPath) -> None:
    if given != count:
        message = f"{given} given for {count}: a list has one for each member of the group"
        raise resolver.findings.fail("S106", message, resolver.findings.at(path))


# -- colours and directions --------------------------------------------------------------------------------------


def colorings(resolver: Resolver) -> Iterator[Coloring]:
    """The colour of every entity."""
    for name, member in resolver.symbols.cast.items():
        with surviving():
            for case in member.cases("color"):
                if case.raw == "distinct":
                    yield replace(_distinct_color(resolver, name, case.path), when=case.when)
                    continue
                number, site = resolver.symbols.numbers[name], f"cast.{name}.color"
                scope, span = reset_scope(case.path, site, name), resolver.findings.at(case.path)
                value = None if case.raw is None else _color(resolver, case.raw, scope)
                yield Coloring(number, site, 0, span, value, when=case.when)
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


def _color(resolver: Resolver, raw: object, scope: Scope) -> SitedTerm | None:
    """A colour; None for a random one."""
    return None if raw == "random" else resolver.sited(raw, COLOR, scope)  # type: ignore[arg-type]


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
        value = _of_group(resolver, path, raw, i, count, scope) or _color(resolver, raw, scope)
        yield Coloring(number, site, i, span, value)


def _of_group(
    resolver: Resolver, path: DataPath, raw: object, index: int, count: int, scope: Scope
) -> SitedTerm | None:
    """`color: doors.color` gives each member the colour of its counterpart; `permuted(doors.color)` that of another."""
    if not isinstance(raw, str):
        return None
    node, shuffled = resolver.findings.expression(path, raw), False
    match node:
        case ast.Call(name="permuted", args=(ast.Attribute(name="color") as colors,), subject=None):
            node, shuffled = colors, True
    if not isinstance(node, ast.Attribute) or not (
        shuffled or groups.is_group(resolver, node.subject, scope)
    ):
        return None
    others = groups.group(resolver, node.subject, None, scope)
    if node.name != "color":
        hint = cures.write("color", resolver.findings.instead(path, node, "color", only_name=True))
        raise resolver.fail("S205", f"`{node.name}` gives no colours", node, scope, hint=hint)
    if len(others.items) != count:
        message = f"`{quoted(node)}` gives {len(others.items)} values for {count}"
        raise resolver.fail("S106", message, node, scope)
    each = tuple(FieldOf(COLOR, other, "color") for other in others.items)
    value: Term = each[index]
    if shuffled:
        place = tables.permutation(resolver, f"{path[0]}.{path[1]}.order", count, path)[index]
        value = chosen(place, range(count), each, COLOR)
    return SitedTerm(value, scope.draws.site, resolver.findings.at(path))


def facings(resolver: Resolver) -> Iterator[Facing]:
    """The direction of every member of the cast."""
    for name, member in resolver.symbols.cast.items():
        with surviving():
            for case in member.cases("facing"):
                yield replace(_facing(resolver, name, case), when=case.when)


def _facing(resolver: Resolver, name: str, case: Case) -> Facing:
    span, site = resolver.findings.at(case.path), f"cast.{name}.facing"
    number = resolver.symbols.numbers[name]
    if case.raw is None or case.raw == "random":
        return Facing(number, site, span)
    scope = reset_scope(case.path, site, name)
    node = resolver.findings.expression(case.path, case.raw)
    if isinstance(node, ast.Call) and node.name == "toward" and node.subject is None:
        if len(node.args) != 1:
            raise resolver.fail("S211", "`toward` takes who or what to turn to: toward(agent)", node, scope)
        return Facing(number, site, span, toward=resolver.value(node.args[0], ENTITY, scope))
    term = resolver.value(node, DIRECTION, scope)
    return Facing(number, site, span, SitedTerm(term, scope.draws.site, span))


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
            resolver.findings.no_such(name, f"unknown name `{name}`", span, suggestion=near)
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
                raise ReportedError  # the same circle, entered elsewhere
            self._circular |= set(circle)
            raise self._circle([*circle, key])
        self._path.append(key)
        try:
            for item in self._items[key]:
                for need in _needs(item):
                    self._visit(need)
        finally:
            self._path.pop()
        self._done[key] = self._items[key]

    def _circle(self, keys: list[str]) -> ReportedError:
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


_KEYS: Final[dict[What, str]] = {"cell": "cell", "container": "cell", "facing": "facing", "color": "color"}
"""What a reset gives entities, by what may be needed of them."""


def _needs(item: Setup) -> list[str]:
    """Keys of what has to be known before an item: registers, cells, colours, directions."""
    found: dict[str, None] = {}
    if isinstance(item, Coloring):
        found |= {f"color {n}": None for n in item.distinct_from}
    if isinstance(item, Facing) and item.toward is not None:
        found |= {f"cell {n}": None for n in (item.entity, *entities_of(item.toward))}
    if isinstance(item, Placing):
        for region in item.regions:
            for term in region.args if region.around else ():
                found |= {f"cell {n}": None for n in entities_of(term)}
                if region.name == "in_front_of":
                    found |= {f"facing {n}": None for n in entities_of(term)}
    if isinstance(item, Placing) and item.inside is not None and not item.in_hands:
        found |= {f"cell {n}": None for n in entities_of(item.inside)}
    for need in needs(item):
        if need.what == "register":
            found[need.path] = None
        elif need.what in _KEYS:
            found |= {f"{_KEYS[need.what]} {n}": None for n in need.entities}
    return list(found)
