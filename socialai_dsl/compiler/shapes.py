"""Conditions on a candidate cell to code that fills a shape: a set of cells at once, instead of one after another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from socialai_dsl.compiler.assembler import Block, constant
from socialai_dsl.compiler.folding import mentions
from socialai_dsl.program import BOARDS, Counting, Field, Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.build import may_find_nothing
from socialai_dsl.semantics.terms import Term

if TYPE_CHECKING:
    from socialai_dsl.compiler.expressions import Expressions

EVERYWHERE: Final = (constant(0), constant(31), constant(0), constant(31))
"""Operands of the least and the greatest x, then of y, of a rectangle that is all there is."""

_MOST_BOARDS: Final = 2
_LEAST, _GREATEST = 0, 1
_COLUMNS, _ROWS = 0, 2


def is_about_cell(where: Term) -> bool:
    """Whether a condition may hold for one candidate cell and not for another."""
    return mentions(where, terms.Here) or mentions(where, terms.Test, lambda test: test.subject is None)


def conjuncts(to: Expressions, condition: Term) -> Iterator[Term]:
    """Conditions that all have to hold where one does."""
    parts: Iterable[Term]
    match condition:
        case terms.Logic(op="and"):
            parts = condition.args
        case terms.Quantified(op="all", cells=False):
            parts = (to.instance(condition, item) for item in condition.items)
        case terms.Not(arg=terms.Logic(op="or", args=args)):
            parts = map(terms.Not, args)
        case terms.Not(arg=terms.Quantified(op="any", cells=False) as every):
            parts = (terms.Not(to.instance(every, item)) for item in every.items)
        case terms.Compare(op="!="):
            yield terms.Not(replace(condition, op="=="))
            return
        case _:
            yield condition
            return
    for part in parts:
        yield from conjuncts(to, part)


def keep_shape(to: Expressions, board: int, condition: Term, variable: str = "") -> bool:
    """Take out of `board` the cells for which a condition is false, if it or its opposite is a shape; whether it is."""
    positive = condition.arg if isinstance(condition, terms.Not) else condition
    if not _is_shape(to, positive, variable):
        return False
    held = _shape(to, positive, variable)
    to.block.emit(Op.B_AND if positive is condition else Op.B_WITHOUT, board, held)
    to.block.release_boards(held)
    return True


def _is_shape(to: Expressions, where: Term, variable: str) -> bool:
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
    return about_it and known and to.block.boards_taken + _MOST_BOARDS <= BOARDS


def _shape(to: Expressions, where: Term, variable: str) -> int:
    """A fresh board with the cells that such a condition holds for, whatever is there."""
    block = to.block
    mark, board = block.taken, block.board()
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
    block.release(mark)
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
    mark = block.taken
    corner = block.temporary(4)
    for i, bound in enumerate(bounds):
        block.emit(Op.LOAD, corner + i, bound)
    block.emit(Op.B_RECT, board, corner, counting)
    block.release(mark)


def _fill_cell_of(to: Expressions, board: int, thing: int) -> None:
    """The cell of a thing; nothing if it is not in the room, for then x and y are -1."""
    x, y = (to.into_temporary(Op.FIELD, thing, name) for name in (Field.X, Field.Y))
    fill_rectangle(to.block, board, (x, x, y, y), Counting.ALL)


def _fill_lines_of(to: Expressions, board: int, thing: int) -> None:
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


def _fill_side(to: Expressions, board: int, name: str | None, op: str, end: int, bound: int) -> None:
    """The cells whose coordinate ends at a bound (or begins there), which belongs to them unless `op` is <."""
    first = _COLUMNS if name == "x" else _ROWS
    if op == "<":
        bound = to.into_temporary(Op.SUB if end == _GREATEST else Op.ADD, bound, constant(1))
    bounds = list(EVERYWHERE)
    bounds[first + end] = bound
    if op == "==":
        bounds[first + _LEAST] = bounds[first + _GREATEST] = bound
    fill_rectangle(to.block, board, bounds, Counting.ALL)
