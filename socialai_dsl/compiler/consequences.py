"""What follows by itself, to code: links between objects, statuses that follow from conditions, timers that run out."""

from __future__ import annotations

from collections.abc import Iterable

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.changes import Changes, When
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import entity_register, label
from socialai_dsl.program import Field, Op
from socialai_dsl.semantics.plans import Checked, Computed, Entity
from socialai_dsl.semantics.terms import ObjectType


def links(to: Expressions) -> None:
    """Emit everything that follows directly from the statuses of objects."""
    entities = to.checked.entities
    for entity in entities:
        _unlock(to, entity)
    for entity in entities:
        _open(to, entity, [other for other in entities if entity.number in other.opens])
    for entity in entities:
        _release(to, entity)
    for entity in entities:
        _hold_back(to, entity)


def _unlock(to: Expressions, switch: Entity) -> None:
    """While a switch is in the room and in an active status, what it unlocks is not locked."""
    targets = [to.checked.entities[number] for number in switch.unlocks]
    lockable = [target for target in targets if target.type and "locked" in target.type.states]
    if not lockable:
        return
    to.block.span = switch.span
    following = Label()
    _works(to, switch, following)
    for target in lockable:
        left_alone = Label()
        to.block.test(Op.IF_EQ, _status(target), constant(_state(target, "locked")), left_alone)
        assert target.type is not None, "internal: only objects can be locked"
        to.block.emit(Op.BECOME, constant(target.number), constant(target.type.unlocked))
        to.block.bind(left_alone)
    to.block.bind(following)


def _open(to: Expressions, door: Entity, openers: Iterable[Entity]) -> None:
    """A door is open exactly while one of what opens it is in the room and in an active status."""
    block = to.block
    opened, done = Label(), Label()
    for opener in openers:
        block.span = opener.span
        idle = Label()
        _works(to, opener, idle)
        block.skip(opened)
        block.bind(idle)
    if not opened.uses:
        return
    _become(to, door, "closed", done)
    block.skip(done)
    block.bind(opened)
    _become(to, door, "open", done)
    block.bind(done)


def _release(to: Expressions, holder: Entity) -> None:
    """What is opened while something lies in it is replaced by that."""
    if not holder.contains:
        return
    block = to.block
    block.span = holder.span
    shut = Label()
    block.test(Op.IF_EQ, _status(holder), constant(_state(holder, "opened")), shut)
    block.test(Op.IF_EQ, entity_register(holder.number, Field.GONE), constant(0), shut)
    for content in holder.contains:
        elsewhere = Label()
        block.test(Op.IF_EQ, entity_register(content, Field.INSIDE), constant(holder.number), elsewhere)
        block.test(Op.IF_EQ, entity_register(content, Field.GONE), constant(1), elsewhere)
        block.emit(Op.VANISH, constant(holder.number))
        block.emit(Op.PLACE, constant(content), constant(holder.number))
        block.bind(elsewhere)
    block.bind(shut)


def _hold_back(to: Expressions, thing: Entity) -> None:
    """While another of its group is not as it was at first, a thing reacts to nothing."""
    others = [to.checked.entities[number] for number in thing.exclusive if number != thing.number]
    if not others:
        return
    block = to.block
    block.span = thing.span
    mark = block.taken
    held = block.temporary()
    block.emit(Op.LOAD, held, constant(0))
    for other in others:
        initial = constant(other.status) if other.initial is None else to.value(other.initial)
        unchanged = Label()
        block.test(Op.IF_NE, _status(other), initial, unchanged)
        block.emit(Op.LOAD, held, constant(1))
        block.bind(unchanged)
    block.emit(Op.SET_FIELD, constant(thing.number), Field.POKED, held)
    block.release(mark)


def _works(to: Expressions, switch: Entity, otherwise: Label) -> None:
    to.one_of(Op.IF_EQ, _status(switch), _type(switch).active, otherwise)
    to.block.test(Op.IF_EQ, entity_register(switch.number, Field.GONE), constant(0), otherwise)


def _become(to: Expressions, thing: Entity, state: str, unless: Label) -> None:
    """Take a status, or go on to `unless` if it has it."""
    status = constant(_state(thing, state))
    to.block.test(Op.IF_NE, _status(thing), status, unless)
    to.block.emit(Op.BECOME, constant(thing.number), status)


def _status(thing: Entity) -> int:
    return entity_register(thing.number, Field.STATUS)


def _state(thing: Entity, name: str) -> int:
    return _type(thing).states.index(name)


def _type(thing: Entity) -> ObjectType:
    assert thing.type is not None, "internal: only objects are linked"
    return thing.type


# -- statuses that follow from conditions ----------------------------------------------------------------------


class ComputedStatuses:
    """The computed statuses of a scenario: those that a reset decides for good, and those that are settled."""

    def __init__(self, checked: Checked) -> None:
        changes = Changes(checked)
        whens = [(item, changes.of(item.condition.term)) for item in checked.computed]
        for_good = [when == When.NEVER and not changes.touched(item.entity) for item, when in whens]
        self.fixed = tuple(item for (item, _), fixed in zip(whens, for_good, strict=True) if fixed)
        self.settled = tuple(item for (item, _), fixed in zip(whens, for_good, strict=True) if not fixed)
        self.settle_always = any(when == When.ANY_TIME for _, when in whens)

    def fix(self, to: Expressions) -> None:
        """Emit those that never change, each unless a layout gives the status."""
        for item in self.fixed:
            pinned = Label()
            to.block.span = item.condition.span
            to.block.test(Op.IF_UNPINNED, entity_register(item.entity, Field.STATUS), 0, pinned)
            _settle(to, item)
            to.block.bind(pinned)

    def settle(self, to: Expressions) -> None:
        """Emit those that can change, each after those it reads."""
        for item in self.settled:
            _settle(to, item)


def _settle(to: Expressions, item: Computed) -> None:
    """On while the condition holds; off where it was on and the condition does not hold; else left alone."""
    block = to.block
    status = entity_register(item.entity, Field.STATUS)
    entity, on, off = (constant(number) for number in (item.entity, item.on, item.off))
    false, done = Label(), Label()
    to.sited_condition(item.condition, false)
    block.test(Op.IF_NE, status, on, done)
    block.emit(Op.BECOME, entity, on)
    block.skip(done)
    block.bind(false)
    block.test(Op.IF_EQ, status, on, done)
    block.emit(Op.BECOME, entity, off)
    block.bind(done)


# -- timers ----------------------------------------------------------------------------------------------------


def tick(to: Expressions) -> None:
    """Each timer counts the steps in an active status; when it is full the status expires. Else it is empty."""
    for entity in to.checked.entities:
        if entity.timer:
            _tick(to, entity)


def _tick(to: Expressions, entity: Entity) -> None:
    assert entity.type is not None, "internal: only objects have timers"
    block = to.block
    block.span = entity.span
    timer = to.registers.by_path[f"{label(entity)}.timer"]
    status = entity_register(entity.number, Field.STATUS)
    idle, done = Label(), Label()
    mark = block.taken
    to.one_of(Op.IF_EQ, status, entity.type.active, idle)
    count = to.into_temporary(Op.ADD, timer, constant(1))
    block.emit(Op.MIN, timer, count, constant(entity.timer))
    block.test(Op.IF_EQ, timer, constant(entity.timer), done)
    for before, after in sorted(entity.type.expired.items()):
        following = Label()
        block.test(Op.IF_EQ, status, constant(before), following)
        block.emit(Op.BECOME, constant(entity.number), constant(after))
        block.skip(idle)
        block.bind(following)
    block.bind(idle)
    block.emit(Op.LOAD, timer, constant(0))
    block.bind(done)
    block.release(mark)
