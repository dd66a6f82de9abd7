"""Who moves, turns, leaves and appears in an episode, and which statuses objects can have."""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl.semantics import plans
from socialai_dsl.semantics.plans import Activity, CheckedScenario, Effect
from socialai_dsl.semantics.terms import Const, ObjectType, numbers_of, walk
from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS


class Mobility:
    """Numbers of entities.

    Attributes:
        turning, walking: those whose direction or place can change. vanishing: those that can leave the room or come
        into it. contents: those that may lie in others. carried: those that can be carried. pointing:
        whether anybody points.
    """

    def __init__(self, checked: CheckedScenario) -> None:
        # Players do what they like, and where there are several one may die while the others go on.
        players = {0, *checked.seated}
        self.turning, self.walking = set(players), set(players)
        self.vanishing: set[int] = set(players) if len(players) > 1 else set()
        self.contents: set[int] = set()
        self.carried: set[int] = set()
        self.pointing = False
        for frame in checked.frames:
            for activity in frame.activities:
                self._act(frame.entity, activity)
        for plan in checked.causing:
            for effect in plan.causes:
                self._cause(effect)
        for entity in checked.entities:
            if entity.type is not None and entity.type.rolls:
                self.walking.add(entity.number)
            if entity.type is not None and entity.type.pushed:
                self.turning.add(entity.number)
            if entity.pushed_by_bodies:
                self.walking.add(entity.number)
            if entity.carryable:
                self.carried.add(entity.number)
            if entity.contains:
                self.vanishing |= {entity.number, *entity.contains}
                self.contents |= set(entity.contains)
        self.walking |= self.contents | self.carried
        self.vanishing |= self.carried

    def _act(self, number: int, activity: Activity) -> None:
        self.pointing |= ACTIVITIES[activity.name].arm == "points"
        moves = ACTIVITIES[activity.name].moves
        if moves != "stays":
            self.turning.add(number)
        if moves == "walks":
            self.walking.add(number)

    def _cause(self, effect: Effect) -> None:
        targets = {number for target in effect.entities for number in numbers_of(target)}
        if EFFECTS[effect.name].takes_away:
            self.vanishing |= targets
        if EFFECTS[effect.name].carries_off:
            self.walking |= targets
        if effect.name == "move_into":
            self.contents |= targets


class Statuses:
    """The statuses that each object can ever have: at first, by being toggled or pushed, by links and effects."""

    def __init__(self, checked: CheckedScenario) -> None:
        self._checked = checked
        self._opened = {number for entity in checked.entities for number in entity.opens}
        self._unlocked = {number for entity in checked.entities for number in entity.unlocks}
        self._computed: dict[int, set[int]] = {}
        for one in checked.computed:
            self._computed.setdefault(one.entity, set()).update((one.on, one.off))
        self._effects: dict[int, list[Effect]] = {}
        for effect in (effect for plan in checked.causing for effect in plan.causes):
            for entity in effect.entities:
                for number in entity.type.values:
                    self._effects.setdefault(number, []).append(effect)
        self._known: dict[int, frozenset[int]] = {}

    def of(self, number: int, size: int) -> frozenset[int]:
        """Statuses of an entity; all, as many as `size`, for what is no object."""
        if number not in self._known:
            type_ = self._checked.entities[number].type
            self._known[number] = frozenset(range(size)) if type_ is None else self._reached(number, type_)
        return self._known[number]

    def _reached(self, number: int, type_: ObjectType) -> frozenset[int]:
        every = frozenset(range(len(type_.states)))
        if number in self._opened:
            return every
        found = {*self._initial(number, type_), *self._computed.get(number, ())}
        if number in self._unlocked:
            found.add(type_.unlocked)
        for effect in self._effects.get(number, ()):
            gives = self._given(effect, type_)
            if gives is None:
                return every
            found |= gives
        waiting = list(found)
        while waiting:
            status = waiting.pop()
            for following in (type_.toggled, type_.pushed, type_.expired):
                if status in following and following[status] not in found:
                    found.add(following[status])
                    waiting.append(following[status])
            if status in type_.rolls and type_.initial not in found:
                found.add(type_.initial)
                waiting.append(type_.initial)
        return frozenset(found)

    def _initial(self, number: int, type_: ObjectType) -> Iterator[int]:
        entity = self._checked.entities[number]
        if entity.initial is None:
            yield entity.status
            return
        path = entity.initial.path
        drawn = (item for item in self._checked.setup if isinstance(item, plans.Drawn) and item.path == path)
        for item in drawn:
            yield from (part.value for part in walk(item.value.term) if isinstance(part, Const)
                        and part.type.kind == "status")  # fmt: skip
        yield type_.initial

    def _given(self, effect: Effect, type_: ObjectType) -> set[int] | None:
        """Statuses that an effect leads to; None for any."""
        word = EFFECTS[effect.name]
        if word.makes is not None:
            return {type_.states.index(word.makes)}
        if word.needs is not None:
            return {type_.unlocked}
        if not word.sets_status:
            return set()
        if isinstance(effect.value, Const):
            return {effect.value.value}
        return None
