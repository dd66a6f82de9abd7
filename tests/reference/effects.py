"""Effects on things and members: which are asked for, and what each does."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem
from tests.reference import geometry
from tests.reference.evaluate import Context, NothingFoundError, evaluate, key_of, of, there
from tests.reference.source import Sources
from tests.reference.world import NO_CELL, NOTHING, TYPES, Cell, Entity, World, as_list, where

Cause = tuple[str, list[Entity], Any]


def causes(sources: Sources, rule: Any, path: str, context: Context, frame: str | None) -> list[Cause]:
    """The effects of a rule in order: a verb, what it is done to, and the status, cell or container it names."""
    found = []
    for number, source in enumerate(rule.cause):
        value = sources.expression(f"{path}.cause[{number}]", source, frame)
        own = replace(context, value=value)
        each = those_named(getattr(value.tree, "subject", None), getattr(value.tree, "args", ()))
        if each is None:
            found.append(cause(value.tree, own))
            continue
        # What the effect takes is about each of those: computed for each.
        for member in of(each, own):
            target = own.knowing(**{each.var: member})
            found.append(cause(replace(value.tree, subject=ast.Name(each.var)), target))
    return found


def those_named(node: Any, values: Any) -> ast.Quantifier | None:
    """`those(...)` if that stands there and its variable in one of some values; else None."""
    if isinstance(node, ast.Quantifier) and any(mentions(node.var, value) for value in values):
        return node
    return None


def mentions(word: str, node: Any) -> bool:
    """Whether a name stands in an expression."""
    return (isinstance(node, ast.Name) and node.id == word) or any(
        mentions(word, part) for part in node.children()
    )


def cause(node: Any, context: Context) -> Cause:
    """One effect."""
    if isinstance(node, ast.Name):
        return node.id, as_list(context.me), None
    subject = as_list(context.me) if node.subject is None else as_list(there(of(node.subject, context)))
    status: Any = None
    if node.name in ("put", "move_into"):
        status = there(of(node.args[0], context))
    elif isinstance(node, ast.Call) and node.args:
        status = node.args[0].id if isinstance(node.args[0], ast.Name) else str(of(node.args[0], context))
    return node.name, subject, status


def assignments(
    sources: Sources, rule: Any, path: str, context: Context, frame: str | None
) -> list[tuple[str, Any, Any]]:
    """What a rule gives to registers, each with its key if it has one, computed before anything is done."""
    found = []
    for written, source in rule.set.items():
        name = written.partition("(")[0].strip()
        tree = sources.expression(f"{path}.set.{written}.key", written, frame).tree
        if (
            isinstance(tree, ast.Attribute | ast.Name)
            and (look := last_word(tree)) in context.world.look_names
        ):
            value = there(_assigned(sources, f"{path}.set.{written}", source, context, frame))
            found += [
                (f".{look}", one, value) for one in _bearers(sources, written, look, path, context, frame)
            ]
            continue
        value: Any = NOTHING
        variable = _variable(sources, written, source, path, frame)
        if variable is not None:
            for key, member in _members(sources, written, path, context, frame):
                own = context.knowing(**{variable: member})
                found.append(
                    (name, key, there(_assigned(sources, f"{path}.set.{written}", source, own, frame)))
                )
            continue
        if (
            str(source).strip() != "none"
            or name not in holder_of(context.world, context.me, name).may_be_nothing
        ):
            value = there(_assigned(sources, f"{path}.set.{written}", source, context, frame))
        found += [(name, key, value) for key in _keys(sources, written, path, context, frame)]
    return found


def last_word(tree: ast.Attribute | ast.Name) -> str:
    """The name of what is set: of `ann.mood`, the look."""
    return tree.id if isinstance(tree, ast.Name) else tree.name


def _bearers(
    sources: Sources, written: str, look: str, path: str, context: Context, frame: str | None
) -> list[Entity]:
    """Whose look is set: that of one, of each of a group, or one's own."""
    value = sources.expression(f"{path}.set.{written}.key", written, frame)
    if isinstance(value.tree, ast.Name):
        return as_list(context.me)
    assert isinstance(value.tree, ast.Attribute)
    found = as_list(there(of(value.tree.subject, replace(context, value=value))))
    if not all(look in one.looks for one in found):
        raise NothingFoundError
    return found


def _assigned(sources: Sources, site: str, source: Any, context: Context, frame: str | None) -> Any:
    """A value; a noun of several words is written as it is."""
    if " " in str(source) and source in context.world.nouns:
        return source
    return evaluate(sources.expression(site, source, frame), context)


def _variable(sources: Sources, written: str, source: Any, path: str, frame: str | None) -> str | None:
    """The variable of `those(...)` in the key if the value speaks of it: then there is a value for each."""
    key = sources.expression(f"{path}.set.{written}.key", written, frame).tree if "(" in written else None
    if not isinstance(key, ast.Call) or source is None:
        return None
    try:
        sources.expression(f"{path}.set.{written}", source, frame)
    except ParseProblem:  # a noun of several words
        return None
    value, those = sources.expression(f"{path}.set.{written}", source, frame), key.args[0]
    variable = those.var.partition("~")[0] if isinstance(those, ast.Quantifier) else ""
    return variable if variable and mentions(variable, value.tree) else None


def _members(
    sources: Sources, written: str, path: str, context: Context, frame: str | None
) -> list[tuple[Any, Any]]:
    """Each of those whose registers are set, with its key."""
    value = sources.expression(f"{path}.set.{written}.key", written, frame)
    assert isinstance(value.tree, ast.Call)
    return [
        (key_of(there(one)), one) for one in as_list(of(value.tree.args[0], replace(context, value=value)))
    ]


def _keys(sources: Sources, written: str, path: str, context: Context, frame: str | None) -> list[Any]:
    """Whose registers are set: of `trust(speaker)` the speaker's, of a group each of it; None of a single one."""
    if "(" not in written:
        return [None]
    value = sources.expression(f"{path}.set.{written}.key", written, frame)
    assert isinstance(value.tree, ast.Call)
    own = replace(context, value=value)
    found = [key_of(there(key)) for key in as_list(of(value.tree.args[0], own))]
    kept = holder_of(context.world, context.me, value.tree.name).registers[value.tree.name].values
    if not all(key in kept for key in found):
        raise NothingFoundError
    return found


def holder_of(world: World, me: Entity | None, name: str) -> Any:
    """Who has a register of this name: oneself, else the world."""
    return me if me is not None and name in me.registers else world


def assign(world: World, me: Entity | None, values: list[tuple[str, Any, Any]]) -> None:
    """Sets registers of one's own, else those of the world. A given range saturates."""
    for name, key, value in values:
        if name.startswith("."):
            key.looks[name[1:]] = value
            continue
        holder = holder_of(world, me, name)
        if name in holder.ranges and value is not NOTHING:
            low, high = holder.ranges[name]
            value = min(max(value, low), high)
        if value == NO_CELL and name in holder.may_be_nothing:
            value = NOTHING
        if key is None:
            holder.registers[name] = value
        else:
            holder.registers[name].values[key] = value


def affect(world: World, target: Entity, verb: str, status: Any) -> None:
    """One effect on one entity; what does not apply to its status changes nothing."""
    if verb == "vanish":
        vanish(target)
        target.carrier = None
    elif verb == "reset":
        reset(world, target)
    elif verb == "put":
        put(world, target, where(status))
    elif verb == "move_into" and status.sort != "object":
        hand_over(world, target, status)
    elif verb == "move_into":
        target.cell, target.carrier, target.inside = None, None, status
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
        target.cell, target.carrier = cell, None


def hand_over(world: World, target: Entity, member: Entity) -> None:
    """Somebody has it in his hands, if these are empty."""
    if world.carried_by(member) is None:
        target.cell, target.carrier = None, member


def remember(entity: Entity) -> None:
    """Keeps what `reset` will bring back."""
    entity.at_reset = (entity.status, entity.cell, entity.facing, entity.inside, entity.carrier)


def reset(world: World, target: Entity) -> None:
    """As it was put down in this episode; an NPC turns back, and goes back if its place is free, or out of the room."""
    status, cell, facing, inside, carrier = target.at_reset
    if target.sort == "object":
        target.status, target.inside, target.counted = status, inside, 0
        target.carrier = None
        if carrier is not None:
            hand_over(world, target, carrier)
        for content in contents_at_reset(world, target):
            content.cell, content.carrier, content.inside = None, None, target
    else:
        target.pointing, target.facing = None, facing
        if cell is None:
            vanish(target)
            return
        if not geometry.free(world, cell, target):
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
