"""Cells to code: sets of cells that a condition picks out, one cell of such a set, and the coordinates of a cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.folding import TRUE
from socialai_dsl.compiler.shapes import conjuncts, keep_shape
from socialai_dsl.program import CELL, Field, Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Const, Term

if TYPE_CHECKING:
    from socialai_dsl.compiler.expressions import Expressions

NOWHERE = CELL - 1
"""The cell of what is in no cell."""
ROW = 32


@dataclass(frozen=True, slots=True)
class LoopCell:
    """The cell that a loop is at: operands of its x, its y and itself. `name` is its variable; empty for `here`."""

    name: str
    x: int
    y: int
    cell: int


def keep_each(to: Expressions, board: int, condition: Term, name: str = "") -> None:
    """Take out of `board` the cells for which `condition` is false."""
    assert to.loop is None, "internal: a loop over cells inside another"
    block = to.block
    mark = block.taken
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
    block.release(mark)


def count_cells(to: Expressions, term: terms.Quantified, opposite: bool = False) -> int:
    """A temporary with the number of cells that the condition of a quantifier (or its opposite) holds for."""
    boards = to.block.boards_taken
    result = to.block.temporary()
    to.block.emit(Op.B_COUNT, result, _cells_of(to, term, opposite))
    to.block.release_boards(boards)
    return result


def one_cell(to: Expressions, term: terms.Quantified) -> int:
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
        found = Label()
        block.test(Op.IF_LT, x, constant(0), found)
        block.emit(Op.B_FLOOR, board)
        block.emit(Op.FIRST_CELL, x, board)
        block.bind(found)
    block.release_boards(boards)
    result = block.temporary()
    block.emit(Op.MUL, result, x + 1, constant(ROW))
    block.emit(Op.ADD, result, result, x)
    block.emit(Op.ADD, result, result, constant(CELL))
    block.emit(Op.MAX, result, result, constant(NOWHERE))
    return result


def _cells_of(to: Expressions, term: terms.Quantified, opposite: bool = False) -> int:
    """A fresh board with the floor cells that a quantifier is about."""
    board = to.block.board()
    to.block.emit(Op.B_FLOOR, board)
    condition = term.condition or TRUE
    if opposite:
        condition = terms.Not(condition)
    if condition != TRUE:
        _keep(to, board, condition, term.variable)
    return board


def _keep(to: Expressions, board: int, condition: Term, variable: str) -> None:
    """Take out of `board` the cells for which `condition` is false: first what makes a shape, then one by one."""
    rest = [part for part in conjuncts(to, condition) if not keep_shape(to, board, part, variable)]
    if len(rest) == 1:
        keep_each(to, board, rest[0], variable)
    elif rest:
        keep_each(to, board, terms.Logic("and", tuple(rest)), variable)


def coordinate(to: Expressions, term: terms.FieldOf) -> int:
    """One coordinate of a cell."""
    assert term.name in ("x", "y"), f"internal: a cell has no {term.name}"
    of, loop = term.entity, to.loop
    if isinstance(of, Const):
        return constant((of.value - CELL) % ROW if term.name == "x" else (of.value - CELL) // ROW)
    if isinstance(of, terms.Variable) and loop is not None and of.name == loop.name:
        return loop.x if term.name == "x" else loop.y
    return to.into_temporary(Op.FIELD, to.value(of), Field.X if term.name == "x" else Field.Y)
