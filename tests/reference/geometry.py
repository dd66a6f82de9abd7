"""The conditions of the language about places and looks, each as `subject.verb(object)`; an object may be a group."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tests.reference.sight import lit
from tests.reference.world import (
    AHEAD,
    Cell,
    Entity,
    World,
    as_list,
    between,
    inward,
    quadrant,
    step_from,
    where,
)
from tests.reference.world import distance as manhattan


def _some(test: Callable[[World, Any, Any], bool]) -> Callable[[World, Any, Any], bool]:
    """The test for things that are in the room; for a group: for any of it."""

    def over_groups(world: World, a: Any, b: Any) -> bool:
        if where(a) is None:
            return False
        return any(test(world, a, one) for one in as_list(b) if where(one) is not None)

    return over_groups


def apart(a: Any, b: Any) -> int:
    """Manhattan distance between two things in the room."""
    start, goal = where(a), where(b)
    assert start is not None
    assert goal is not None
    return manhattan(start, goal)


@_some
def at(world: World, a: Any, x: Any) -> bool:
    """Same cell."""
    return where(a) == where(x)


@_some
def next_to(world: World, a: Any, x: Any) -> bool:
    """Manhattan distance 1; facing does not matter."""
    return apart(a, x) == 1


@_some
def in_front_of(world: World, a: Any, x: Any) -> bool:
    """On the cell one step from x into the room, for things in a wall; else on the cell x faces."""
    return isinstance(x, Entity) and where(a) == inward(world, x)


@_some
def faces(world: World, a: Any, x: Any) -> bool:
    """x is in the cell ahead of a."""
    return isinstance(a, Entity) and step_from(a.cell, a.facing) == where(x)  # type: ignore[arg-type]


@_some
def faces_toward(world: World, a: Any, x: Any) -> bool:
    """The direction of a is the one that `face(x)` would end at."""
    return a.facing == quadrant(where(a), where(x))  # type: ignore[arg-type]


@_some
def in_line(world: World, a: Any, x: Any) -> bool:
    """Same row or same column."""
    return any(p == q for p, q in zip(where(a), where(x), strict=True))  # type: ignore[arg-type]


@_some
def unobstructed(world: World, a: Any, x: Any) -> bool:
    """In one row or column with nothing opaque between."""
    return in_line(world, a, x) and all(world.transparent(c) for c in between(where(a), where(x)))  # type: ignore[arg-type]


def _ahead_and_aside(start: Cell, facing: str, goal: Cell) -> tuple[int, int]:
    """How far ahead and how far to the right a cell lies."""
    (fx, fy), (dx, dy) = AHEAD[facing], (goal[0] - start[0], goal[1] - start[1])
    return dx * fx + dy * fy, -dx * fy + dy * fx


@_some
def looks_at(world: World, a: Any, x: Any) -> bool:
    """x straight ahead, within the view, nothing opaque between."""
    ahead, aside = _ahead_and_aside(where(a), a.facing, where(x))  # type: ignore[arg-type]
    return aside == 0 and 0 < ahead < a.view and unobstructed(world, a, x)


def would_see(world: World, a: Any, x: Any, direction: str) -> bool:
    """x in the view square of a if it faced that way: a in the middle of the near edge; lit, where there is shadow."""

    def seen(_: World, a: Any, x: Any) -> bool:
        ahead, aside = _ahead_and_aside(where(a), direction, where(x))  # type: ignore[arg-type]
        in_square = 0 <= ahead < a.view and abs(aside) <= a.view // 2
        return in_square and (not world.occlusion or (ahead, aside) in lit(world, a.cell, direction, a.view))

    return _some(seen)(world, a, x)


@_some
def sees(world: World, a: Any, x: Any) -> bool:
    """x in the view square of a."""
    return would_see(world, a, x, a.facing)


@_some
def eye_contact(world: World, a: Any, b: Any) -> bool:
    """Same row or column, each facing the other, at any distance and whatever stands between; not on one cell."""
    if where(a) == where(b) or not in_line(world, a, b):
        return False
    towards, back = quadrant(where(a), where(b)), quadrant(where(b), where(a))  # type: ignore[arg-type]
    return a.facing == towards and b.facing == back


def joint_attention(world: World, a: Any, b: Any, x: Any = None) -> bool:
    """Both look at x, or without x at the same object."""
    goals = world.things() if x is None else as_list(x)
    return any(looks_at(world, a, goal) and looks_at(world, b, goal) for goal in goals)


@_some
def points_at(world: World, a: Any, x: Any) -> bool:
    """x lies straight in the direction in which a points, or in the cell at which it points."""
    straight = in_line(world, a, x) and a.pointing == quadrant(where(a), where(x))  # type: ignore[arg-type]
    return where(a) != where(x) and (straight or a.pointing == where(x))


def distance(world: World, a: Any, x: Any) -> int:
    """Manhattan distance, to the nearest of a group; beyond any room for what is gone."""
    if where(a) is None:
        return world.width + world.height
    apart_from = [apart(a, one) for one in as_list(x) if where(one) is not None]
    return min(apart_from, default=world.width + world.height)


def dir_to(world: World, a: Any, x: Any) -> str:
    """The direction of the quadrant in which x lies."""
    start, goal = where(a), where(x)
    return "down" if start is None or goal is None else quadrant(start, goal)


@_some
def can_reach(world: World, a: Any, x: Any) -> bool:
    """A path to x or next to x over free and walkable cells."""
    start, goal = where(a), where(x)
    assert start is not None
    assert goal is not None
    seen, queue = {start}, [start]
    for cell in queue:
        if manhattan(cell, goal) <= 1:
            return True
        for direction in AHEAD:
            ahead = step_from(cell, direction)
            if ahead not in seen and free(world, ahead, a if isinstance(a, Entity) else None):
                seen.add(ahead)
                queue.append(ahead)
    return False


def free(world: World, cell: Cell, body: Entity | None) -> bool:
    """Whether a body could stand there: walkable, not deadly, nobody else in it. Hidden NPCs do not stop the agent."""
    if not world.walkable(cell) or world.deadly(cell):
        return False
    others = [] if body is world.agent and world.npcs_hidden else world.members
    return all(other is body or other.cell != cell for other in others)
