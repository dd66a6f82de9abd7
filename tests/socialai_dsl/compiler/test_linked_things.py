"""Things that open others, expire, hold each other back, are pushed and roll."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl.compiler.folding import ChangeAnalysis, When
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.program import EntityColumn, Flag, Header, Program, TypeColumn
from socialai_dsl.semantics.plans import CheckedScenario, ComputedStatus, StepPlan
from socialai_dsl.semantics.terms import BOOL, DIRECTION, Compare, Const, FieldOf, Sees, Type, World
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    activity,
    cell,
    code,
    compiled,
    entity,
    listed,
    number,
    sited,
    start,
    state,
    step,
    with_guide,
)
from tests.socialai_dsl.compiler.workshop import (
    AGENT,
    APPLE,
    CHEST,
    GATE,
    GENERATOR,
    GUIDE,
    LEVER,
    MARBLE,
    OTHER_LEVER,
    changed,
    effect,
    rule,
    with_rules,
    workshop,
)

NEXT_TO_OTHER_LEVER = {"agent": {"at": [3, 1], "facing": "up"}}
NOW = World(Type("int", 0, 20), "t")


def gate(env: ScenarioEnv) -> str:
    return str(env.describe()["gate"]["state"])


# --- opens ---


def test_links_do_nothing_where_nothing_has_to_change() -> None:
    """Else every status would count as changed in every step."""
    listing = listed(compiled(changed(workshop(), LEVER, opens=(GATE,))), "links")
    becomes = [k for k, line in enumerate(listing) if "BECOME" in line]
    assert len(becomes) == 2
    assert all("IF_NE" in listing[k - 1] for k in becomes)


# --- timers ---


def test_without_timers_nothing_ticks() -> None:
    program = compiled(workshop())
    assert program.header(Header.TICK_PC) == 0
    assert compiled(changed(workshop(), LEVER, timer=2)).header(Header.TICK_PC) > 0


# --- exclusive ---


def test_who_is_held_back_is_free_again_once_the_other_is_back() -> None:
    group = (LEVER, OTHER_LEVER)
    both = changed(changed(workshop(), LEVER, exclusive=group), OTHER_LEVER, exclusive=group)
    checked = with_rules(both, rule(Compare("==", NOW, number(2)), effect("reset", LEVER)))
    env = start(checked, {**NEXT_TO_OTHER_LEVER, "levers": [{"state": "up"}, {}]})
    for expected in ("down", "down", "up"):
        step(env, "toggle")
        assert env.describe()["levers"][1]["state"] == expected
    assert code(compiled(both), "links").count("SET_FIELD") == 2


# --- pushing and rolling ---


def row_of(program: Program, number: int, status: int) -> dict[str, int]:
    h, words = program.header, program.words
    first = int(words[h(Header.ENTITY_AT) + EntityColumn.COLUMNS * number + EntityColumn.TYPE])
    at = h(Header.TYPE_AT) + TypeColumn.COLUMNS * (first + status)
    return {"pushed": int(words[at + TypeColumn.PUSHED]), "rolls": int(words[at + TypeColumn.ROLLS])}


def test_types_say_what_a_push_does() -> None:
    program = compiled(workshop())
    assert row_of(program, MARBLE, 0) == {"pushed": 1, "rolls": 0}
    assert row_of(program, MARBLE, 1) == {"pushed": 1, "rolls": 1}
    assert row_of(program, CHEST, 1) == {"pushed": 1, "rolls": 0}
    assert program.header(Header.FLAGS) & Flag.ROLLS
    by_rolling = compiled(changed(workshop(), GENERATOR, pushed_by_rolling=True))
    at = by_rolling.header(Header.ENTITY_AT) + EntityColumn.PUSHED_BY
    pushed_by = [
        int(by_rolling.words[at + EntityColumn.COLUMNS * n]) for n in range(len(by_rolling.entities))
    ]
    assert pushed_by == [int(n == GENERATOR) for n in range(len(by_rolling.entities))]


def push(layout: dict[str, Any], steps: int) -> list[dict[str, Any]]:
    """The guide pushes the marble to the left, then stays where it is."""
    pushing = activity("push", entity(MARBLE), Const(DIRECTION, 2))
    (frame,) = workshop().frames
    plans = (
        StepPlan("idle.steps[0]", None, pushing, frame.span),
        StepPlan("idle.steps[1]", "resting", activity("stay"), frame.span, duration=-1),
    )
    checked = replace(workshop(), frames=(replace(frame, states=(), steps=plans, start=""),))
    env = start(checked, layout)
    seen = []
    for _ in range(steps):
        step(env)
        seen.append(env.describe())
    return seen


def test_an_npc_goes_behind_a_thing_and_pushes_it() -> None:
    seen = push({"guide": {"at": [7, 5], "facing": "left"}}, 4)
    # One step leads behind it, facing it: that is no push yet.
    assert [moment["guide"]["at"] for moment in seen[:3]] == [[6, 5]] * 3
    assert [moment["guide"]["state"] for moment in seen] == ["step0", "resting", "resting", "resting"]
    assert [moment["marble"]["at"] for moment in seen] == [[5, 5], [5, 5], [4, 5], [3, 5]]


def test_it_turns_where_it_stands_wrong() -> None:
    seen = push({"guide": {"at": [6, 5], "facing": "up"}}, 3)
    assert seen[0]["guide"]["facing"] == "left"
    assert seen[1]["marble"]["state"] == "rolling"
    assert seen[2]["marble"]["at"] == [4, 5]


def test_it_goes_round_to_the_other_side() -> None:
    seen = push({"guide": {"at": [4, 5], "facing": "up"}}, 12)
    assert seen[-1]["marble"]["at"] != [5, 5]
    assert seen[-1]["guide"]["at"] == [6, 5]


def test_fleeing() -> None:
    env = start(
        with_guide(workshop(), state("away", activity("flee", entity(AGENT)))), {"guide": {"at": [4, 2]}}
    )
    places = []
    for _ in range(4):
        step(env)
        places.append(env.describe()["guide"]["at"])
    assert places == [[4, 2], [5, 2], [6, 2], [7, 2]]


# --- when conditions can change ---


def times(checked: CheckedScenario, *terms: Any) -> list[When]:
    changes = ChangeAnalysis(checked)
    return [changes.of(term) for term in terms]


def test_what_can_move_is_looked_at_again() -> None:
    marble, apple = FieldOf(NOW.type, entity(MARBLE), "x"), FieldOf(NOW.type, entity(APPLE), "x")
    assert times(workshop(), marble, apple) == [When.ANY_TIME, When.NEVER]
    put = with_rules(workshop(), rule(None, effect("put", APPLE, value=cell(1, 1))))
    assert times(put, apple) == [When.ANY_TIME]


def test_what_lies_in_something_can_appear() -> None:
    gone = FieldOf(BOOL, entity(APPLE), "gone")
    inside = changed(workshop(), CHEST, contains=(APPLE,))
    assert times(workshop(), gone) == [When.NEVER]
    assert times(inside, gone) == [When.MARKED]


def test_a_line_of_sight_depends_on_what_moves_through_it() -> None:
    free = Relation("unobstructed", entity(LEVER), cell(1, 5))
    assert times(workshop(), free) == [When.ANY_TIME]
    still = changed(workshop(), MARBLE, type=workshop().entities[APPLE].type)
    assert times(still, free) == [When.MARKED]


def test_views_depend_on_statuses_where_things_hide_others() -> None:
    still = changed(workshop(), MARBLE, type=workshop().entities[APPLE].type)
    seen = Sees(entity(GUIDE), entity(APPLE), Const(DIRECTION, 1))
    hidden = replace(still, room=replace(still.room, occlusion=True))
    assert times(still, seen) == [When.NEVER]
    assert times(hidden, seen) == [When.MARKED]
    assert compiled(hidden).header(Header.FLAGS) & Flag.OCCLUSION


def test_a_computed_status_follows_a_marble() -> None:
    """Rolling changes a place, not a status: the gate is settled all the same."""
    there = Relation("at", entity(MARBLE), cell(3, 5))
    checked = replace(workshop(), computed=(ComputedStatus(GATE, 0, 1, sited(there)),))
    env = start(checked, {"agent": {"at": [6, 5], "facing": "left"}})
    seen = []
    for word in ("forward", "none", "none"):
        step(env, word)
        seen.append(gate(env))
    assert seen == ["closed", "open", "closed"]
