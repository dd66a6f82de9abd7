"""Choices between values to code: cheap where all conditions ask which number one register holds."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass

from socialai_dsl.compiler.assembler import LARGEST, Label, constant
from socialai_dsl.compiler.emitter import Emitter
from socialai_dsl.program import Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Const, Read, Select, Term

_MASK_BITS = LARGEST.bit_length()
"""How many numbers a set in one operand can tell apart."""
_WORD_BITS = 63


@dataclass(frozen=True)
class _Switch:
    """A Select that only depends on one register: for each value the numbers for which it is taken; all are covered."""

    read: Read
    cases: dict[Term, set[int]]


def selected_value(to: Emitter, term: Select) -> int:
    """The operand in which the selected value is."""
    switch = _switch(term)
    if switch is not None:
        shift = _shift(switch)
        if shift is not None:
            register = to.value(switch.read)
            return to.into_temporary(Op.ADD, register, constant(shift)) if shift else register
    result = to.block.temporary()

    def take(value: Term) -> None:
        mark = to.block.taken
        to.block.emit(Op.LOAD, result, to.value(value))
        to.block.release(mark)

    if switch is not None and all(isinstance(value, Const | Read) for value in switch.cases):
        _overwrite(to, switch, take)
    else:
        _branches(to, term, switch, take)
    return result


def selected_condition(to: Emitter, term: Select, otherwise: Label) -> None:
    """Fall through if the selected condition holds, else skip to `otherwise`."""
    switch = _switch(term)
    if switch is None or not all(isinstance(value, Const) for value in switch.cases):
        _branches(to, term, switch, lambda value: to.condition(value, otherwise))
        return
    true = set[int]().union(
        *(numbers for value, numbers in switch.cases.items() if isinstance(value, Const) and value.value)
    )
    among(to, switch.read, true, otherwise)


def _overwrite(to: Emitter, switch: _Switch, take: Callable[[Term], None]) -> None:
    """The commonest value, then each other one in its cases."""
    commonest = _commonest(switch)
    take(commonest)
    for value, numbers in switch.cases.items():
        if value != commonest:
            following = Label()
            among(to, switch.read, numbers, following)
            take(value)
            to.block.bind(following)


def _commonest(switch: _Switch) -> Term:
    return max(switch.cases, key=lambda value: len(switch.cases[value]))


def _branches(to: Emitter, term: Select, switch: _Switch | None, take: Callable[[Term], None]) -> None:
    """Test one condition after the other; what needs most words to ask for comes last and is not asked for."""
    block = to.block
    done = Label()
    branches: list[tuple[Callable[[Label], None], Term]] = []
    if switch is None:
        last = term.default
        for condition, value in zip(term.conditions, term.values, strict=True):
            branches.append((lambda to_next, asked=condition: to.condition(asked, to_next), value))  # type: ignore[misc]
    else:
        last = _commonest(switch)
        for value, numbers in switch.cases.items():
            if value != last:
                branches.append(
                    (lambda to_next, taken=numbers: among(to, switch.read, taken, to_next), value)  # type: ignore[misc]
                )
    for ask, value in branches:
        following = Label()
        ask(following)
        take(value)
        block.skip(done)
        block.bind(following)
    take(last)
    block.bind(done)


def _switch(term: Select) -> _Switch | None:
    asked = [asks(condition) for condition in term.conditions]
    first = asked[0] if asked else None
    if first is None:
        return None
    read = first[0]
    left = set(range(read.type.low, read.type.high + 1))
    cases: dict[Term, set[int]] = {}
    for ask, value in zip(asked, term.values, strict=True):
        if ask is None or ask[0] != read:
            return None
        if taken := ask[1] & left:
            cases.setdefault(value, set()).update(taken)
            left -= taken
    if left:
        cases.setdefault(term.default, set()).update(left)
    return _Switch(read, cases)


def asks(condition: Term) -> tuple[Read, frozenset[int]] | None:
    """The register that a condition is about, and the numbers for which it holds."""
    match condition:
        case terms.Compare(op="==", left=Read() as read, right=Const(value=number)):
            return read, frozenset((number,))
        case terms.Compare(op="==", left=Const(value=number), right=Read() as read):
            return read, frozenset((number,))
        case terms.Logic(op="or", args=args):
            parts = [asks(arg) for arg in args]
            known = [part for part in parts if part is not None]
            if len(known) == len(parts) and len({read for read, _ in known}) == 1:
                return known[0][0], frozenset[int]().union(*(numbers for _, numbers in known))
    return None


def _shift(switch: _Switch) -> int | None:
    """What is to be added to the register to get the value, if that is so for all numbers."""
    shifts = {
        value.value - number if isinstance(value, Const) else None
        for value, numbers in switch.cases.items()
        for number in numbers
    }
    return shifts.pop() if len(shifts) == 1 else None


def among(to: Emitter, read: Read, numbers: Set[int], otherwise: Label) -> None:
    """Fall through if the register holds one of these numbers."""
    block, register, low, high = to.block, to.value(read), read.type.low, read.type.high
    numbers = numbers & set(range(low, high + 1))
    others = set(range(low, high + 1)) - numbers
    if not numbers:
        block.skip(otherwise)
    elif len(numbers) == 1:
        block.test(Op.IF_EQ, register, constant(min(numbers)), otherwise)
    elif len(others) == 1:
        block.test(Op.IF_NE, register, constant(min(others)), otherwise)
    elif others and low >= 0 and high < _WORD_BITS and max(numbers) < _MASK_BITS:
        block.test(Op.IF_BIT, constant(sum(1 << number for number in numbers)), register, otherwise)
    elif others:
        to.one_of(Op.IF_EQ, register, frozenset(numbers), otherwise)
