"""Placements to code: sets of cells as boards, one uniform draw among the cells that are left."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.cells import (
    EVERYWHERE,
    conjuncts,
    fill_rectangle,
    is_about_cell,
    keep_each,
    keep_shape,
)
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import mentions
from socialai_dsl.program import Counting, Field, Op, Register, Side
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.free_cells import EXACT
from socialai_dsl.semantics.plans import Placing, Region
from socialai_dsl.semantics.terms import Term

_SIDES = {"top": Side.TOP, "bottom": Side.BOTTOM, "left": Side.LEFT, "right": Side.RIGHT}


class Places:
    """Emits placements through `to`; boards are taken and given back like a stack."""

    def __init__(self, to: Expressions) -> None:
        self.to = to

    def put(self, placing: Placing) -> None:
        """Emit the draw of a cell and the putting of the entity there, or that it lies in something."""
        to, block = self.to, self.to.block
        block.span = placing.span
        mark = block.taken
        if placing.inside is not None:
            to.site = placing.where_site
            self._inside(placing.entity, placing.inside)
            block.release(mark)
            return
        cell = block.temporary(2)
        if placing.at is not None:
            to.site = placing.where_site
            for i, coordinate in enumerate(placing.at):
                self._coordinate(cell + i, coordinate, to.checked.room.canvas[i])
        elif placing.nowhere:
            for target in (cell, cell + 1):
                block.emit(Op.LOAD, target, constant(-1))
        else:
            to.site = placing.where_site
            boards = block.boards_taken
            board = self._union(placing.regions, placing.overlap)
            if not placing.overlap:
                block.emit(Op.B_FREE, board)
            if placing.where is not None:
                self._keep(board, placing.where)
            block.emit(Op.PICK_CELL, cell, board, to.sites.row(placing.site, placing.number))
            block.release_boards(boards)
        block.emit(Op.PUT, constant(placing.entity), cell)
        block.release(mark)

    def _inside(self, content: int, holder: Term) -> None:
        """On the cell of what it lies in, but not in the room."""
        block = self.to.block
        cell = block.temporary(2)
        number = self.to.value(holder)
        block.emit(Op.FIELD, cell, number, Field.X)
        block.emit(Op.FIELD, cell + 1, number, Field.Y)
        block.emit(Op.PUT, constant(content), cell)
        block.emit(Op.VANISH, constant(content))
        block.emit(Op.SET_FIELD, constant(content), Field.INSIDE, number)

    def _coordinate(self, target: int, coordinate: Term, size: int) -> None:
        """A coordinate, kept on the canvas where it comes from something that may be anywhere."""
        block = self.to.block
        block.emit(Op.LOAD, target, self.to.value(coordinate))
        somewhere = any(
            mentions(coordinate, kind) for kind in (terms.FieldOf, terms.Measure, terms.Quantified)
        )
        if somewhere or coordinate.type.low < -1 or coordinate.type.high >= size:
            block.emit(Op.MAX, target, target, constant(-1))
            block.emit(Op.MIN, target, target, constant(size - 1))

    def _union(self, regions: tuple[Region, ...], overlap: bool) -> int:
        first, *rest = [self._region(region, overlap) for region in regions]
        for board in rest:
            self.to.block.emit(Op.B_OR, first, board)
        self.to.block.release_boards(first + 1)
        return first

    def _region(self, region: Region, overlap: bool) -> int:
        block = self.to.block
        board = block.board()
        match region.name:
            case "anywhere":
                block.emit(Op.B_FLOOR, board)
            case "wall":
                self._wall(board, region)
            case "next_to":
                block.emit(Op.B_NEXT_TO, board, self.to.value(region.args[0]))
                self._only_floor(board)
            case "in_front_of":
                block.emit(Op.B_IN_FRONT_OF, board, self.to.value(region.args[0]))
                self._only_floor(board)
            case _:
                self._rectangle(board, region, overlap and region.name in EXACT)
        return board

    def _wall(self, board: int, region: Region) -> None:
        """One side of the room, known or drawn (then `region.args` holds it as a number, like Side)."""
        block = self.to.block
        if region.side is not None:
            block.emit(Op.B_WALL, board, _SIDES[region.side], region.margin)
            return
        drawn = self.to.value(region.args[0])
        done = Label()
        *others, last = Side
        for side in others:
            following = Label()
            block.test(Op.IF_EQ, drawn, constant(side), following)
            block.emit(Op.B_WALL, board, side, region.margin)
            block.skip(done)
            block.bind(following)
        block.emit(Op.B_WALL, board, last, region.margin)
        block.bind(done)

    def _only_floor(self, board: int) -> None:
        floor = self.to.block.board()
        self.to.block.emit(Op.B_FLOOR, floor)
        self.to.block.emit(Op.B_AND, board, floor)
        self.to.block.release_boards(floor)

    def _rectangle(self, board: int, region: Region, built: bool) -> None:
        """Halves, rows, columns and rectangles; with `built` also where something is built."""
        block = self.to.block
        mark = block.taken
        bounds = list(EVERYWHERE)
        if region.name in ("column", "row"):
            at = 0 if region.name == "column" else 2
            bounds[at] = bounds[at + 1] = self.to.value(region.args[0])
        elif region.name == "rect":
            x0, y0, x1, y1 = (self.to.value(arg) for arg in region.args)
            bounds = [x0, x1, y0, y1]
        else:
            self._half(region.name, bounds)
        fill_rectangle(block, board, bounds, Counting.BUILT if built else Counting.FLOOR)
        block.release(mark)

    def _half(self, name: str, bounds: list[int]) -> None:
        """left_half is x < W // 2, right_half x > W // 2; top and bottom likewise: the middle line is in neither."""
        block = self.to.block
        middle, beyond = block.temporary(), block.temporary()
        size = Register.WIDTH if name in ("left_half", "right_half") else Register.HEIGHT
        block.emit(Op.DIV, middle, size, constant(2))
        lower = name in ("left_half", "top_half")
        block.emit(Op.SUB if lower else Op.ADD, beyond, middle, constant(1))
        bounds[(0 if size == Register.WIDTH else 2) + (1 if lower else 0)] = beyond

    # --- where ---

    def _keep(self, board: int, where: Term) -> None:
        """Take out of `board` the cells for which `where` is false."""
        for part in conjuncts(self.to, where):
            if not is_about_cell(part):
                self._keep_all(board, part)
            elif not keep_shape(self.to, board, part):
                self._keep_other(board, part)

    def _keep_other(self, board: int, where: Term) -> None:
        match where:
            case terms.Not():
                held = self._copy(board)
                self._keep(held, where.arg)
                self.to.block.emit(Op.B_WITHOUT, board, held)
                self.to.block.release_boards(held)
            case terms.Logic():
                self._keep_either(board, where.args)
            case terms.Quantified(op="any", cells=False):
                self._keep_either(board, tuple(self.to.instance(where, item) for item in where.items))
            case _:
                keep_each(self.to, board, where)

    def _keep_all(self, board: int, condition: Term) -> None:
        """Take out every cell if the condition, which is the same for all, is false."""
        block = self.to.block
        drop, done = Label(), Label()
        self.to.condition(condition, drop)
        block.skip(done)
        block.bind(drop)
        block.emit(Op.B_WITHOUT, board, board)
        block.bind(done)

    def _copy(self, board: int) -> int:
        copy = self.to.block.board()
        self.to.block.emit(Op.B_COPY, copy, board)
        return copy

    def _keep_either(self, board: int, args: tuple[Term, ...]) -> None:
        rest = self._copy(board)
        for arg in args:
            held = self._copy(rest)
            self._keep(held, arg)
            self.to.block.emit(Op.B_WITHOUT, rest, held)
            self.to.block.release_boards(held)
        self.to.block.emit(Op.B_WITHOUT, board, rest)
        self.to.block.release_boards(rest)
