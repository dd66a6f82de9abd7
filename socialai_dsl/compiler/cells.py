"""Cells to code: sets of cells that a condition picks out, one cell of such a set, and the coordinates of a cell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from socialai_dsl.compiler.assembler import Block, Label, constant
from socialai_dsl.compiler.emitter import Emitter, LoopCell
from socialai_dsl.compiler.folding import TRUE, mentions
from socialai_dsl.compiler.registers import NOWHERE
from socialai_dsl.program import BOARDS, CELL, Counting, Field, Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Const, Term, may_find_nothing

ROW = 32


def keep_each(to: Emitter, board: int, condition: Term, name: str = "") -> None:
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


def count_cells(to: Emitter, term: terms.Quantified, opposite: bool = False) -> int:
    """A temporary with the number of cells that the condition of a quantifier (or its opposite) holds for."""
    boards = to.block.boards_taken
    result = to.block.temporary()
    to.block.emit(Op.B_COUNT, result, _cells_of(to, term, opposite))
    to.block.release_boards(boards)
    return result


def one_cell(to: Emitter, term: terms.Quantified) -> int:
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


def _cells_of(to: Emitter, term: terms.Quantified, opposite: bool = False) -> int:
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

_MOST_BOARDS: Final = 2
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
    return about_it and known and to.block.boards_taken + _MOST_BOARDS <= BOARDS


def _shape(to: Emitter, where: Term, variable: str) -> int:
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
