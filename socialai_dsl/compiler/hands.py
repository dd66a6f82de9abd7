"""Code that puts things into the hands of members of the cast, and takes them out again."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, entity_register
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.program import Field, Op, constant
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.terms import Term, numbers_of


def members(checked: CheckedScenario) -> int:
    """How many members the cast has; their entities come first."""
    return sum(entity.role != "object" for entity in checked.entities)


def is_member(checked: CheckedScenario, term: Term) -> bool:
    """Whether a term stands for members of the cast."""
    return term.type.high < members(checked)


def into_hands(to: Expressions, thing: int, who: int) -> None:
    """A thing leaves the room for the hands of a member of the cast; nothing happens if these are full."""
    block = to.block
    full = Label()
    with block.scratch():
        carrier = to.into_temporary(Op.ADD, who, constant(1))
        for entity in to.checked.entities:
            if entity.carryable:
                block.test(Op.IF_NE, entity_register(entity.number, Field.CARRIER), carrier, full)
        block.emit(Op.VANISH, thing)
        block.emit(Op.SET_FIELD, thing, Field.CARRIER, carrier)
        block.bind(full)


def back_into_hands(to: Expressions, number: int, carrier: int) -> None:
    """A thing is in nobody's hands any more, or again in those that register `carrier` names, if these are empty."""
    to.block.emit(Op.SET_FIELD, constant(number), Field.CARRIER, constant(0))
    with to.block.when(Op.IF_NE, carrier, constant(0)), to.block.scratch():
        least = to.into_temporary(Op.MIN, carrier, constant(members(to.checked)))
        who = to.into_temporary(Op.SUB, least, constant(1))
        into_hands(to, constant(number), to.into_temporary(Op.MAX, who, constant(0)))


def out_of_hands(to: Expressions, term: Term, entity: int) -> None:
    """A thing is in nobody's hands any more; `term` may stand for a member of the cast as well."""
    block = to.block
    things = [to.checked.entities[number] for number in numbers_of(term)]
    if not any(thing.carryable for thing in things):
        return
    nobody = Label()
    if not all(thing.role == "object" for thing in things):
        block.test(Op.IF_LE, constant(members(to.checked)), entity, nobody)
    block.emit(Op.SET_FIELD, entity, Field.CARRIER, constant(0))
    block.bind(nobody)


def move_into(to: Expressions, term: Term, thing: int, holder: Term, into: int) -> None:
    """A thing, `term`, lies in an object from now on, or is in a member's hands if these are empty."""
    if is_member(to.checked, holder):
        into_hands(to, thing, into)
        return
    out_of_hands(to, term, thing)
    to.block.emit(Op.PLACE, thing, into)
    to.block.emit(Op.VANISH, thing)
    to.block.emit(Op.SET_FIELD, thing, Field.INSIDE, into)
