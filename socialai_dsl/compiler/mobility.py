"""What can move, turn, leave and appear in the course of an episode."""

from __future__ import annotations

from collections.abc import Iterable

from socialai_dsl.semantics.terms import Activity, Checked, Const, Effect, RulePlan, StepPlan, Term

_STILL = ("stay", "toggle", "point", "stop_pointing")
_TURNING = ("left", "right", "face", "turn_to", "turn")


class Mobility:
    """Numbers of entities.

    Attributes:
        turning, walking: those whose direction or place can change. vanishing: those that can leave the room or come
        into it. contents: those that may lie in others. pointing: whether anybody points.
    """

    def __init__(self, checked: Checked) -> None:
        # The agent does what it likes.
        self.turning, self.walking = {0}, {0}
        self.vanishing: set[int] = set()
        self.contents: set[int] = set()
        self.pointing = False
        for number, activity in activities(checked):
            self._act(number, activity)
        for plan in plans(checked):
            for effect in plan.causes:
                self._cause(effect)
        for entity in checked.entities:
            if entity.type is not None and entity.type.rolls:
                self.walking.add(entity.number)
            if entity.type is not None and entity.type.pushed:
                self.turning.add(entity.number)
            if entity.contains:
                self.vanishing |= {entity.number, *entity.contains}
                self.contents |= set(entity.contains)
        self.walking |= self.contents

    def _act(self, number: int, activity: Activity) -> None:
        self.pointing |= activity.name == "point"
        if activity.name not in _STILL:
            self.turning.add(number)
            if activity.name not in _TURNING:
                self.walking.add(number)

    def _cause(self, effect: Effect) -> None:
        targets = {number for target in effect.entities for number in numbers_of(target)}
        if effect.name in ("vanish", "move_into", "put"):
            self.vanishing |= targets
        if effect.name in ("move_into", "put"):
            self.walking |= targets
        if effect.name == "move_into":
            self.contents |= targets


def leaving(checked: Checked) -> frozenset[int]:
    """The entities that leave the room at some time.

    Any may be out of it from the beginning, for want of a free cell, say, or as a layout has it.
    """
    return frozenset(Mobility(checked).vanishing)


def numbers_of(term: Term) -> list[int]:
    """The entities that a term may name."""
    return [term.value] if isinstance(term, Const) else list(range(term.type.low, term.type.high + 1))


def plans(checked: Checked) -> Iterable[RulePlan | StepPlan]:
    """Everything that has effects."""
    yield from checked.rules
    for frame in checked.frames:
        yield from frame.steps
        for state in frame.states:
            yield from (*state.first, *state.then)


def activities(checked: Checked) -> Iterable[tuple[int, Activity]]:
    """Who may do what."""
    for frame in checked.frames:
        for step in frame.steps:
            yield frame.entity, step.activity
        for state in frame.states:
            yield frame.entity, state.activity
            for rule in (*state.first, *state.then):
                if rule.do is not None:
                    yield frame.entity, rule.do
