"""Choices among things to code: one condition after the other, collected in a set of bits."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.emitter import Emitter
from socialai_dsl.program import Op, Register
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Const

_SET = 32
"""How many things a set of bits can tell apart."""

_LAST_SITE = 65535
_LAST_OTHER = 255
_MOST_OTHERS = 127
"""What `Op.DRAW_OTHER` has room for."""

_LAST_NEAREST = 255
"""What `Op.NEAREST` has room for."""


def count_things(to: Emitter, term: terms.Quantified) -> int:
    """A temporary with the number of things that the condition holds for."""
    if len(term.items) > _SET:
        return _count_one_by_one(to, term)
    return to.into_temporary(Op.COUNT_BITS, _mask(to, term))


def first_thing(to: Emitter, term: terms.Quantified) -> int:
    """The operand of the first thing that the condition holds for."""
    if len(term.items) > _SET:
        return _nth(to, term, to.into_temporary(Op.LOAD, constant(0)))
    return _chosen(to, term, Op.LOWEST_BIT)


def _mask(to: Emitter, term: terms.Quantified) -> int:
    """A temporary whose bit i says whether item i holds."""
    mask = to.block.temporary()
    to.block.emit(Op.LOAD, mask, constant(0))
    for i, item in enumerate(term.items):
        following = Label()
        to.condition(to.instance(term, item), following)
        to.block.emit(Op.SET_BIT, mask, constant(i))
        to.block.bind(following)
    return mask


def picked_thing(to: Emitter, term: terms.Quantified) -> int:
    """The operand of a drawn thing among those that the condition holds for."""
    site = to.sites.row(term.site or to.site, term.ordinal)
    if (other := _but_one(term)) is not None:
        return _any_other(to, term, other, site)
    if term.condition is not None and len(term.items) > _SET:
        choices = to.into_temporary(Op.MAX, _count_one_by_one(to, term), constant(1))
        return _nth(to, term, to.into_temporary(Op.DRAW, choices, site))
    if term.condition is not None:
        return _chosen(to, term, Op.PICK_BIT, site)
    return _item(to, term.items, to.into_temporary(Op.DRAW, constant(len(term.items)), site))


def _but_one(term: terms.Quantified) -> terms.Term | None:
    """The one of its things that `pick(x in group where x != one)` leaves out, if that is what the term is."""
    match term.condition:
        case terms.Compare(
            "!=",
            terms.Variable(name=name),
            (terms.Const() | terms.Read() | terms.FieldOf(entity=Const())) as one,
        ):
            first, last = term.items[0].value, term.items[-1].value
            in_a_row = [item.value for item in term.items] == list(range(first, last + 1))
            among = first <= one.type.low and one.type.high <= last
            fits = first >= 0 and last <= _LAST_OTHER and 1 < len(term.items) <= _MOST_OTHERS
            if name == term.variable and in_a_row and among and fits:
                return one
    return None


def _any_other(to: Emitter, term: terms.Quantified, one: terms.Term, site: int) -> int:
    """One of all of them less the one, without asking of each whether it is that."""
    assert site <= _LAST_SITE, "internal: more draw sites than an instruction can name"
    packed = site | term.items[0].value << 16 | len(term.items) << 24
    return to.into_temporary(Op.DRAW_OTHER, to.value(one), packed)


def _chosen(to: Emitter, term: terms.Quantified, op: Op, site: int = 0) -> int:
    mask = _mask(to, term)
    if to.failed is not None:
        to.block.test(Op.IF_NE, mask, constant(0), to.failed)
    return _item(to, term.items, to.into_temporary(op, mask, site))


def _count_one_by_one(to: Emitter, term: terms.Quantified) -> int:
    total = to.into_temporary(Op.LOAD, constant(0))
    for item in term.items:
        following = Label()
        to.condition(to.instance(term, item), following)
        to.block.emit(Op.ADD, total, total, constant(1))
        to.block.bind(following)
    return total


def _nth(to: Emitter, term: terms.Quantified, left: int) -> int:
    """The thing that comes after `left` others that the condition holds for as well; none: as for small groups."""
    block = to.block
    result = to.into_temporary(Op.LOAD, constant(term.items[0].value))
    done = Label()
    for item in term.items:
        following, found = Label(), Label()
        to.condition(to.instance(term, item), following)
        block.test(Op.IF_NE, left, constant(0), found)
        block.emit(Op.SUB, left, left, constant(1))
        block.skip(following)
        block.bind(found)
        block.emit(Op.LOAD, result, constant(item.value))
        block.skip(done)
        block.bind(following)
    if to.failed is not None:
        block.skip(to.failed)
    block.bind(done)
    return result


def _item(to: Emitter, items: tuple[Const, ...], position: int) -> int:
    """The item at a position that is in a temporary."""
    values = [item.value for item in items]
    if values == list(range(values[0], values[0] + len(values))):
        return to.into_temporary(Op.ADD, position, constant(values[0])) if values[0] else position
    result = to.into_temporary(Op.LOAD, constant(values[0]))
    for i, value in enumerate(values[1:], 1):
        following = Label()
        to.block.test(Op.IF_EQ, position, constant(i), following)
        to.block.emit(Op.LOAD, result, constant(value))
        to.block.bind(following)
    return result


def nearest_thing(to: Emitter, term: terms.Quantified) -> int:
    """The operand of the nearest thing that the condition holds for."""
    assert term.to is not None
    block, items = to.block, term.items
    first, last = items[0].value, items[-1].value
    in_a_row = [item.value for item in items] == list(range(first, last + 1))
    if term.condition is None and in_a_row and last <= _LAST_NEAREST:
        found = to.into_temporary(Op.NEAREST, to.value(term.to), first << 8 | last)
        if to.failed is not None:
            block.test(Op.IF_LE, constant(0), found, to.failed)
        block.emit(Op.MAX, found, found, constant(first))
        return found
    result = to.into_temporary(Op.LOAD, constant(items[0].value))
    goal = to.value(term.to)
    if term.condition is None:
        least = to.into_temporary(Op.DISTANCE, constant(items[0].value), goal)
        items = items[1:]
    else:
        least = _far(to)
    for item in items:
        following = Label()
        mark = block.taken
        to.condition(to.instance(term, item), following)
        distance = to.into_temporary(Op.DISTANCE, constant(item.value), goal)
        block.test(Op.IF_LT, distance, least, following)
        block.emit(Op.LOAD, least, distance)
        block.emit(Op.LOAD, result, constant(item.value))
        block.bind(following)
        block.release(mark)
    if to.failed is not None:
        block.test(Op.IF_LT, least, _far(to), to.failed)
    return result


def _far(to: Emitter) -> int:
    """How far away what is not in the room is from everything."""
    return to.into_temporary(Op.ADD, Register.WIDTH, Register.HEIGHT)
