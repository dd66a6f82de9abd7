"""What keeps somebody from getting somewhere: who or what stands in the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import CELL, ENTITY_FIELDS, FIRST_ENTITY, Field, Flag, Header, Program

Cell = tuple[int, int]

_STEPS: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
_FREE, _BODY, _THING = 1, 1_000, 100_000
"""What a step costs: a way round is better than one through somebody, and that than one through something."""
_AGENT: Final = 0


@dataclass(frozen=True)
class Moment:
    """A room as it is now.

    Attributes:
        program: what is played. registers: int16 (R,). board: looks of the cells, then lines of solid ones.
    """

    program: Program
    registers: NDArray[np.int16]
    board: NDArray[Any]

    def obstruction(self, mover: int, goal: int, beside: bool) -> str | None:
        """Why an inhabitant has no way to an entity or cell, or to a free cell `beside` it; None if it has one."""
        start, end = self._cell(mover), self._cell(goal)
        if end is None:
            return "its goal is not in the room"
        if start is None or start == end:
            return None
        costs = self._costs(mover)
        ends = {(end[0] + dx, end[1] + dy) for dx, dy in _STEPS} & costs.keys() if beside else {end}
        if not beside:
            costs[end] = _FREE
        if start in ends:
            return None
        way = _cheapest(start, ends, costs)
        if way is None:
            return "there is no way: walls lie between"
        found = list(dict.fromkeys(name for cell in way if costs[cell] > _FREE for name in self._in(cell)))
        return f"there is no way: {_listed(found)} in the way" if found else None

    def _cell(self, number: int) -> Cell | None:
        """Where an entity is; a goal may be a cell itself."""
        if number >= CELL:
            return (number - CELL) % 32, (number - CELL) // 32
        fields = self.registers[FIRST_ENTITY + ENTITY_FIELDS * number :]
        if fields[Field.GONE] or fields[Field.X] < 0:
            return None
        return int(fields[Field.X]), int(fields[Field.Y])

    def _costs(self, mover: int) -> dict[Cell, int]:
        """What it costs to step on a cell; those of walls are left out."""
        width, height = (self.program.header(h) for h in (Header.CANVAS_WIDTH, Header.CANVAS_HEIGHT))
        taken = {self._cell(number): number for number in range(len(self.program.entities))}
        deadly, costs = self.program.header(Header.DEADLY), {}
        for y in range(height):
            solid = int(self.board[width * height + 1 + y])
            for x in range(width):
                code = int(self.board[y * width + x]) & 0xFF
                kills = code < 32 and deadly >> code & 1
                if (solid >> x & 1 and (x, y) in taken) or kills:
                    costs[x, y] = _THING
                elif not solid >> x & 1:
                    costs[x, y] = _FREE
        hidden = self.program.header(Header.FLAGS) & Flag.NPCS_HIDDEN
        for number, entity in enumerate(self.program.entities):
            cell = self._cell(number)
            blocks = entity.role != "object" and number != mover and not (mover == _AGENT and hidden)
            if blocks and cell is not None and costs.get(cell) == _FREE:
                costs[cell] = _BODY
        return costs

    def _in(self, cell: Cell) -> Iterator[str]:
        """Who and what is in a cell, with its place."""
        names = [str(e) for n, e in enumerate(self.program.entities) if self._cell(n) == cell]
        yield from (f"{name} at {cell[0]},{cell[1]}" for name in names or ["what is deadly"])


def _cheapest(start: Cell, ends: set[Cell], costs: dict[Cell, int]) -> list[Cell] | None:
    """The cells of a cheapest way behind its start; None if there is none."""
    left: list[tuple[int, Cell]] = [(0, start)]
    before: dict[Cell, Cell] = {}
    spent = {start: 0}
    while left:
        cost, cell = heappop(left)
        if cell in ends:
            way = [cell]
            while before[way[-1]] != start:
                way.append(before[way[-1]])
            return way[::-1]
        for dx, dy in _STEPS:
            following = cell[0] + dx, cell[1] + dy
            if following in costs and cost + costs[following] < spent.get(following, 1 << 60):
                spent[following] = cost + costs[following]
                before[following] = cell
                heappush(left, (spent[following], following))
    return None


def _listed(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last} are" if others else f"{last} is"
