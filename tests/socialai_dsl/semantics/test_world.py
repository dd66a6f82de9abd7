"""Rules of the world, and what a drawn room has to be like."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Compare, Quantification, Read

LAMP = {"lamp": {"type": "switch", "place": "anywhere"}}


def test_a_rule_has_a_condition_and_effects_in_order(meaning):
    rule = {
        "id": "dusk",
        "when": "t == 3",
        "chance": 0.5,
        "once": True,
        "cause": ["lamp.reset", "doors.close"],
    }
    (plan,) = meaning(objects=LAMP, rules=[rule]).rules
    assert (plan.name, plan.site, plan.chance, plan.once) == ("dusk", "rules[dusk]", 0.5, True)
    assert isinstance(plan.when.term, Compare)
    assert plan.when.site == "rules[dusk].when"
    assert [(effect.name, len(effect.entities)) for effect in plan.causes] == [("reset", 1), ("close", 4)]
    assert [effect.site for effect in plan.causes] == ["rules[dusk].cause[0]", "rules[dusk].cause[1]"]


def test_without_an_id_it_is_called_by_its_place(meaning):
    plans = meaning(objects=LAMP, rules=[{"cause": "lamp.reset"}, {"cause": "exit.open"}]).rules
    assert [(plan.name, plan.when) for plan in plans] == [("rules[0]", None), ("rules[1]", None)]


def test_the_step_before_is_a_register(meaning):
    checked = meaning(
        objects=LAMP, rules=[{"when": "prev(lamp.pressed) and not lamp.pressed", "cause": "exit.open"}]
    )
    (remembered,) = checked.remembered
    before, _ = checked.rules[0].when.term.args
    assert before == Read(remembered.type, remembered.path)


def test_what_is_asked_twice_about_the_step_before_is_remembered_once(meaning):
    rules = [{"when": "prev(agent.x) == agent.x", "cause": "exit.open"},
             {"when": "prev(agent.x) < agent.x", "cause": "exit.close"}]  # fmt: skip
    assert len(meaning(rules=rules).remembered) == 1


def test_what_a_frame_that_nobody_plays_asks_is_not_remembered(meaning):
    frames = {"idle": {"let": {"goal": "pick(doors)"}, "steps": [{"do": "stay", "until": "prev(goal.open)"}]}}
    assert meaning(frames=frames).remembered == ()


def test_requirements_are_conditions_at_reset(meaning):
    near, seen = meaning(
        require=["agent.next_to(guide)", "any(c in cells where agent.would_see(c, left))"]
    ).require
    assert isinstance(near.term, terms.Test)
    assert (near.site, near.span.line) != (seen.site, seen.span.line)
    assert isinstance(seen.term, Quantification)
    assert (seen.term.cells, seen.term.items) == (True, ())


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ({"when": "t == 3"}, "S105 a rule of the world needs `cause`, `set` or `reward`: what it does"),
        ({"cause": "self.vanish"}, "S201 `self` is the member of the cast who follows a frame; here nobody does"),
        ({"cause": "cells.open"}, "S204 `cells` is a cell, but an object or a member of the cast is expected here"),
        ({"cause": "colors.vanish"},
         "S204 `colors` is a colour, but an object or a member of the cast is expected here"),
        ({"cause": "doors.cloze"}, "S205 unknown effect `cloze`; did you mean `close`?"),
        ({"cause": "lamp.open"}, "S204 `open` cannot happen to `lamp`: it is idle or pressed"),
        ({"when": "exitt.open", "cause": "exit.close"}, "S201 unknown name `exitt`; did you mean `exit` (let, line "),
    ],
)  # fmt: skip
def test_mistakes_in_a_rule(mistakes, rule, said):
    (found,) = mistakes(objects=LAMP, rules=[rule])
    assert found.startswith(said)


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        (
            "agent.spoke",
            "S204 `spoke` speaks of a step, but this value is computed once, before the first step",
        ),
        (
            "agent.distance(guide)",
            "S204 `agent.distance(guide)` is a number, but a condition is expected here",
        ),
    ],
)
def test_mistakes_in_a_requirement(mistakes, condition, said):
    assert mistakes(require=[condition]) == [said]
