"""The rules of the world: all that hold run, top to bottom."""

from __future__ import annotations

from tests.reference import chance
from tests.reference.effects import affect, assign, assignments, causes
from tests.reference.evaluate import Context, NothingFoundError, holds
from tests.reference.script import Rule, Script
from tests.reference.source import Sources
from tests.reference.world import World


def run(scenario: Script, sources: Sources, world: World) -> None:
    """Each rule sees what those above it did."""
    for number, rule in enumerate(scenario.rules):
        path = f"rules[{rule.id or number}]"
        if not (rule.once and path in world.fired_once):
            apply(rule, path, sources, world)


def apply(rule: Rule, path: str, sources: Sources, world: World) -> None:
    """One rule: it computes first, then acts; one whose values cannot be found does nothing."""
    context = Context(world)
    try:
        if rule.when is not None and not holds(sources.expression(f"{path}.when", rule.when), context):
            return
        registers = assignments(sources, rule, path, context, None)
        effects = causes(sources, rule, path, context, None)
    except NothingFoundError:
        return
    if rule.chance is not None and not chance.happens(world.key, f"{path}.chance", world.t, rule.chance):
        return
    if rule.once:
        world.fired_once.add(path)
    assign(world, None, registers)
    for verb, targets, status in effects:
        for target in targets:
            affect(world, target, verb, status)
    for seat in world.seats:
        per_cent = rule.reward
        if isinstance(per_cent, dict):
            name = sources.scenario.named(seat.key, per_cent)
            per_cent = 0 if name is None else per_cent[name]
        seat.bonus += per_cent
