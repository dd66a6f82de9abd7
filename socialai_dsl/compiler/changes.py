"""When the value of a term can change after the reset: never, with the statuses of objects, or at any time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from enum import IntEnum
from typing import assert_never

from socialai_dsl.compiler.folding import substitute
from socialai_dsl.compiler.mobility import Mobility, numbers_of, plans
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Checked, Const, Entity, Term

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
        values = (getattr(term, item.name) for item in fields(term))
        parts = (part for value in values for part in (value if isinstance(value, tuple) else (value,)))
        return max((self.of(part) for part in parts if isinstance(part, Term)), default=When.NEVER)

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
