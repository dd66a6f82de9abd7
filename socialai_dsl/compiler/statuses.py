"""Statuses that are computed from conditions, to code."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.changes import Changes, When
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import entity_register
from socialai_dsl.program import Field, Op
from socialai_dsl.semantics.terms import Checked, Computed


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
