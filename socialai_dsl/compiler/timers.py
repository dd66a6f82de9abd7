"""What counts by itself, to code: statuses that expire."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import entity_register, label
from socialai_dsl.program import Field, Op
from socialai_dsl.semantics.terms import Entity


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
