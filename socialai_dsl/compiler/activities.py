"""Activities to code: one body action of the entity on turn, and when an activity is finished."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import NOWHERE, Label, entity_register, label
from socialai_dsl.compiler.expressions import Expressions, Lines
from socialai_dsl.compiler.hands import is_member
from socialai_dsl.program import MOST_CHOICES, Body, Field, Op, constant
from socialai_dsl.semantics.plans import Activity, CheckedScenario
from socialai_dsl.semantics.terms import (
    BOOL,
    CellOf,
    Const,
    FieldOf,
    Measure,
    ObjectType,
    Read,
    SitedTerm,
    Term,
)
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.vocabulary import PRIMITIVES

NOTHING = -1
"""In the register of an aim: the activity found nothing to be about."""
GETTING_THERE, ACTING, FULFILLED = 0, 1, 2
"""In the register of the aim of such an activity: what this turn was for; nothing, as all was done before it."""


def has_aim(activity: Activity) -> bool:
    """Whether what an activity is about is computed anew in each turn, so that its end must know what it was."""
    word = ACTIVITIES[activity.name]
    if word.act is not None:
        return True
    ends = word.goes is not None or activity.name == "turn_to" or activity.until is not None
    return ends and not isinstance(activity.args[0], Const)


class Activities:
    """Emits the activities of one cast member through `to`.

    Attributes:
        clock: the register of its frame's clock.
        aim: where it is noted what the activity of this turn is about (`has_aim`); None: nowhere.
    """

    def __init__(
        self,
        to: Expressions,
        checked: CheckedScenario,
        lines: Lines,
        entity: int,
        clock: int,
        aim: int | None = None,
    ) -> None:
        self.to, self.checked, self.lines, self.entity, self.clock = to, checked, lines, entity, clock
        self.aim = aim
        self._absent = Label()  # where to go if what it is about is not in the room
        self.turn = to.sites.row(f"cast.{label(checked.entities[entity])}.turn")

    def emit(self, activity: Activity, acting: bool = True) -> None:
        """Choose the body action, or unless `acting` only note what the activity of this turn is about.

        `stay` chooses none, and so does an activity whose argument finds nothing.
        """
        to, block = self.to, self.to.block
        to.site, block.span = activity.site, activity.span
        nothing, absent, done = Label(), Label(), Label()
        self._absent = absent
        to.failed = nothing
        if acting:
            self._emit(activity)
        else:
            self._note_aim(activity)
        to.failed = None
        if nothing.uses or absent.uses:
            block.skip(done)
            block.bind(nothing)
            if self.aim is not None and nothing.uses:
                block.emit(Op.LOAD, self.aim, constant(NOTHING))
            block.bind(absent)
            if acting:
                block.emit(Op.BODY, constant(Body.NONE))
            block.bind(done)

    def _note_aim(self, activity: Activity) -> None:
        to, block = self.to, self.to.block
        own, done = constant(self.entity), Label()
        if ACTIVITIES[activity.name].act is None:
            self._aim_at(activity.args[0])
            return
        if ACTIVITIES[activity.name].of_hands:
            self._use_hands(activity, acting=False)
            return
        self._note(GETTING_THERE)
        if activity.name == "use":
            goal = to.value(activity.args[0])
            block.test(Op.IF_NEXT_TO, own, goal, done)
            block.test(Op.IF_FACES, own, goal, done)
        else:
            thing, way = (to.value(arg) for arg in activity.args)
            block.test(Op.IF_SAME_CELL, own, self._behind(thing, way), done)
            block.test(Op.IF_EQ, entity_register(self.entity, Field.DIR), way, done)
        self._note(ACTING)
        block.bind(done)

    def _emit(self, activity: Activity) -> None:
        to, block = self.to, self.to.block
        own = constant(self.entity)
        match activity.name:
            case "stay":
                block.emit(Op.BODY, constant(Body.NONE))
            case name if name in PRIMITIVES:
                block.emit(Op.BODY, constant(Body[activity.name.upper()]))
            case "face":
                self._face(to.value(activity.args[0]))
            case "turn_to":
                block.emit(Op.TURN_TO, own, self._aim_at(activity.args[0]), self.turn)
            case "turn":
                self._turn(activity.args[0])
            case "go_to":
                block.emit(Op.GO_TO, own, self._aim_at(activity.args[0]), self.turn)
            case "go_next_to":
                block.emit(Op.GO_NEXT_TO, own, self._aim_at(activity.args[0]), self.turn)
            case "use":
                self._note(GETTING_THERE)
                self._use(to.value(activity.args[0]), noting=True)
            case "fetch" | "give" | "bring":
                self._use_hands(activity, acting=True)
            case "search":
                self._search(activity)
            case "enter":
                self._enter(activity)
            case "push":
                self._push(activity)
            case "point":
                where = activity.args[0]
                if isinstance(where, Measure):
                    self._present(where.args[1])
                block.emit(Op.POINT, own, self._present(where))
            case "stop_pointing":
                block.emit(Op.BODY, constant(Body.STOP_POINTING))
            case "stay_near":
                self._stay_near(activity)
            case "flee":
                away = self._turned_round(
                    to.into_temporary(Op.QUADRANT, own, self._present(activity.args[0]))
                )
                self._walk(away)
            case "perform":
                self._perform(activity)
            case "choose":
                self._choose(activity)

    def _present(self, goal: Term) -> int:
        """What the activity is about; if it is not in the room, it is an aim all the same, and nothing is done."""
        to = self.to
        entity = self._aim_at(goal)
        if goal.type.kind == "entity":
            gone = to.value(FieldOf(BOOL, goal, "gone"))
            to.block.test(Op.IF_EQ, gone, constant(0), self._absent)
        elif isinstance(goal, CellOf | Read):
            to.block.test(Op.IF_NE, entity, constant(NOWHERE), self._absent)
        return entity

    def _aim_at(self, goal: Term) -> int:
        """What the activity is about, noted if its end asks for it."""
        found = self.to.value(goal)
        if self.aim is not None:
            self.to.block.emit(Op.LOAD, self.aim, found)
        return found

    def _face(self, goal: int) -> None:
        self.to.block.emit(Op.FACE, constant(self.entity), goal, self.turn)

    def _turn(self, way: Term) -> None:
        """`turn(left)` and `turn(right)`: -1 is left, 1 is right, 0 is no turn."""
        block = self.to.block
        turn = self.to.value(way)
        done = Label()
        for value, body in ((-1, Body.LEFT), (1, Body.RIGHT)):
            with block.when(Op.IF_EQ, turn, constant(value), then=done):
                block.emit(Op.BODY, constant(body))
        block.emit(Op.BODY, constant(Body.NONE))
        block.bind(done)

    def _stay_near(self, activity: Activity) -> None:
        """Go next to the goal while it is farther away than that."""
        to, block, own = self.to, self.to.block, constant(self.entity)
        goal = self._present(activity.args[0])
        done = Label()
        distance = to.into_temporary(Op.DISTANCE, own, goal)
        with block.when(Op.IF_LT, to.value(activity.args[1]), distance, then=done):
            block.emit(Op.GO_NEXT_TO, own, goal, self.turn)
        block.emit(Op.BODY, constant(Body.NONE))
        block.bind(done)

    def _use(self, goal: int, noting: bool = False) -> None:
        """Go next to the goal, face it, toggle."""
        block = self.to.block
        own = constant(self.entity)
        done = Label()
        with block.when(Op.IF_NEXT_TO, own, goal, then=done):
            with block.when(Op.IF_FACES, own, goal, then=done):
                if noting:
                    self._note(ACTING)
                block.emit(Op.BODY, constant(Body.TOGGLE))
            self._face(goal)
        block.emit(Op.GO_NEXT_TO, own, goal, self.turn)
        block.bind(done)

    def _use_hands(self, activity: Activity, acting: bool) -> None:
        """Fetch a thing, unless it is carried already, and take it where it is to go; unless `acting` only note it."""
        to, block = self.to, self.to.block
        own = constant(1 + self.entity)
        what, *where = (to.value(arg) for arg in activity.args)
        carrier = to.into_temporary(Op.FIELD, what, Field.CARRIER)
        done = Label()
        self._note(FULFILLED)
        other = Label()
        if not where:
            block.test(Op.IF_EQ, carrier, own, other)
        elif activity.args[1].type.kind == "entity" and is_member(self.checked, activity.args[1]):
            block.test(Op.IF_EQ, carrier, to.into_temporary(Op.ADD, where[0], constant(1)), other)
        else:
            block.test(Op.IF_SAME_CELL, what, where[0], other)
        self._stand_still(acting, done)
        block.bind(other)
        self._note(GETTING_THERE)
        lacking = Label()
        if where:
            block.test(Op.IF_EQ, carrier, own, lacking)
            self._approach(where[0], Body.DROP, acting, done)
            block.bind(lacking)
        if activity.name == "give":
            self._stand_still(acting, done)
        else:
            full = Label()
            self._while_empty_handed(full)
            self._approach(what, Body.PICKUP, acting, done)
            block.bind(full)
            self._stand_still(acting, done)
        block.bind(done)

    def _stand_still(self, acting: bool, done: Label) -> None:
        if acting:
            self.to.block.emit(Op.BODY, constant(Body.NONE))
        self.to.block.skip(done)

    def _approach(self, goal: int, body: Body, acting: bool, done: Label) -> None:
        """Go next to the goal, face it, act; then on to `done`."""
        block, own = self.to.block, constant(self.entity)
        with block.when(Op.IF_NEXT_TO, own, goal, then=done):
            with block.when(Op.IF_FACES, own, goal, then=done):
                self._note(ACTING)
                if acting:
                    block.emit(Op.BODY, constant(body))
            if acting:
                self._face(goal)
        if acting:
            block.emit(Op.GO_NEXT_TO, own, goal, self.turn)
        block.skip(done)

    def _while_empty_handed(self, otherwise: Label) -> None:
        """Fall through if nothing is in its hands."""
        for entity in self.checked.entities:
            if entity.carryable:
                carrier = entity_register(entity.number, Field.CARRIER)
                self.to.block.test(Op.IF_NE, carrier, constant(1 + self.entity), otherwise)

    def _search(self, activity: Activity) -> None:
        """Stay once it sees what it looks for."""
        block = self.to.block
        unseen, done = Label(), Label()
        self._unless_seen(activity, unseen)
        block.emit(Op.BODY, constant(Body.NONE))
        block.skip(done)
        block.bind(unseen)
        block.emit(Op.EXPLORE, constant(self.entity), self.clock)
        block.bind(done)

    def _unless_seen(self, activity: Activity, otherwise: Label) -> None:
        """Fall through if it sees what it searches for; what is not found is not seen."""
        self.to.sited_condition(SitedTerm(activity.args[0], activity.site, activity.span), otherwise)

    def _enter(self, activity: Activity) -> None:
        """Use it while it cannot be walked on, then go there; a member that is there stays."""
        block = self.to.block
        entity = self._aim_at(activity.args[0])
        shut, done = Label(), Label()
        with block.when(Op.IF_SAME_CELL, constant(self.entity), entity, then=done):
            block.emit(Op.BODY, constant(Body.NONE))
        walkable = sorted(_kind_of(self.checked, activity.args[0]).walkable)
        status = block.temporary()
        block.emit(Op.FIELD, status, entity, Field.STATUS)
        found = Label()
        for number in walkable:
            block.unless(Op.IF_EQ, status, constant(number), found)
        block.skip(shut)
        block.bind(found)
        block.emit(Op.GO_TO, constant(self.entity), entity, self.turn)
        block.skip(done)
        block.bind(shut)
        self._use(entity)
        block.bind(done)

    def _push(self, activity: Activity) -> None:
        """Go behind the thing, face the way it is to go, walk into it."""
        to, block = self.to, self.to.block
        thing, way = (to.value(arg) for arg in activity.args)
        self._note(GETTING_THERE)
        behind = self._behind(thing, way)
        done = Label()
        with block.when(Op.IF_SAME_CELL, constant(self.entity), behind, then=done):
            self._walk(way, pushing=True)
        block.emit(Op.GO_TO, constant(self.entity), behind, self.turn)
        block.bind(done)

    def _behind(self, thing: int, way: int) -> int:
        """The cell from which a thing is pushed."""
        return self.to.into_temporary(Op.CELL_BESIDE, thing, self._turned_round(way))

    def _turned_round(self, way: int) -> int:
        to = self.to
        return to.into_temporary(Op.MOD, to.into_temporary(Op.ADD, way, constant(2)), constant(4))

    def _note(self, number: int) -> None:
        if self.aim is not None:
            self.to.block.emit(Op.LOAD, self.aim, constant(number))

    def _walk(self, way: int, pushing: bool = False) -> None:
        """Turn until it faces that way, then go forward."""
        block = self.to.block
        done = Label()
        with block.when(Op.IF_EQ, entity_register(self.entity, Field.DIR), way, then=done):
            if pushing:
                self._note(ACTING)
            block.emit(Op.BODY, constant(Body.FORWARD))
        block.emit(Op.TURN_TO, constant(self.entity), way, self.turn)
        block.bind(done)

    def _perform(self, activity: Activity) -> None:
        """In turn k of the state the k-th move and utterance, after the last nothing."""
        block = self.to.block
        done = Label()
        for k, (move, utterance) in enumerate(_elements(activity)):
            with block.scratch(), block.when(Op.IF_EQ, self.clock, constant(k), then=done):
                block.emit(Op.BODY, self.to.value(move))
                self.lines.perform(self.to, self.checked.entities[self.entity], utterance)
        block.emit(Op.BODY, constant(Body.NONE))
        block.bind(done)

    def _choose(self, activity: Activity) -> None:
        block = self.to.block
        weights = activity.weights or (1,) * len(activity.args)
        site = self.to.sites.row(activity.site, activity.ordinal)
        actions = [
            option.value
            for option, weight in zip(activity.args, weights, strict=True)
            if isinstance(option, Const)
            for _ in range(weight)
        ]
        if len(actions) == sum(weights) <= MOST_CHOICES:
            packed = sum(action << 4 * k for k, action in enumerate(actions))
            block.emit(Op.CHOOSE, packed, len(actions), site)
            return
        drawn = block.temporary()
        block.emit(Op.DRAW, drawn, constant(sum(weights)), site)
        done = Label()
        below = 0
        for option, weight in zip(activity.args, weights, strict=True):
            below += weight
            with block.when(Op.IF_LT, drawn, constant(below), then=done):
                block.emit(Op.BODY, self.to.value(option))
        block.bind(done)

    def unless_finished(self, activity: Activity, otherwise: Label, nothing: Label) -> None:
        """Fall through if the activity is finished, else skip; what has no end of its own lasts one step.

        If its argument finds nothing, on to `nothing`.
        """
        to, block, word = self.to, self.to.block, ACTIVITIES[activity.name]
        if activity.until is not None:
            with block.scratch():
                if self.aim is not None:
                    block.test(Op.IF_NE, self.aim, constant(NOTHING), nothing)
                to.sited_condition(SitedTerm(activity.until, activity.site, activity.span), otherwise)
            return
        if not (word.lapses or word.act or activity.name in ("turn_to", "perform")):
            return
        to.site, block.span = activity.site, activity.span
        own = constant(self.entity)
        with block.scratch():
            to.failed = nothing
            if activity.name == "perform":
                block.test(Op.IF_LE, constant(len(_elements(activity))), self.clock, otherwise)
            elif word.act is not None:
                assert self.aim is not None, "internal: the end of an act asks what was noted"
                block.test(Op.IF_NE, self.aim, constant(NOTHING), nothing)
                ended = Label()
                if word.of_hands:
                    block.unless(Op.IF_EQ, self.aim, constant(FULFILLED), ended)
                block.test(Op.IF_EQ, self.aim, constant(ACTING), otherwise)
                # A scripted agent's frame follows what the agent has really done.
                act = constant(Body[word.act.upper()])
                block.test(Op.IF_EQ, entity_register(self.entity, Field.LAST), act, otherwise)
                if activity.name == "fetch":
                    empty = Label()
                    self._while_empty_handed(empty)
                    block.skip(otherwise)
                    block.bind(empty)
                elif word.of_hands:
                    self._while_empty_handed(otherwise)
                block.bind(ended)
            elif activity.name == "search":
                self._unless_seen(activity, otherwise)
            elif activity.name == "turn_to":
                facing = entity_register(self.entity, Field.DIR)
                block.test(Op.IF_EQ, facing, self._goal(activity, nothing), otherwise)
            else:
                op = Op.IF_NEXT_TO if word.goes == "beside" else Op.IF_SAME_CELL
                block.test(op, own, self._goal(activity, nothing), otherwise)
            to.failed = None

    def _goal(self, activity: Activity, nothing: Label) -> int:
        """What the activity of this turn was about; without a note of it what it is about now."""
        to, goal = self.to, activity.args[0]
        if self.aim is None:
            return to.value(goal)
        noted = to.into_temporary(Op.LOAD, self.aim)
        # The cell of what is gone is an aim all the same, which nobody reaches.
        lowest = constant(NOWHERE if goal.type.kind == "cell" else goal.type.low)
        to.block.test(Op.IF_LE, lowest, noted, nothing)
        return to.into_temporary(Op.MAX, noted, lowest)


def _elements(activity: Activity) -> list[tuple[Term, Term]]:
    """Moves and utterances of a sequence."""
    return list(zip(activity.args[::2], activity.args[1::2], strict=True))


def _kind_of(checked: CheckedScenario, goal: Term) -> ObjectType:
    """The object type of what a term can be; the resolver lets only objects of one type be entered or pushed."""
    number = goal.value if isinstance(goal, Const) else goal.type.low
    kind = checked.entities[number].type
    assert kind is not None, "internal: only objects can be entered or pushed"
    return kind
