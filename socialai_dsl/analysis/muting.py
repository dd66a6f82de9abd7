"""Programs in which some members of the cast are silent, still and without a face, and nothing else differs."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from socialai_dsl.analysis.rooms import name_of
from socialai_dsl.semantics.plans import Activity, CheckedScenario, FramePlan, RulePlan, StatePlan, StepPlan


def muted(checked: CheckedScenario, members: Collection[str]) -> CheckedScenario:
    """The scenario without anything these members do, say, cause or show.

    They stand where they would stand at the start. Their frames go on through their states and keep their registers and
    looks, which others may ask about, but nobody sees or hears anything of it.
    """
    frames = tuple(_silent(frame) if frame.member in members else frame for frame in checked.frames)
    silenced = {
        one.number
        for one in checked.entities
        if one.role == "npc" and name_of(checked, one.number) in members
    }
    looks = tuple(
        replace(look, registers=tuple(one for one in look.registers if one[0] not in silenced))
        for look in checked.looks
    )
    return replace(checked, frames=frames, looks=looks)


def _silent(frame: FramePlan) -> FramePlan:
    return replace(
        frame,
        states=tuple(_state(state) for state in frame.states),
        steps=tuple(_step(step) for step in frame.steps),
    )


def _state(state: StatePlan) -> StatePlan:
    return replace(
        state,
        first=tuple(_rule(rule) for rule in state.first),
        activity=_still(state.activity),
        then=tuple(_rule(rule) for rule in state.then),
    )


def _rule(rule: RulePlan) -> RulePlan:
    doing = None if rule.do is None else _still(rule.do)
    return replace(rule, do=doing, causes=(), say=None)


def _step(step: StepPlan) -> StepPlan:
    return replace(step, activity=_still(step.activity), causes=(), say=None)


def _still(activity: Activity) -> Activity:
    return Activity("stay", (), activity.site, activity.span)
