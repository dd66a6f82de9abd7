"""The room: its sizes, its canvas, and what is built into it."""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema import Scenario
from socialai_dsl.schema.base import Expression
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import places
from socialai_dsl.semantics.build import walk
from socialai_dsl.semantics.findings import FailedError, Findings, surviving
from socialai_dsl.semantics.plans import Region, RoomPlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import reset_scope
from socialai_dsl.semantics.terms import ObjectType, World
from socialai_dsl.source import Span

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
        low, high = _numbers(findings.expression(path, raw))
    except FailedError:
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


def _numbers(node: ast.Expr) -> Sizes:
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
                span = findings.places.key_span(path)
                findings.error("S309", f"unknown object type `{name}`", span, suggestion=near)
                continue
            with surviving():
                yield from _regions(resolver, path, raw, type_)


def _regions(
    resolver: Resolver, path: DataPath, raw: str, type_: ObjectType
) -> Iterator[tuple[ObjectType, Region, Span]]:
    findings, scope = resolver.findings, reset_scope(path)
    node = findings.expression(path, raw)
    for option in node.options if isinstance(node, ast.Alternatives) else (node,):
        for region in places.region(resolver, option, scope):
            reads = [t for t in walk(region.args) if not isinstance(t, World) and hasattr(t, "path")]
            if reads or region.name in ("next_to", "in_front_of") or (region.name == "wall" and region.args):
                message = "what is built into the room depends on its size alone"
                raise findings.fail(
                    "S204", message, findings.at(path), hint="use W and H, and put what is drawn in `objects`"
                )
            yield type_, region, findings.at(path)
