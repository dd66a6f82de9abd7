"""Where `pick`, `first` and `nearest` find nothing: conditions are false, activities are staying, rules do not fire."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import pytest

from socialai_dsl.semantics.plans import ComputedStatus, RulePlan, StepPlan
from socialai_dsl.semantics.terms import CELL, Compare, Not, Quantification, Term
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    BOX,
    DIE,
    DOOR,
    ENTITY,
    SPAN,
    activity,
    entity,
    number,
    sited,
    start,
    state,
    step,
    with_guide,
    workbench,
)

Chooser = Literal["pick", "first", "nearest"]
NEVER = Compare("==", DIE, number(9))


def nothing(op: Chooser, cells: bool) -> Quantification:
    """One of no things, or of no cells."""
    to = entity(AGENT) if op == "nearest" else None
    if cells:
        return Quantification(CELL, op, "c", (), NEVER, to, cells=True)
    return Quantification(ENTITY, op, "e", (entity(DOOR), entity(BOX)), NEVER, to)


CHOICES = [nothing(op, cells) for op in ("pick", "first", "nearest") for cells in (False, True)]  # type: ignore[arg-type]


@pytest.mark.parametrize("choice", CHOICES)
def test_a_condition_is_false_and_so_is_its_opposite(choice: Quantification) -> None:
    for condition in (Relation("at", entity(DOOR), choice), Not(Relation("at", entity(DOOR), choice))):
        rule = RulePlan("law", "rules[0]", SPAN, when=sited(condition, "rules[0].when"))
        env = start(replace(workbench(), rules=(rule,)))
        step(env)
        assert env.counters()["rules"] == {"law": 0}


@pytest.mark.parametrize("choice", CHOICES)
def test_a_computed_status_is_off(choice: Quantification) -> None:
    condition: Term = Not(Relation("at", entity(AGENT), choice))
    locked = ComputedStatus(DOOR, 2, 1, sited(condition, "objects.door.locked"))
    assert start(replace(workbench(), computed=(locked,))).describe()["door"]["state"] == "closed"


@pytest.mark.parametrize("choice", CHOICES)
def test_an_activity_is_staying(choice: Quantification) -> None:
    for name in ("go_to", "go_next_to", "face"):
        env = start(with_guide(workbench(), state("waiting", activity(name, choice))))
        step(env)
        guide = env.describe()["guide"]
        assert (guide["at"], guide["facing"]) == ([4, 3], "left")


@pytest.mark.parametrize("choice", CHOICES)
def test_a_step_is_over_after_one_turn(choice: Quantification) -> None:
    base = workbench()
    steps = (StepPlan("only", None, activity("go_to", choice), SPAN),)
    env = start(replace(base, frames=(replace(base.frames[0], states=(), steps=steps),)))
    assert env.describe()["guide"]["state"] == "step0"
    step(env)
    assert env.describe()["guide"]["state"] == "finished"
