"""`those(c in purse where ...)` to code: a bit for each member of the group, which says whether it is one of those."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from socialai_dsl.compiler.assembler import Block, Label
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.program import Op, constant
from socialai_dsl.semantics.plans import Assignment, Effect, RulePlan, StepPlan
from socialai_dsl.semantics.terms import SitedTerm, Term

_BITS = 15
"""Bits that stand in one operand, which a register can keep until a body action is done."""


def conditions(what: RulePlan | StepPlan) -> list[SitedTerm]:
    """One for each register and thing, in the order in which they are set and affected."""
    of_sets = [item.only for item in what.sets if item.only is not None]
    of_effects = [SitedTerm(only, effect.site, effect.span) for effect in what.causes for only in effect.only]
    return of_sets + of_effects


def sizes(what: RulePlan | StepPlan) -> list[int]:
    """How many bits each operand has."""
    count = len(conditions(what))
    return [min(_BITS, count - first) for first in range(0, count, _BITS)]


def _bit(bits: tuple[int, ...], number: int) -> tuple[int, int]:
    """The operands of a test of the bit of this number."""
    return bits[number // _BITS], constant(number % _BITS)


class MemberSelection:
    """Emits, before anything is done, which members are among those, and what only they need.

    Attributes:
        bits: operands with the bits, `_BITS` in each.
    """

    def __init__(self, to: Expressions, what: RulePlan | StepPlan) -> None:
        self.to = to
        asked = conditions(what)
        self.bits = tuple(to.into_temporary(Op.LOAD, constant(0)) for _ in sizes(what))
        for number, condition in enumerate(asked):
            bits, place = _bit(self.bits, number)
            following = Label()
            to.sited_condition(condition, following)
            to.block.emit(Op.SET_BIT, bits, place)
            to.block.bind(following)
        self._numbers = {id(item): k for k, item in enumerate(i for i in what.sets if i.only is not None)}
        number = len(self._numbers)
        for effect in what.causes:
            self._numbers[id(effect)] = number
            number += len(effect.only)
        self._known: dict[SitedTerm, int] = {}

    def set_to(self, item: Assignment) -> int:
        """The operand of what a register is set to; what is the same for all of them is computed once."""
        if item.each:
            return self._if_chosen(item, item.value.term, lambda: self.to.sited_value(item.value))
        if item.only is None:
            return self.to.sited_copy(item.value)
        if item.value not in self._known:
            self._known[item.value] = self.to.sited_copy(item.value)
        return self._known[item.value]

    def value_of(self, effect: Effect) -> int:
        """The operand of the value of an effect on one."""
        value = effect.value
        assert value is not None, "internal: an effect on each has a value"
        return self._if_chosen(effect, value, lambda: self.to.value(value))

    def _if_chosen(self, what: Assignment | Effect, value: Term, computed: Callable[[], int]) -> int:
        """A temporary with a value that is computed for one of those, and else is any of its type."""
        block = self.to.block
        result = self.to.into_temporary(Op.LOAD, self.to.number(value.type.low))
        with block.when(Op.IF_BIT, *_bit(self.bits, self._numbers[id(what)])), block.scratch():
            block.emit(Op.LOAD, result, computed())
        return result


class Choice:
    """Emits what is done to those alone, in the order of `conditions`."""

    def __init__(self, block: Block, bits: tuple[int, ...]) -> None:
        self._block, self._bits = block, bits
        self._done = 0

    @contextmanager
    def of(self, only: SitedTerm | Term | None) -> Iterator[None]:
        """What is emitted within is done if the next of the conditions held, or always where there is none."""
        if only is None:
            yield
            return
        with self._block.when(Op.IF_BIT, *_bit(self._bits, self._done)):
            self._done += 1
            yield
