"""Beliefs to code: what a member of the cast takes for true, at the start of each of its turns."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label
from socialai_dsl.compiler.effects import store
from socialai_dsl.compiler.expressions import Expressions


def perceive(to: Expressions, member: str) -> None:
    """Emit the beliefs of a member, in order: each that it can make out takes its value."""
    block = to.block
    for belief in to.checked.beliefs:
        if belief.member != member:
            continue
        unseen = Label()
        mark = block.taken
        if belief.when is not None:
            to.sited_condition(belief.when, unseen)
        to.failed = unseen
        value = to.sited_copy(belief.value)
        to.failed = None
        store(to.registers, block.emit, belief.path, value)
        block.bind(unseen)
        block.release(mark)
