"""Words for sets of cells in which something is put, or of which the room is built."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, cast

from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.plans import Region, RegionName
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import Scope, quoted
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import SIDE, Const, Type
from socialai_dsl.vocabulary import SIDES


@dataclass(frozen=True, slots=True)
class Placed:
    """The word of a place where it is written.

    Attributes:
        signature: the word. node: all of it, for messages. args: what is written in brackets.
        index, count: whose place it is of a group of how many; None: nobody's, the room is built of it.
    """

    resolver: Resolver
    signature: Signature
    node: ast.Expr
    args: tuple[ast.Expr, ...]
    scope: Scope
    index: int = 0
    count: int | None = None


def _known(placed: Placed) -> tuple[Region, ...]:
    """A region of numbers."""
    args = tuple(placed.resolver.value(arg, INT, placed.scope) for arg in placed.args)
    return (Region(cast(RegionName, placed.signature.name), args),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Place(Signature):
    """A word for a set of cells; `meaning` is the regions that a use of it stands for."""

    meaning: Callable[[Placed], tuple[Region, ...]] = _known


def _rect(placed: Placed) -> tuple[Region, ...]:
    """A region between two corners, the left upper one first."""
    (found,) = _known(placed)
    known = [arg.value if isinstance(arg, Const) else None for arg in found.args]
    pairs = [
        sorted(pair, key=lambda n: n or 0) if None not in pair else [*pair]
        for pair in (known[::2], known[1::2])
    ]
    ordered = [pairs[0][0], pairs[1][0], pairs[0][1], pairs[1][1]]
    if ordered != known:
        written = [quoted(arg) if n is None else str(n) for arg, n in zip(placed.args, ordered, strict=True)]
        message = (
            f"`{quoted(placed.node)}` is empty: it goes from its left upper corner to its right lower one"
        )
        hint = placed.resolver.instead(f"rect({', '.join(written)})", placed.node, placed.scope)
        raise placed.resolver.fail("S106", message, placed.node, placed.scope, hint=hint)
    return (found,)


def _about(placed: Placed) -> tuple[Region, ...]:
    """A region around something, or around each of a group."""
    resolver, (node,), scope = placed.resolver, placed.args, placed.scope
    name = cast(RegionName, placed.signature.name)
    if groups.is_group(resolver, node, scope):
        return tuple(Region(name, (each,)) for each in groups.group(resolver, node, None, scope).items)
    return (Region(name, (resolver.value(node, ENTITY, scope),)),)


def _wall(placed: Placed) -> tuple[Region, ...]:
    side = placed.resolver.value(placed.args[0], SIDE, placed.scope)
    return (Region("wall", side=SIDES[side.value]) if isinstance(side, Const) else Region("wall", (side,)),)


def _each_wall(placed: Placed) -> tuple[Region, ...]:
    """The wall of this member of the group: top, bottom, left, right in turn."""
    resolver, node, args, scope = placed.resolver, placed.node, placed.args, placed.scope
    margin = resolver.value(args[0], INT, scope) if args else Const(Type("int", 1, 1), 1)
    if not isinstance(margin, Const) or margin.value < 1:
        message = "`each_wall` takes a number, at least 1: cells from the corners"
        raise resolver.fail("S211", message, node, scope)
    if placed.count is None or not 2 <= placed.count <= len(SIDES):
        message = "`each_wall` is for a group of two to four, one in each wall"
        hint = "give `count: 4`; for one thing write `wall(top)`"
        raise resolver.fail("S204", message, node, scope, hint=hint)
    return (Region("wall", side=SIDES[placed.index], margin=margin.value),)


PLACES: Final = (
    Place("anywhere", doc="all floor cells of the room"),
    Place("nowhere", doc="no cell: it is not in the room", meaning=lambda _: ()),
    Place("left_half", doc="x < W // 2"),
    Place("right_half", doc="x > W // 2"),
    Place("top_half", doc="y < H // 2"),
    Place("bottom_half", doc="y > H // 2"),
    Place("column", takes=("int",), doc="column x, without the walls"),
    Place("row", takes=("int",), doc="row y, without the walls"),
    Place("rect", takes=("int", "int", "int", "int"),
          doc="the rectangle from (x0, y0) to (x1, y1), without the walls", meaning=_rect),
    Place("next_to", takes=("entities",), doc="the cells at a Manhattan distance of 1 from x", meaning=_about),
    Place("in_front_of", takes=("entities",),
          doc="the cell that x, a member, faces; for x in a wall, the cell one step into the room",
          meaning=_about),
    Place("wall", takes=("side",),
          doc="in the wall on this side (top, bottom, left, right), not in its corners", meaning=_wall),
    Place("each_wall", takes=("int",),
          doc="for a group of 2 to 4: one each in the top, bottom, left and right wall, at least `margin` "
              "cells (1) from the corners", optional=1, meaning=_each_wall),
)  # fmt: skip
