"""Effects on things and members: which are asked for, and what each does."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference import geometry
from tests.reference.evaluate import Context, evaluate, of, there
from tests.reference.source import Sources
from tests.reference.world import TYPES, Cell, Entity, World, as_list, where

Cause = tuple[str, list[Entity], Any]


def causes(sources: Sources, rule: Any, path: str, context: Context, frame: str | None) -> list[Cause]:
    """The effects of a rule in order: a verb, what it is done to, and the status, cell or container it names."""
    found = []
    for number, source in enumerate(rule.cause):
        value = sources.expression(f"{path}.cause[{number}]", source, frame)
        found.append(cause(value.tree, replace(context, value=value)))
    return found


def cause(node: Any, context: Context) -> Cause:
    """One effect."""
    if isinstance(node, ast.Name):
        return node.id, as_list(context.me), None
    subject = as_list(context.me) if node.subject is None else as_list(of(node.subject, context))
    status: Any = None
    if node.name in ("put", "move_into"):
        status = of(node.args[0], context)
    elif isinstance(node, ast.Call) and node.args:
        status = node.args[0].id if isinstance(node.args[0], ast.Name) else str(of(node.args[0], context))
    return node.name, subject, status


def assignments(
    sources: Sources, rule: Any, path: str, context: Context, frame: str | None
) -> dict[str, Any]:
    """What a rule gives to registers, computed before anything is done."""
    return {
        name: there(evaluate(sources.expression(f"{path}.set.{name}", source, frame), context))
        for name, source in rule.set.items()
    }


def assign(world: World, me: Entity | None, values: dict[str, Any]) -> None:
    """Sets registers of one's own, else those of the world. A given range saturates."""
    for name, value in values.items():
        holder: Any = me if me is not None and name in me.registers else world
        low, high = holder.ranges.get(name, (value, value))
        holder.registers[name] = min(max(value, low), high) if name in holder.ranges else value


def affect(world: World, target: Entity, verb: str, status: Any) -> None:
    """One effect on one entity; what does not apply to its status changes nothing."""
    if verb == "vanish":
        vanish(target)
    elif verb == "reset":
        reset(world, target)
    elif verb == "put":
        put(world, target, where(status))
    elif verb == "move_into":
        target.cell, target.inside = None, status
    elif verb == "reveal":
        # What lies in it takes its place as the world settles.
        target.status = "opened"
    elif verb == "become":
        target.status = str(status)
    elif verb == "unlock":
        unlock(target)
    elif target.type == "box":
        target.status = {"open": "opened", "close": "shut", "lock": "locked"}[verb]
    else:
        target.status = {"open": "open", "close": "closed", "lock": "locked"}[verb]
    assert target.sort != "object" or target.status in TYPES[target.type].states


def put(world: World, target: Entity, cell: Cell | None) -> None:
    """It comes to a cell; somebody only where he can stand. What is not in the room has no cell to come to."""
    taken = any(member is not target and member.cell == cell for member in world.cast.values())
    if cell is None:
        return
    if target.sort == "object" or (world.walkable(cell) and not world.deadly(cell) and not taken):
        target.cell = cell


def remember(entity: Entity) -> None:
    """Keeps what `reset` will bring back."""
    entity.at_reset = (entity.status, entity.cell, entity.facing, entity.inside)


def reset(world: World, target: Entity) -> None:
    """As it was put down in this episode; an NPC turns back, and goes back if its place is free."""
    status, cell, facing, inside = target.at_reset
    if target.sort == "object":
        target.status, target.inside, target.counted = status, inside, 0
        for content in contents_at_reset(world, target):
            content.cell, content.inside = None, target
    else:
        target.pointing, target.facing = None, facing
        if cell is None or not geometry.free(world, cell, target):
            return
    target.cell, target.facing = cell, facing


def contents_at_reset(world: World, holder: Entity) -> list[Entity]:
    """What lay in a thing when the episode began."""
    return [one for one in world.things() if one.at_reset[1] is None and one.at_reset[3] is holder]


def vanish(target: Entity) -> None:
    """It is no longer in the room."""
    target.left_from, target.cell = target.cell or target.left_from, None


def unlock(target: Entity) -> None:
    """What is locked becomes closed, a box shut."""
    if target.status == "locked":
        target.status = "shut" if target.type == "box" else "closed"
