"""What statuses change directly in others, to code: what is unlocked, opened, released or held back by something."""

from __future__ import annotations

from collections.abc import Iterable

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import entity_register
from socialai_dsl.program import Field, Op
from socialai_dsl.semantics.terms import Entity, ObjectType


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
