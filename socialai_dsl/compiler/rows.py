"""Registers that there are for each of a group: one behind the other, that of a key found by adding to a number."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, Registers
from socialai_dsl.compiler.cells import Emitter, in_a_row
from socialai_dsl.program import Op, constant
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Term


def row_of(registers: Registers, term: terms.ReadEach) -> tuple[int, int, int]:
    """How the registers that there are for each of a group are numbered: a register, and the least and the greatest
    number to be added to it. That is the key itself, or the place of the key among all.
    """
    first, keys = registers.by_path[term.registers[0].path], term.keys
    if in_a_row(keys) and 0 <= keys[0] <= first:
        return first - keys[0], keys[0], keys[-1]
    return first, 0, len(keys) - 1


def _is_within_its_type(term: Term) -> bool:
    """Whether a value is proven to lie within its type, so that nothing has to see to it."""
    match term:
        case (
            terms.Read()
            | terms.ReadEach()
            | terms.Speaker()
            | terms.HeardNoun(digit=None)
            | terms.FieldOf(name="color")
        ):
            return True
        case terms.World(name="noun", digit=None):
            return True
    return False


def row(to: Emitter, term: terms.ReadEach) -> tuple[int, int]:
    """A register, and an operand to be added to its number, for that of a key; see `row_of`.

    A key that is not among them fails, or else is as good as the first.
    """
    first, low, _ = row_of(to.registers, term)
    key = to.value(term.key)
    fails = to.failed if term.may_miss else None
    if not in_a_row(term.keys) or (term.may_miss and fails is None):
        place = _place_among(to, term.keys, key, fails)
        return first, place if low == 0 else to.into_temporary(Op.ADD, place, constant(low))
    if fails is not None:
        to.block.test(Op.IF_LE, constant(term.keys[0]), key, fails)
        to.block.test(Op.IF_LE, key, constant(term.keys[-1]), fails)
    if fails is not None or not _is_within_its_type(term.key):
        key = to.into_temporary(Op.MAX, key, constant(term.keys[0]))
        key = to.into_temporary(Op.MIN, key, constant(term.keys[-1]))
    shift = term.keys[0] - low
    return first, key if shift == 0 else to.into_temporary(Op.SUB, key, constant(shift))


def _place_among(to: Emitter, keys: tuple[int, ...], key: int, otherwise: Label | None) -> int:
    """The place of a key among all, from 0; what is none of them goes on to `otherwise`, or is the first."""
    block = to.block
    place = to.into_temporary(Op.LOAD, constant(0 if otherwise is None else -1))
    for i, each in enumerate(keys):
        with block.when(Op.IF_EQ, key, constant(each)):
            block.emit(Op.LOAD, place, constant(i))
    if otherwise is not None:
        block.test(Op.IF_LE, constant(0), place, otherwise)
        block.emit(Op.MAX, place, place, constant(0))
    return place
