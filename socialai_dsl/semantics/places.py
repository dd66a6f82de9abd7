"""Where things are put: the regions of `place:`, the coordinates of `at:`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.base import Expression
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import resolve_groups
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.plans import Placing, Region
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import PLACES
from socialai_dsl.semantics.terms import BOOL, SIDE, Const, Term, Type
from socialai_dsl.semantics.wording import quoted

_SIDES: tuple[Literal["top", "bottom", "left", "right"], ...] = ("top", "bottom", "left", "right")


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
    x, y = (
        resolver.written((*spot.path, i), raw, INT, _inside(scope, spot.path, i))
        for i, raw in enumerate(pair)
    )
    span = findings.at(spot.path)
    return Placing(spot.entity, spot.site, spot.number, span, at=(x, y), where_site=scope.draws.site)


def _inside(scope: Scope, path: DataPath, index: int) -> Scope:
    return replace(scope, path=(*path, index))


def place(resolver: Resolver, spot: Spot, raw: str, scope: Scope) -> Placing:
    """A drawn cell, `place: region where condition`."""
    node = resolver.findings.expression(spot.path, raw)
    span = resolver.findings.at(spot.path)
    where: Term | None = None
    if isinstance(node, ast.Placed):
        region, condition = node.region, node.where
    else:
        region, condition = node, None
    if isinstance(region, ast.Name) and region.id == "nowhere":
        return Placing(spot.entity, spot.site, spot.number, span, nowhere=True)
    regions = _regions(resolver, region, spot, scope)
    if condition is not None:
        where = resolver.value(condition, BOOL, replace(scope, here=True))
    return Placing(
        spot.entity, spot.site, spot.number, span, regions=regions, where=where, where_site=scope.draws.site
    )  # fmt: skip


def _regions(resolver: Resolver, node: ast.Expr, spot: Spot, scope: Scope) -> tuple[Region, ...]:
    options = node.options if isinstance(node, ast.Alternatives) else (node,)
    return tuple(r for option in options for r in region(resolver, option, scope, spot))


def region(resolver: Resolver, node: ast.Expr, scope: Scope, spot: Spot | None = None) -> tuple[Region, ...]:
    """The regions that one place word stands for."""
    name, args = _head(resolver, node, scope)
    define = resolver.symbols.defines.get(name)
    if define is not None and not args and not define.parameters:
        if name in scope.within:
            raise resolver.fail("S208", f"`{name}` needs itself", node, scope)
        resolver.used.add(define.path)
        body = resolver.findings.expression(define.path, define.raw)
        inner = replace(scope, path=define.path, within=(*scope.within, name))
        options = body.options if isinstance(body, ast.Alternatives) else (body,)
        return tuple(r for option in options for r in region(resolver, option, inner, spot))
    match name:
        case "anywhere" | "left_half" | "right_half" | "top_half" | "bottom_half":
            _takes(resolver, node, args, 0, scope)
            return (Region(name),)
        case "column" | "row":
            _takes(resolver, node, args, 1, scope)
            return (Region(name, (resolver.value(args[0], INT, scope),)),)
        case "rect":
            _takes(resolver, node, args, 4, scope)
            return (Region(name, tuple(resolver.value(arg, INT, scope) for arg in args)),)
        case "next_to" | "in_front_of":
            _takes(resolver, node, args, 1, scope)
            return tuple(Region(name, (target,)) for target in _targets(resolver, args[0], scope))
        case "wall":
            _takes(resolver, node, args, 1, scope)
            side = resolver.value(args[0], SIDE, scope)
            if isinstance(side, Const):
                return (Region("wall", side=_SIDES[side.value]),)
            return (Region("wall", (side,)),)
        case "each_wall":
            return (_each_wall(resolver, node, args, scope, spot),)
    raise _unknown(resolver, name, node, scope)


def _head(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[str, tuple[ast.Expr, ...]]:
    match node:
        case ast.Name(id=name):
            return name, ()
        case ast.Call(name=name, args=args, subject=None):
            return name, args
    raise resolver.fail(
        "S204", f"`{quoted(node)}` is not a place", node, scope, hint="places are " + ", ".join(PLACES)
    )


def _takes(resolver: Resolver, node: ast.Expr, args: tuple[ast.Expr, ...], count: int, scope: Scope) -> None:
    if len(args) != count:
        name = node.id if isinstance(node, ast.Name) else node.name if isinstance(node, ast.Call) else ""
        takes = ", ".join(PLACES[name].takes) if name in PLACES and count else "nothing" if not count else "x"
        raise resolver.fail("S211", f"`{name}` takes {takes} in brackets; {len(args)} given", node, scope)


def _targets(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[Term, ...]:
    if resolve_groups.is_group(resolver, node, scope):
        return resolve_groups.group(resolver, node, None, scope).items
    return (resolver.value(node, ENTITY, scope),)


def _each_wall(
    resolver: Resolver, node: ast.Expr, args: tuple[ast.Expr, ...], scope: Scope, spot: Spot | None
) -> Region:
    """The wall of this member of the group: top, bottom, left, right in turn."""
    margin = resolver.value(args[0], INT, scope) if args else Const(Type("int", 1, 1), 1)
    if len(args) > 1 or not isinstance(margin, Const) or margin.value < 1:
        raise resolver.fail(
            "S211", "`each_wall` takes a number, at least 1: cells from the corners", node, scope
        )
    if spot is None or spot.count > len(_SIDES) or spot.count < 2:
        message = "`each_wall` is for a group of two to four, one in each wall"
        raise resolver.fail(
            "S204", message, node, scope, hint="give `count: 4`; for one thing write `wall(top)`"
        )
    return Region("wall", side=_SIDES[spot.index], margin=margin.value)


def _unknown(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> FailedError:
    near = did_you_mean(name, [*PLACES, "next_to", "in_front_of"])
    hint = None if near else "places are " + ", ".join([*PLACES, "next_to", "in_front_of"])
    return resolver.fail("S205", f"unknown place `{name}`", node, scope, suggestion=near, hint=hint)
