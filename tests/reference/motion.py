"""What happens to things by force: pushes, what rolls, and what runs out of time."""

from __future__ import annotations

from tests.reference.world import TYPES, Cell, Entity, World, step_from


def push(world: World, cell: Cell, direction: str, rolled: bool = False) -> None:
    """Somebody (or something that rolls) runs into a cell: what stands there in the way changes as its type says."""
    in_the_way = [thing for thing in world.objects_at(cell) if thing.status not in TYPES[thing.type].walkable]
    if not in_the_way:
        return
    thing = in_the_way[-1]
    changes = TYPES[thing.type].pushed
    if thing.status in changes and not thing.blocked and (rolled or not thing.only_rolled):
        thing.status, thing.facing = changes[thing.status], direction


def push_aside(world: World, body: Entity, cell: Cell) -> None:
    """Somebody walks into a member of the cast: if it can be pushed and the next cell is clear, it goes there."""
    there = [member for member in (*world.npcs, world.agent) if member.cell == cell and member is not body]
    beyond = step_from(cell, body.facing)
    if there and there[0].pushed_aside and world.walkable(cell) and clear(world, beyond):
        there[0].cell = beyond


def count_down(world: World) -> None:
    """Timers: an active status expires after its steps; in any other, and then, the count starts anew."""
    for thing in world.things():
        if thing.timer is None:
            continue
        type_ = TYPES[thing.type]
        thing.counted = thing.counted + 1 if thing.status in type_.active else 0
        if thing.counted == thing.timer:
            thing.status = type_.expired.get(thing.status, thing.status)
            thing.counted = 0


def roll(world: World) -> None:
    """All that rolls moves one cell; what runs into something pushes it and comes to rest."""
    for thing in world.things():
        if thing.cell is None or thing.status not in TYPES[thing.type].rolls:
            continue
        ahead = step_from(thing.cell, thing.facing)
        if clear(world, ahead):
            thing.cell = ahead
        else:
            push(world, ahead, thing.facing, rolled=True)
            thing.status = TYPES[thing.type].initial


def clear(world: World, cell: Cell) -> bool:
    """Whether something can roll there: nothing solid, nobody, nothing deadly."""
    nobody = all(member.cell != cell for member in world.members)
    return world.walkable(cell) and not world.deadly(cell) and nobody
