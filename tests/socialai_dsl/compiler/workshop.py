"""A resolved scenario full of things that can be used, for tests of what they do to each other.

The room is 9 by 7. The agent stands at (1, 3) and looks right; guide, who plays a frame, at (7, 5) looks up. Two shut
chests at (2, 3) and (4, 3), an apple at (6, 1), two levers in the wall at (1, 0) and (3, 0), a marble at (5, 5),
a generator at (1, 5) and a closed remote door in the wall at (8, 3).
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from socialai_dsl.frontend import load
from socialai_dsl.semantics.plans import CheckedScenario, Effect, Placing, RulePlan
from socialai_dsl.semantics.terms import Term
from tests.socialai_dsl.compiler.workbench import SPAN, entity, sited

SOURCE = """
scenario: workshop
horizon: 20
earshot: room
actions: [left, right, forward, toggle]
grammar: {templates: [Go <noun>], nouns: [up, down]}
room: {width: 9, height: 7}
objects:
  chests: {type: box, at: [[2, 3], [4, 3]], color: blue}
  apple: {type: apple, at: [6, 1]}
  levers: {type: lever, at: [[1, 0], [3, 0]]}
  marble: {type: marble, at: [5, 5], color: red}
  generator: {type: generator, at: [1, 5], color: red}
  gate: {type: remote_door, at: [8, 3], color: red}
cast:
  guide: {at: [7, 5], facing: up, color: red, frame: idle}
  agent: {at: [1, 3], facing: right, color: red}
frames:
  idle: {states: {waiting: {do: stay}}}
outcome:
  - success: agent.at(gate)
"""

AGENT, GUIDE, CHEST, OTHER_CHEST, APPLE, LEVER, OTHER_LEVER, MARBLE, GENERATOR, GATE = range(10)


@cache
def workshop() -> CheckedScenario:
    """The resolved scenario."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "workshop.yaml"
        file.write_text(SOURCE, encoding="utf-8")
        return load(str(file)).checked


def changed(checked: CheckedScenario, number: int, **values: Any) -> CheckedScenario:
    """The scenario with an entity that differs."""
    entities = list(checked.entities)
    entities[number] = replace(entities[number], **values)
    return replace(checked, entities=tuple(entities))


def with_content(checked: CheckedScenario, content: int, holder: int) -> CheckedScenario:
    """The scenario with one thing inside another; either chest can hold it."""
    setup = tuple(
        replace(item, at=None, inside=entity(holder))
        if isinstance(item, Placing) and item.entity == content
        else item
        for item in checked.setup
    )
    for chest in (CHEST, OTHER_CHEST):
        checked = changed(checked, chest, contains=(content,))
    return replace(checked, setup=setup)


def effect(name: Any, *targets: int, value: Term | None = None) -> Effect:
    """An effect on some things."""
    return Effect(name, tuple(map(entity, targets)), SPAN, value, "rules[0].cause")


def rule(when: Term | None, *causes: Effect, **more: Any) -> RulePlan:
    """A rule of the world."""
    return RulePlan("rule", "rules[0]", SPAN, when=sited(when) if when else None, causes=causes, **more)


def with_rules(checked: CheckedScenario, *rules: RulePlan) -> CheckedScenario:
    """The scenario with these rules of the world."""
    named = (replace(rule, name=f"rules[{k}]", site=f"rules[{k}]") for k, rule in enumerate(rules))
    return replace(checked, rules=tuple(named))
