"""Choices to code: sets of cells, quantifiers, and values selected by conditions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

from socialai_dsl.compiler.assembler import NOWHERE, Block, Label, Registers, Sites
from socialai_dsl.compiler.folding import TRUE, Classes, Facts, fold, mentions, substitute
from socialai_dsl.program import CELL, TEMPORARY, Counting, Field, Op, Register, constant
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.changes import Mobility
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.terms import (
    Const,
    Read,
    Select,
    Term,
    Type,
    draws,
    is_own_noun,
    may_be_nothing,
    may_find_nothing,
)
from socialai_dsl.widths import LARGEST_NUMBER


@dataclass(frozen=True, slots=True)
class LoopCell:
    """The cell that a loop is at: operands of its x, its y and itself. `name` is its variable; empty for `here`."""

    name: str
    x: int
    y: int
    cell: int


class Emitter(ABC):
    """Emits code into one block: what each kind of expression is emitted with; `Expressions` knows them all.

    Attributes:
        block: where to. site: path of the picks of the value being emitted. facts: what is known. inbox: first register
        of the inbox of the member whose frame this is, or -1.
        loop: the cell that the loop over cells is at, outside of loops None.
        failed: label to skip to when a pick finds nothing; None: it takes the first item.
        is_bare: whether the board does not show what stands in the room, as while a room is set up.
        has_drawn: whether some of the code had to have it shown.
    """

    def __init__(
        self,
        block: Block,
        checked: CheckedScenario,
        registers: Registers,
        classes: Classes,
        sites: Sites,
        inbox: int = -1,
    ) -> None:
        self.block, self.checked, self.registers = block, checked, registers
        self.classes, self.sites, self.inbox = classes, sites, inbox
        self.site = ""
        self.facts = Facts()
        self.loop: LoopCell | None = None
        self.failed: Label | None = None
        self.is_bare = False
        self.has_drawn = False

    @abstractmethod
    def test(self, term: Term, otherwise: Label) -> None:
        """Emit a condition; `condition` also gives back the temporaries that this takes."""

    @abstractmethod
    def value(self, term: Term) -> int:
        """Emit what computes the term; the operand it is in afterwards."""

    @cached_property
    def leaving(self) -> frozenset[int]:
        """The entities that leave the room at some time: of these it is still written down where they were.

        Any may be out of it from the beginning, for want of a free cell, say, or as a layout has it.
        """
        return frozenset(Mobility(self.checked).vanishing)

    def condition(self, term: Term, otherwise: Label) -> None:
        """Fall through if `term` holds, else skip to `otherwise`."""
        with self.block.scratch():
            self.test(term, otherwise)

    def one_of(self, op: Op, left: int, numbers: frozenset[int], otherwise: Label) -> None:
        """Whether a class (or state) is among these numbers."""
        if not numbers:
            self.block.skip(otherwise)
            return
        found = Label()
        *rest, last = (
            n if op == Op.IF_HEARD else constant(n) for n in sorted(numbers)
        )  # IF_HEARD takes the class itself
        for number in rest:
            following = Label()
            self.block.test(op, left, number, following)
            self.block.skip(found)
            self.block.bind(following)
        self.block.test(op, left, last, otherwise)
        self.block.bind(found)

    def saturated(self, term: Term) -> int:
        """The operand of a value that is cut to its type: of things that are gone, places and distances are odd."""
        value = self.value(term)
        if term.type.kind != "int" or isinstance(term, Const | Read | terms.ReadEach | terms.World):
            return value
        value = self.into_temporary(Op.MAX, value, self.number(term.type.low))
        return self.into_temporary(Op.MIN, value, self.number(term.type.high))

    def store(
        self, path: str, value: int, is_nothing: bool = False, key: tuple[int, int] | None = None
    ) -> None:
        """Put a temporary into a register; those that hold plain integers saturate, unless nothing is put there.

        Of a row of registers `path` is that of the first, and `key` the operands of `Op.STORE_AT` that say which is
        meant.
        """
        name, emit = self.registers.named(path), self.block.emit
        assert value >= TEMPORARY, "internal: what is stored is cut to its range in place"
        if not name.values and not is_nothing:
            # "No cell" is a value of its own; a register of cells that may be empty stores it as the number of nothing.
            emit(Op.MAX, value, value, constant(name.low if name.kind == "cell" else name.least))
            emit(Op.MIN, value, value, constant(name.high))
        if key is None:
            emit(Op.LOAD, name.register, value)
        else:
            emit(Op.STORE_AT, value, *key)

    def number(self, value: int) -> int:
        """The operand of a known value: a constant, or computed where it is too large for one."""
        if abs(value) <= LARGEST_NUMBER:
            return constant(value)
        quotient, rest = divmod(value, LARGEST_NUMBER)
        product = self.into_temporary(Op.MUL, self.number(quotient), constant(LARGEST_NUMBER))
        return self.into_temporary(Op.ADD, product, constant(rest))

    def into_temporary(self, op: Op, b: int, c: int = 0) -> int:
        """A fresh temporary with the result of an instruction."""
        result = self.block.temporary()
        self.block.emit(op, result, b, c)
        return result

    def instance(self, term: terms.Quantification, item: Const) -> Term:
        """The condition of a quantifier for one of its items."""
        return fold(substitute(term.condition or TRUE, term.variable, item), self.facts, self.classes)


# -- cells: sets of them, one of a set, and coordinates ------------------------------------------------------


ROW = 32


def keep_each(to: Emitter, board: int, condition: Term, name: str = "") -> None:
    """Take out of `board` the cells for which `condition` is false."""
    assert to.loop is None, "internal: a loop over cells inside another"
    block = to.block
    with block.scratch():
        first = block.temporary(3)
        keep, drop = Label(), Label()
        to.loop = LoopCell(name, first, first + 1, first + 2)
        failed = to.failed
        if failed is not None:
            to.failed = drop  # nothing skips out of a loop
        start = len(block.instructions)
        block.emit(Op.EACH_CELL, board, first)
        to.condition(condition, drop)
        block.skip(keep)
        block.bind(drop)
        block.emit(Op.DROP_CELL)
        block.bind(keep)
        block.instructions[start][3] = len(block.instructions) - start - 1
        block.emit(Op.END_EACH)
        to.loop, to.failed = None, failed


def count_cells(to: Emitter, term: terms.Quantification, opposite: bool = False) -> int:
    """A temporary with the number of cells that the condition of a quantifier (or its opposite) holds for."""
    boards = to.block.boards_taken
    result = to.block.temporary()
    to.block.emit(Op.B_COUNT, result, _cells_of(to, term, opposite))
    to.block.release_boards(boards)
    return result


def one_cell(to: Emitter, term: terms.Quantification) -> int:
    """The cell that `first`, `pick` or `nearest` chooses; none: on to `to.failed`, or at a reset the first of all."""
    block = to.block
    boards = block.boards_taken
    board = _cells_of(to, term)
    x = block.temporary(2)
    if term.op == "first":
        block.emit(Op.FIRST_CELL, x, board)
    elif term.op == "pick":
        block.emit(Op.PICK_CELL, x, board, to.sites.row(term.site or to.site, term.ordinal))
    else:
        assert term.to is not None
        block.emit(Op.NEAREST_CELL, x, board, to.value(term.to))
    if to.failed is not None:
        block.test(Op.IF_LE, constant(0), x, to.failed)
    else:
        with block.when(Op.IF_LT, x, constant(0)):
            block.emit(Op.B_FLOOR, board)
            block.emit(Op.FIRST_CELL, x, board)
    block.release_boards(boards)
    result = block.temporary()
    block.emit(Op.MUL, result, x + 1, constant(ROW))
    block.emit(Op.ADD, result, result, x)
    block.emit(Op.ADD, result, result, constant(CELL))
    block.emit(Op.MAX, result, result, constant(NOWHERE))
    return result


def _cells_of(to: Emitter, term: terms.Quantification, opposite: bool = False) -> int:
    """A fresh board with the floor cells that a quantifier is about."""
    board = to.block.board()
    to.block.emit(Op.B_FLOOR, board)
    condition = term.condition or TRUE
    if opposite:
        condition = terms.Not(condition)
    if condition != TRUE:
        _keep(to, board, condition, term.variable)
    return board


def _keep(to: Emitter, board: int, condition: Term, variable: str) -> None:
    """Take out of `board` the cells for which `condition` is false: first what makes a shape, then one by one."""
    rest = [part for part in conjuncts(to, condition) if not keep_shape(to, board, part, variable)]
    if len(rest) == 1:
        keep_each(to, board, rest[0], variable)
    elif rest:
        keep_each(to, board, terms.Logic("and", tuple(rest)), variable)


def coordinate(to: Emitter, term: terms.FieldOf) -> int:
    """One coordinate of a cell."""
    assert term.name in ("x", "y"), f"internal: a cell has no {term.name}"
    of, loop = term.entity, to.loop
    if isinstance(of, Const):
        return constant((of.value - CELL) % ROW if term.name == "x" else (of.value - CELL) // ROW)
    if isinstance(of, terms.Variable) and loop is not None and of.name == loop.name:
        return loop.x if term.name == "x" else loop.y
    return to.into_temporary(Op.FIELD, to.value(of), Field.X if term.name == "x" else Field.Y)


# -- shapes ----------------------------------------------------------------------------------------------------


EVERYWHERE: Final = (constant(0), constant(31), constant(0), constant(31))
"""Operands of the least and the greatest x, then of y, of a rectangle that is all there is."""

_LEAST, _GREATEST = 0, 1
_COLUMNS, _ROWS = 0, 2


def is_about_cell(where: Term) -> bool:
    """Whether a condition may hold for one candidate cell and not for another."""
    return mentions(where, terms.Here) or mentions(where, terms.Test, lambda test: test.subject is None)


def conjuncts(to: Emitter, condition: Term) -> Iterator[Term]:
    """Conditions that all have to hold where one does."""
    parts: Iterable[Term]
    match condition:
        case terms.Logic(op="and"):
            parts = condition.args
        case terms.Quantification(op="all", cells=False):
            parts = (to.instance(condition, item) for item in condition.items)
        case terms.Not(arg=terms.Logic(op="or", args=args)):
            parts = map(terms.Not, args)
        case terms.Not(arg=terms.Quantification(op="any", cells=False) as every):
            parts = (terms.Not(to.instance(every, item)) for item in every.items)
        case terms.Compare(op="!="):
            yield terms.Not(replace(condition, op="=="))
            return
        case _:
            yield condition
            return
    for part in parts:
        yield from conjuncts(to, part)


def keep_shape(to: Emitter, board: int, condition: Term, variable: str = "") -> bool:
    """Take out of `board` the cells for which a condition is false, if it or its opposite is a shape; whether it is."""
    positive = condition.arg if isinstance(condition, terms.Not) else condition
    if not _is_shape(to, positive, variable):
        return False
    held = _shape(to, positive, variable)
    to.block.emit(Op.B_AND if positive is condition else Op.B_WITHOUT, board, held)
    to.block.release_boards(held)
    return True


def _is_shape(to: Emitter, where: Term, variable: str) -> bool:
    """Whether the cells that a condition holds for are those near a thing, or rows and columns.

    The candidate is `here`, or the variable of a quantifier.
    """
    match where:
        case terms.Test(subject=subject, name="in_front_of" | "next_to" | "in_line" | "at", object=other):
            about_it = subject is None or _is_candidate(subject, variable)
        case terms.Compare(op="==" | "<" | "<=", left=left, right=right):
            sides = [_coordinate(side, variable) is not None for side in (left, right)]
            about_it, other = sides.count(True) == 1, right if sides[0] else left
        case _:
            return False
    known = not (_is_mentioned(other, variable) or (to.failed is not None and may_find_nothing(other)))
    return about_it and known


def _shape(to: Emitter, where: Term, variable: str) -> int:
    """A fresh board with the cells that such a condition holds for, whatever is there."""
    block = to.block
    board = block.board()
    with block.scratch():
        match where:
            case terms.Test(name="in_front_of", object=thing):
                block.emit(Op.B_IN_FRONT_OF, board, to.value(thing))
            case terms.Test(name="next_to", object=thing):
                block.emit(Op.B_NEXT_TO, board, to.value(thing))
            case terms.Test(name="at", object=thing):
                _fill_cell_of(to, board, to.value(thing))
            case terms.Test(object=thing):
                _fill_lines_of(to, board, to.value(thing))
            case terms.Compare(op=op, left=left, right=right):
                name = _coordinate(left, variable)
                if name is not None:
                    _fill_side(to, board, name, op, _GREATEST, to.value(right))
                else:
                    _fill_side(to, board, _coordinate(right, variable), op, _LEAST, to.value(left))
    return board


def _is_candidate(term: Term, variable: str) -> bool:
    if variable:
        return isinstance(term, terms.Variable) and term.name == variable
    return isinstance(term, terms.Here) and term.name == "cell"


def _coordinate(term: Term, variable: str) -> str | None:
    """Which of its coordinates a term is, None if neither."""
    match term:
        case terms.Here(name="x" | "y" as name) if not variable:
            return name
        case terms.FieldOf(entity=of, name="x" | "y" as name) if _is_candidate(of, variable):
            return name
    return None


def _is_mentioned(term: Term, variable: str) -> bool:
    if variable:
        return mentions(term, terms.Variable, lambda part: part.name == variable)
    return is_about_cell(term)


def fill_rectangle(block: Block, board: int, bounds: Sequence[int], counting: Counting) -> None:
    """Let a board be the cells that count and whose x and y lie between bounds, given as in `EVERYWHERE`."""
    with block.scratch():
        corner = block.temporary(4)
        for i, bound in enumerate(bounds):
            block.emit(Op.LOAD, corner + i, bound)
        block.emit(Op.B_RECT, board, corner, counting)


def _fill_cell_of(to: Emitter, board: int, thing: int) -> None:
    """The cell of a thing; nothing if it is not in the room, for then x and y are -1."""
    x, y = (to.into_temporary(Op.FIELD, thing, name) for name in (Field.X, Field.Y))
    fill_rectangle(to.block, board, (x, x, y, y), Counting.ALL)


def _fill_lines_of(to: Emitter, board: int, thing: int) -> None:
    """The column and the row of a thing; nothing if it is not in the room, for then both are -1."""
    block = to.block
    lines = [to.into_temporary(Op.FIELD, thing, name) for name in (Field.X, Field.Y)]
    row = block.board()
    for into, first, line in zip((board, row), (_COLUMNS, _ROWS), lines, strict=True):
        bounds = list(EVERYWHERE)
        bounds[first + _LEAST] = bounds[first + _GREATEST] = line
        fill_rectangle(block, into, bounds, Counting.ALL)
    block.emit(Op.B_OR, board, row)
    block.release_boards(row)


def _fill_side(to: Emitter, board: int, name: str | None, op: str, end: int, bound: int) -> None:
    """The cells whose coordinate ends at a bound (or begins there), which belongs to them unless `op` is <."""
    first = _COLUMNS if name == "x" else _ROWS
    if op == "<":
        bound = to.into_temporary(Op.SUB if end == _GREATEST else Op.ADD, bound, constant(1))
    bounds = list(EVERYWHERE)
    bounds[first + end] = bound
    if op == "==":
        bounds[first + _LEAST] = bounds[first + _GREATEST] = bound
    fill_rectangle(to.block, board, bounds, Counting.ALL)


# -- things: one condition after the other, collected in a set of bits ---------------------------------------


_SET = 32
"""How many things a set of bits can tell apart."""

_LAST_SITE = 65535
_LAST_OTHER = 255
_MOST_OTHERS = 127
"""What `Op.DRAW_OTHER` has room for."""

_LAST_NEAREST = 255
"""What `Op.NEAREST` has room for."""


def count_things(to: Emitter, term: terms.Quantification) -> int:
    """A temporary with the number of things that the condition holds for."""
    if len(term.items) > _SET:
        return _count_one_by_one(to, term)
    return to.into_temporary(Op.COUNT_BITS, _mask(to, term))


def first_thing(to: Emitter, term: terms.Quantification) -> int:
    """The operand of the first thing that the condition holds for."""
    if len(term.items) > _SET:
        return _nth(to, term, to.into_temporary(Op.LOAD, constant(0)))
    return _chosen(to, term, Op.LOWEST_BIT)


def _mask(to: Emitter, term: terms.Quantification) -> int:
    """A temporary whose bit i says whether item i holds."""
    mask = to.block.temporary()
    to.block.emit(Op.LOAD, mask, constant(0))
    for i, item in enumerate(term.items):
        following = Label()
        to.condition(to.instance(term, item), following)
        to.block.emit(Op.SET_BIT, mask, constant(i))
        to.block.bind(following)
    return mask


def picked_thing(to: Emitter, term: terms.Quantification) -> int:
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


def _but_one(term: terms.Quantification) -> terms.Term | None:
    """The one of its things that `pick(x in group where x != one)` leaves out, if that is what the term is."""
    match term.condition:
        case terms.Compare(
            "!=",
            terms.Variable(name=name),
            (terms.Const() | terms.Read(nothing=None) | terms.FieldOf(entity=Const())) as one,
        ):
            first, last = term.items[0].value, term.items[-1].value
            among = first <= one.type.low and one.type.high <= last
            fits = first >= 0 and last <= _LAST_OTHER and 1 < len(term.items) <= _MOST_OTHERS
            if name == term.variable and in_a_row([item.value for item in term.items]) and among and fits:
                return one
    return None


def _any_other(to: Emitter, term: terms.Quantification, one: terms.Term, site: int) -> int:
    """One of all of them less the one, without asking of each whether it is that."""
    assert site <= _LAST_SITE, "internal: more draw sites than an instruction can name"
    packed = site | term.items[0].value << 16 | len(term.items) << 24
    return to.into_temporary(Op.DRAW_OTHER, to.value(one), packed)


def _chosen(to: Emitter, term: terms.Quantification, op: Op, site: int = 0) -> int:
    mask = _mask(to, term)
    if to.failed is not None:
        to.block.test(Op.IF_NE, mask, constant(0), to.failed)
    return _item(to, term.items, to.into_temporary(op, mask, site))


def _count_one_by_one(to: Emitter, term: terms.Quantification) -> int:
    total = to.into_temporary(Op.LOAD, constant(0))
    for item in term.items:
        following = Label()
        to.condition(to.instance(term, item), following)
        to.block.emit(Op.ADD, total, total, constant(1))
        to.block.bind(following)
    return total


def _nth(to: Emitter, term: terms.Quantification, left: int) -> int:
    """The thing that comes after `left` others that the condition holds for as well; none: as for small groups."""
    block = to.block
    result = to.into_temporary(Op.LOAD, constant(term.items[0].value))
    done = Label()
    for item in term.items:
        following = Label()
        to.condition(to.instance(term, item), following)
        with block.when(Op.IF_NE, left, constant(0), then=following):
            block.emit(Op.SUB, left, left, constant(1))
        block.emit(Op.LOAD, result, constant(item.value))
        block.skip(done)
        block.bind(following)
    if to.failed is not None:
        block.skip(to.failed)
    block.bind(done)
    return result


def in_a_row(numbers: Sequence[int]) -> bool:
    """Whether each number is one more than that before it."""
    return list(numbers) == list(range(numbers[0], numbers[0] + len(numbers)))


def _item(to: Emitter, items: tuple[Const, ...], position: int) -> int:
    """The item at a position that is in a temporary."""
    values = [item.value for item in items]
    if in_a_row(values):
        return to.into_temporary(Op.ADD, position, constant(values[0])) if values[0] else position
    result = to.into_temporary(Op.LOAD, constant(values[0]))
    for i, value in enumerate(values[1:], 1):
        with to.block.when(Op.IF_EQ, position, constant(i)):
            to.block.emit(Op.LOAD, result, constant(value))
    return result


def nearest_thing(to: Emitter, term: terms.Quantification) -> int:
    """The operand of the nearest thing that the condition holds for."""
    assert term.to is not None
    block, items = to.block, term.items
    first, last = items[0].value, items[-1].value
    if term.condition is None and in_a_row([item.value for item in items]) and last <= _LAST_NEAREST:
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
        with block.scratch():
            to.condition(to.instance(term, item), following)
            distance = to.into_temporary(Op.DISTANCE, constant(item.value), goal)
            block.test(Op.IF_LT, distance, least, following)
            block.emit(Op.LOAD, least, distance)
            block.emit(Op.LOAD, result, constant(item.value))
            block.bind(following)
    if to.failed is not None:
        block.test(Op.IF_LT, least, _far(to), to.failed)
    return result


def _far(to: Emitter) -> int:
    """How far away what is not in the room is from everything."""
    return to.into_temporary(Op.ADD, Register.WIDTH, Register.HEIGHT)


# -- values: cheap where all conditions ask which number one value is -----------------------------------------


_MASK_BITS = 19
"""How many numbers a set in one operand tells apart; it has room for ten more."""
_WORD_BITS = 63
_MOST_NUMBERS = 1 << 12
_MOST_KEYS = 1 << 16
"""The most values of a key that are looked at one by one."""


@dataclass(frozen=True)
class _Switch:
    """A Select that only depends on one key: for each value the numbers for which it is taken; all are covered."""

    key: Term
    cases: dict[Term, set[int]]


def selected_value(to: Emitter, term: Select) -> int:
    """The operand in which the selected value is."""
    switch = _switch(term)
    if switch is not None:
        shift = _shift(switch)
        if shift is not None:
            key = to.value(switch.key)
            return to.into_temporary(Op.ADD, key, constant(shift)) if shift else key
    result = to.block.temporary()

    def take(value: Term) -> None:
        with to.block.scratch():
            to.block.emit(Op.LOAD, result, to.value(value))

    if switch is not None and all(
        isinstance(value, Const | Read) and not may_find_nothing(value) for value in switch.cases
    ):
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
    among(to, to.value(switch.key), switch.key.type, true, otherwise)


def _overwrite(to: Emitter, switch: _Switch, take: Callable[[Term], None]) -> None:
    """The commonest value, then each other one in its cases."""
    commonest, key = _commonest(switch), to.value(switch.key)
    take(commonest)
    for value, numbers in switch.cases.items():
        if value != commonest:
            following = Label()
            among(to, key, switch.key.type, numbers, following)
            take(value)
            to.block.bind(following)


def _commonest(switch: _Switch) -> Term:
    return max(switch.cases, key=lambda value: len(switch.cases[value]))


def _branches(to: Emitter, term: Select, switch: _Switch | None, take: Callable[[Term], None]) -> None:
    """Test one condition after the other; what needs most words to ask for comes last and is not asked for."""
    block = to.block
    done = Label()
    branches: list[tuple[Callable[[Label], None], Term]]
    if switch is None:
        last = term.default
        asked = [partial(to.condition, condition) for condition in term.conditions]
        branches = list(zip(asked, term.values, strict=True))
    else:
        last, key = _commonest(switch), to.value(switch.key)
        branches = [
            (partial(among, to, key, switch.key.type, numbers), value)
            for value, numbers in switch.cases.items()
            if value != last
        ]
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
    key = first[0]
    if key.type.size > _MOST_KEYS:
        return None
    left = set(key.type.values)
    cases: dict[Term, set[int]] = {}
    for ask, value in zip(asked, term.values, strict=True):
        if ask is None or ask[0] != key:
            return None
        if taken := ask[1] & left:
            cases.setdefault(value, set()).update(taken)
            left -= taken
    if left:
        cases.setdefault(term.default, set()).update(left)
    return _Switch(key, cases)


def asks(condition: Term) -> tuple[Term, frozenset[int]] | None:
    """The key that a condition is about, a value that is computed once, and the numbers for which it holds."""
    match condition:
        case terms.Compare(op="==", left=key, right=Const(value=number)) if _is_key(key):
            return key, frozenset((number,))
        case terms.Compare(op="==", left=Const(value=number), right=key) if _is_key(key):
            return key, frozenset((number,))
        case terms.Logic(op="or", args=args):
            parts = [asks(arg) for arg in args]
            known = [part for part in parts if part is not None]
            if len(known) == len(parts) and len({key for key, _ in known}) == 1:
                return known[0][0], frozenset[int]().union(*(numbers for _, numbers in known))
    return None


def _is_key(term: Term) -> bool:
    """Whether a term has the same value wherever it stands in an expression, one of not too many, and never nothing."""
    if isinstance(term, Read):
        return term.nothing is None
    if isinstance(term, Const) or term.type.high - term.type.low > _MOST_NUMBERS:
        return False
    return not (draws(term) or is_own_noun(term) or may_be_nothing(term))


def _shift(switch: _Switch) -> int | None:
    """What is to be added to the register to get the value, if that is so for all numbers."""
    shifts = {
        value.value - number if isinstance(value, Const) else None
        for value, numbers in switch.cases.items()
        for number in numbers
    }
    return shifts.pop() if len(shifts) == 1 else None


def among(to: Emitter, key: int, type_: Type, numbers: Set[int], otherwise: Label) -> None:
    """Fall through if an operand of this type is one of these numbers."""
    block, low, high = to.block, type_.low, type_.high
    numbers = {number for number in numbers if low <= number <= high}
    others = type_.size - len(numbers)  # how many; of a wide type they are too many to be listed
    if not numbers:
        block.skip(otherwise)
    elif len(numbers) == 1:
        block.test(Op.IF_EQ, key, constant(min(numbers)), otherwise)
    elif others == 1:
        other = next(number for number in range(low, high + 1) if number not in numbers)
        block.test(Op.IF_NE, key, constant(other), otherwise)
    elif others and low >= 0 and high < _WORD_BITS and max(numbers) < _MASK_BITS:
        block.test(Op.IF_BIT, constant(sum(1 << number for number in numbers)), key, otherwise)
    elif others:
        to.one_of(Op.IF_EQ, key, frozenset(numbers), otherwise)
