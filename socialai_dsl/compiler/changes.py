"""What can change in an episode: who moves, turns, leaves and appears, and with that the value of a term."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import assert_never

from socialai_dsl.compiler.folding import substitute
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import Activity, Checked, Effect, Entity, RulePlan, StepPlan
from socialai_dsl.semantics.signatures import ACTIVITIES
from socialai_dsl.semantics.terms import Const, Term
from socialai_dsl.trees import children

_LOOKING = ("faces", "faces_toward", "eye_contact")
_OVER_OBJECTS = ("looks_at", "unobstructed")


class When(IntEnum):
    """When a value can change; of several the greatest counts."""

    NEVER = 0
    STATUSES = 1  # only when the status or presence of an object does
    ANY_TIME = 2


class Changes:
    """Answers for one scenario. What it says is never too little; now and then it is too much."""

    def __init__(self, checked: Checked) -> None:
        self.entities = checked.entities
        self.occlusion = checked.room.occlusion
        self.written = {path for plan in plans(checked) for path, _ in plan.sets}
        self.changed = {
            number
            for plan in plans(checked)
            for effect in plan.causes
            for entity in effect.entities
            for number in numbers_of(entity)
        }
        self.written |= {item.path for item in checked.remembered}
        self.written |= {belief.path for belief in checked.beliefs}
        self.written |= {f"{frame.member}.{part}" for frame in checked.frames for part in ("frame", "clock")}
        mobility = Mobility(checked)
        self.vanishing, self.turning, self.walking = mobility.vanishing, mobility.turning, mobility.walking
        self.objects_move = any(checked.entities[number].role == "object" for number in self.walking)

    def touched(self, number: int) -> bool:
        """Whether something else than its own condition can change the status of an object."""
        thing = self.entities[number]
        assert thing.type is not None, "internal: only objects have a status"
        linked = any(number in (*other.unlocks, *other.opens) for other in self.entities)
        return bool(
            thing.type.toggled or thing.type.pushed or thing.timer or linked or number in self.changed
        )

    def of(self, term: Term) -> When:
        """When the value of a term can change."""
        match term:
            case Const() | terms.Here() | terms.Variable():
                return When.NEVER
            case terms.World(name="width" | "height"):
                return When.NEVER
            case terms.World() | terms.PokedNow() | terms.Said() | terms.Spoke() | terms.Heard():
                return When.ANY_TIME
            case terms.SaidBy() | terms.Speaker() | terms.HeardNoun():
                return When.ANY_TIME
            case terms.InState() | terms.Chance() | terms.Quantified(op="pick"):
                return When.ANY_TIME
            case terms.Read():
                is_memory = term.path.startswith("memory.")
                return When.ANY_TIME if is_memory or term.path in self.written else When.NEVER
            case terms.FieldOf():
                return max(self.of(term.entity), self._field(term))
            case terms.CellOf():
                return max(self.of(term.entity), self._place(term.entity))
            case terms.CellBeside():
                return max(self.of(term.entity), self.of(term.direction), self._place(term.entity))
            case terms.Measure():
                return max(*map(self.of, term.args), *map(self._place, term.args))
            case terms.Sees():
                return self._sees(term)
            case terms.Test():
                return self._test(term)
            case terms.Quantified(cells=False):
                return self._items(term)
            case terms.Quantified() if term.to is not None:
                return max(self._parts(term), self._place(term.to))
            case terms.Operation() | terms.Compare() | terms.Logic() | terms.Not() | terms.Select():
                return self._parts(term)
            case terms.Quantified():
                return self._parts(term)
            case _:
                assert_never(term)

    def _parts(self, term: Term) -> When:
        """Of a term that only combines others."""
        return max((self.of(part) for part in children(term) if isinstance(part, Term)), default=When.NEVER)

    def _items(self, term: terms.Quantified) -> When:
        conditions = [
            substitute(term.condition, term.variable, item)
            for item in term.items
            if term.condition is not None
        ]
        whens = [self.of(condition) for condition in conditions]
        if term.to is not None:
            whens += [self.of(term.to), self._place(term.to), *map(self._place, term.items)]
        return max(whens, default=When.NEVER)

    def _field(self, term: terms.FieldOf) -> When:
        if term.entity.type.kind == "cell" or term.name == "color":
            return When.NEVER
        things = self._things(term.entity)
        if term.name in ("x", "y"):
            return self._place(term.entity)
        if term.name == "gone":
            return self._presence(things)
        if term.name == "dir":
            return self._direction(term.entity)
        if term.name == "status":
            return max(When.STATUSES if thing.role == "object" else When.NEVER for thing in things)
        return When.ANY_TIME

    def _test(self, term: terms.Test) -> When:
        both = [part for part in (term.subject, term.object) if part is not None]
        when = max(*map(self.of, both), *map(self._place, both))
        if term.name == "can_reach":
            return When.ANY_TIME
        if term.name in _OVER_OBJECTS:
            when = max(when, self._line_of_sight())
        if term.subject is not None and (term.name in _LOOKING or term.name == "looks_at"):
            when = max(when, self._direction(term.subject))
        if term.name in ("eye_contact", "in_front_of"):
            when = max(when, self._direction(term.object))
        return when

    def _sees(self, term: terms.Sees) -> When:
        parts = [part for part in (term.viewer, term.target, term.facing) if part is not None]
        when = max(*map(self.of, parts), self._place(term.viewer), self._place(term.target))
        if self.occlusion:
            when = max(when, self._line_of_sight())
        return when if term.facing is not None else max(when, self._direction(term.viewer))

    def _line_of_sight(self) -> When:
        """When what stands in between can change."""
        return When.ANY_TIME if self.objects_move else When.STATUSES

    def _things(self, term: Term) -> list[Entity]:
        return [self.entities[number] for number in numbers_of(term)]

    def _place(self, term: Term) -> When:
        """When an entity can be elsewhere; a cell stays where it is."""
        if term.type.kind == "cell":
            return When.NEVER
        things = self._things(term)
        if any(thing.number in self.walking for thing in things):
            return When.ANY_TIME
        return self._presence(things)

    def _presence(self, things: Iterable[Entity]) -> When:
        gone = [thing for thing in things if thing.number in self.vanishing]
        if not gone:
            return When.NEVER
        return When.STATUSES if all(thing.role == "object" for thing in gone) else When.ANY_TIME

    def _direction(self, term: Term) -> When:
        if term.type.kind == "cell":
            return When.NEVER
        turns = any(thing.number in self.turning for thing in self._things(term))
        return When.ANY_TIME if turns else When.NEVER


# -- what moves and leaves -------------------------------------------------------------------------------------


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
        moves = ACTIVITIES[activity.name].moves
        if moves != "stays":
            self.turning.add(number)
        if moves == "walks":
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
