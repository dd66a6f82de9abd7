"""The comparison with the reference has teeth: planted mistakes in what the language means are all found.

Most are planted in the resolved scenario before it is compiled (what a wrong compiler would make of it), the rest in
the reference's order of events (what a wrong engine would do).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.frontend import load
from socialai_dsl.program import FrameColumn, Header, Program
from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.plans import CheckedScenario, FramePlan, RulePlan
from tests.agreement import Disagreement, Pair, agree
from tests.quick import one_in
from tests.reference import bodies
from tests.reference.interpreter import Action, Reference, Result

SAMPLES = Path(__file__).parent / "data" / "agreement"
COUNTING = str(SAMPLES / "counting.yaml")
WALKERS = str(SAMPLES / "walkers.yaml")
PERILS = str(SAMPLES / "perils.yaml")
EPISODES = 60

Change = Callable[[CheckedScenario], CheckedScenario]


def in_frames(change: Callable[[FramePlan], FramePlan]) -> Change:
    return lambda checked: replace(checked, frames=tuple(change(frame) for frame in checked.frames))


def in_rules(change: Callable[[RulePlan], RulePlan]) -> Change:
    def frame(plan: FramePlan) -> FramePlan:
        states = tuple(
            replace(s, first=tuple(map(change, s.first)), then=tuple(map(change, s.then)))
            for s in plan.states
        )
        return replace(plan, states=states)

    return in_frames(frame)


def in_setup(change: Callable[[Any], Any]) -> Change:
    return lambda checked: replace(checked, setup=tuple(change(item) for item in checked.setup))


def last_rule_wins(plan: FramePlan) -> FramePlan:
    return replace(plan, states=tuple(replace(s, then=s.then[::-1]) for s in plan.states))


def any_place(item: Any) -> Any:
    return replace(item, where=None) if isinstance(item, plans.Placing) else item


def any_color(item: Any) -> Any:
    return replace(item, distinct_from=()) if isinstance(item, plans.Coloring) else item


def liar_may_be_right(rule: RulePlan) -> RulePlan:
    def open_up(part: Any) -> Any:
        if isinstance(part, terms.FieldOf) and isinstance(part.entity, terms.Quantification):
            return replace(part, entity=replace(part.entity, condition=None))
        return part

    return (
        replace(rule, say=replace(rule.say, parts=tuple(map(open_up, rule.say.parts)))) if rule.say else rule
    )


def no_time_for_goto_now(rule: RulePlan) -> RulePlan:
    return replace(rule, goto=rule.goto_now, goto_now=None) if rule.goto_now else rule


def everything_is_success(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, outcomes=checked.outcomes[::-1])


def farther(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, entities=tuple(replace(e, near=e.near, far=e.far + 1) for e in checked.entities))


PLANTED: dict[str, tuple[str, Change]] = {
    "`after` off by one": (
        COUNTING,
        in_rules(lambda rule: replace(rule, after=rule.after + 1 if rule.after else 0)),
    ),
    "`once` ignored": (COUNTING, in_rules(lambda rule: replace(rule, once=False))),
    "the last rule that holds fires": (COUNTING, in_frames(last_rule_wins)),
    "goto_now waits a turn": (COUNTING, in_rules(no_time_for_goto_now)),
    "a rule of `first` does not take the whole turn": (
        COUNTING,
        in_rules(lambda rule: replace(rule, do=None)),
    ),
    "sets are lost": (COUNTING, in_rules(lambda rule: replace(rule, sets=()))),
    "sets see each other": (COUNTING, in_rules(lambda rule: replace(rule, sets=rule.sets[::-1][:1]))),
    "chance is certain": (COUNTING, in_rules(lambda rule: replace(rule, chance=None))),
    "voices carry one cell too far": ("talkitout+oracle", farther),
    "the liar may name the right door": ("talkitout+oracle", in_rules(liar_may_be_right)),
    "NPCs may block doors": ("talkitout+oracle", in_setup(any_place)),
    "two doors may share a colour": ("talkitout", in_setup(any_color)),
    "the outcome list is read from below": ("talkitout+oracle", everything_is_success),
    "the picture is taken before the NPCs act": (
        WALKERS,
        lambda checked: replace(checked, picture_before_npcs=not checked.picture_before_npcs),
    ),
    "effects are lost": (
        WALKERS,
        in_frames(lambda plan: replace(plan, steps=tuple(replace(s, causes=()) for s in plan.steps))),
    ),
    "steps last one turn": (
        WALKERS,
        in_frames(lambda plan: replace(plan, steps=tuple(replace(s, duration=1) for s in plan.steps))),
    ),
    "hidden NPCs who are always audible are silent": (
        "talkitout_no_liar+as_coded+unsocial",
        lambda checked: replace(checked, entities=tuple(replace(e, audible=False) for e in checked.entities)),
    ),
    "the agent does not hear itself": (PERILS, lambda checked: replace(checked, own_voice=False)),
}


@pytest.mark.parametrize("bug", one_in(8, PLANTED, "plays on the slow interpreter"))
def test_a_wrong_compiler_is_found_out(bug: str) -> None:
    name, change = PLANTED[bug]
    checked = load(name).checked
    wrong = change(checked)
    assert wrong != checked, "nothing was planted"
    with pytest.raises(Disagreement):
        agree(name, EPISODES, seed=5, program=compile_scenario(wrong))


def npcs_in_reverse(program: Program) -> Program:
    """The rows of the frame table in reverse: NPCs act in the wrong order."""
    words = program.words.copy()
    start, rows = program.header(Header.FRAME_AT), program.header(Header.FRAMES)
    table = words[start : start + rows * FrameColumn.COLUMNS].reshape(rows, FrameColumn.COLUMNS)
    table[:] = table[::-1].copy()
    return replace(program, words=words)


def test_the_order_of_npcs_matters() -> None:
    program = compile_scenario(load(COUNTING).checked)
    with pytest.raises(Disagreement):
        agree(COUNTING, EPISODES, seed=5, program=npcs_in_reverse(program))


class SpeaksBeforeMoving(Reference):
    """Delivers the agent's utterance from where it stood before its body action."""

    def step(self, action: Action) -> Result:
        early = [(npc, npc.cell) for npc in self.world.npcs]
        assert early, "this needs NPCs"
        utter, primitive = self.utter, self.primitive
        self.utter = lambda _: None  # type: ignore[method-assign]

        def speak_then_move(chosen: Action) -> str:
            utter(chosen)
            return primitive(chosen)

        self.primitive = speak_then_move  # type: ignore[method-assign]
        try:
            return super().step(action)
        finally:
            self.utter, self.primitive = utter, primitive  # type: ignore[method-assign]


class PaysForTheStepBefore(Reference):
    """Computes the reward with t before the step."""

    def judge(self) -> Result:
        self.world.t -= 1
        result = super().judge()
        self.world.t += 1
        return result


def play_all(pair: Pair) -> None:
    rng = np.random.default_rng(5)
    for episode in range(EPISODES):
        pair.play(5, episode, rng)


@pytest.mark.parametrize(
    ("wrong", "name"), [(SpeaksBeforeMoving, COUNTING), (PaysForTheStepBefore, "talkitout+oracle")]
)
def test_a_wrong_order_of_events_is_found_out(wrong: type[Reference], name: str) -> None:
    loaded = load(name)
    pair = Pair.of(loaded)
    pair.reference = wrong(loaded.scenario)
    with pytest.raises(Disagreement):
        play_all(pair)


def test_a_wrong_choice_among_equal_paths_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bodies, "SEARCH_ORDER", bodies.SEARCH_ORDER[::-1])
    with pytest.raises(Disagreement):
        agree(WALKERS, EPISODES, seed=5)
