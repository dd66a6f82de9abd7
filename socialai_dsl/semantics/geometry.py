"""What the size of a room alone decides: the values of terms that read nothing else, and the cells of regions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Final

from socialai_dsl.semantics import terms
from socialai_dsl.semantics.build import compute
from socialai_dsl.semantics.plans import Region
from socialai_dsl.semantics.terms import Term

EXACT: Final = frozenset({"column", "row", "rect"})
"""Regions that name their cells: what may overlap can be put there where the room builds something, too."""

Cell = tuple[int, int]
Size = tuple[int, int]


class UnknownError(Exception):
    """What decides this is only known in a drawn room."""


def interior_cells(region: Region, size: Size) -> list[Cell]:
    """Cells inside the walls that a region covers whose arguments read only the size, row by row."""
    args = [value(arg, size) for arg in region.args]
    cells = product(range(1, size[1] - 1), range(1, size[0] - 1))
    return [(x, y) for y, x in cells if _lies_in(region.name, args, (x, y), size)]


def wall_cells(region: Region, size: Size, side: str) -> set[Cell]:
    """The cells of one wall, `margin` away from its corners."""
    width, height = size
    along = {"top": width, "bottom": width, "left": height, "right": height}
    places = range(region.margin, along[side] - region.margin)
    at = {"top": 0, "bottom": height - 1, "left": 0, "right": width - 1}[side]
    return {(k, at) if side in ("top", "bottom") else (at, k) for k in places}


def _lies_in(name: str, args: Sequence[int], cell: Cell, size: Size) -> bool:
    (x, y), (width, height) = cell, size
    match name:
        case "left_half":
            return x < width // 2
        case "right_half":
            return x > width // 2
        case "top_half":
            return y < height // 2
        case "bottom_half":
            return y > height // 2
        case "column":
            return x == args[0]
        case "row":
            return y == args[0]
        case "rect":
            return args[0] <= x <= args[2] and args[1] <= y <= args[3]
        case "anywhere":
            return True
    raise AssertionError(f"internal: the size does not decide `{name}`")


def value(term: Term, size: Size, here: Cell = (0, 0)) -> int:
    """The value of a term that reads only the size of the room and the cell; raises UnknownError for others."""
    match term:
        case terms.Const():
            return term.value
        case terms.World(name="width"):
            return size[0]
        case terms.World(name="height"):
            return size[1]
        case terms.Here(name=name):
            return here[0 if name == "x" else 1]
        case terms.Operation(op=op, args=args):
            numbers = [value(arg, size, here) for arg in args]
            # As in a room: dividing by nothing gives 0.
            return 0 if op in ("//", "%") and numbers[1] == 0 else compute(op, *numbers)
        case terms.Compare(op=op, left=left, right=right):
            return COMPARISONS[op](value(left, size, here), value(right, size, here))
        case terms.Logic(op="and", args=args):
            return all(value(arg, size, here) for arg in args)
        case terms.Logic(args=args):
            return any(value(arg, size, here) for arg in args)
        case terms.Not(arg=arg):
            return not value(arg, size, here)
    raise UnknownError(str(term))


COMPARISONS: Final[dict[str, Callable[[int, int], bool]]] = {
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
}
