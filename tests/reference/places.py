"""The regions of a room that a `place:` can name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference import geometry
from tests.reference.evaluate import DIRECTED, Context, know_facing, of
from tests.reference.source import Value
from tests.reference.world import SIDES, Cell, World, as_list


def region(value: Value, context: Context) -> list[Cell]:
    """The cells of a place, row by row; its `where` is asked of each as `here`."""
    cells = cells_of(value.tree, replace(context, value=value))
    return sorted(cells, key=lambda cell: (cell[1], cell[0]))


def cells_of(node: Any, context: Context) -> list[Cell]:
    """The cells of a place: interior ones, or those of walls."""
    world = context.world
    if isinstance(node, ast.FilteredRegion):
        region, condition = cells_of(node.region, context), node.where
        return [c for c in region if condition is None or of(condition, context.knowing(here=c))]
    if isinstance(node, ast.Alternatives):
        together = [cell for option in node.options for cell in cells_of(option, context)]
        return list(dict.fromkeys(together))
    name = node.id if isinstance(node, ast.Name) else node.name
    arguments = [of(argument, context) for argument in getattr(node, "args", ())]
    if name in DIRECTED:
        know_facing(context, *arguments)
    if name == "wall":
        return [cell for side in as_list(arguments[0]) for cell in wall(world, side, 1)]
    if name == "each_wall":
        assert context.me is not None, "internal: each_wall places a group"
        return wall(world, SIDES[context.me.index % 4], *(arguments or [1]))
    tests = {
        "anywhere": lambda cell: True,
        "nowhere": lambda cell: False,
        "left_half": lambda cell: cell[0] < world.width // 2,
        "right_half": lambda cell: cell[0] > world.width // 2,
        "top_half": lambda cell: cell[1] < world.height // 2,
        "bottom_half": lambda cell: cell[1] > world.height // 2,
        "column": lambda cell: cell[0] in as_list(arguments[0]),
        "row": lambda cell: cell[1] in as_list(arguments[0]),
        "rect": lambda cell: (
            arguments[0] <= cell[0] <= arguments[2] and arguments[1] <= cell[1] <= arguments[3]
        ),
        "next_to": lambda cell: geometry.next_to(world, cell, arguments[0]),
        "in_front_of": lambda cell: geometry.in_front_of(world, cell, arguments[0]),
        "on": lambda cell: geometry.at(world, cell, arguments[0]),
    }
    # A row, a column or a rectangle is all of it; of other regions only the floor counts.
    whole = name in ("row", "column", "rect") or (context.setup is not None and context.setup.building)
    ground = [cell for cell in world.interior() if whole or cell not in world.terrain]
    return [cell for cell in ground if tests[name](cell)]


def wall(world: World, side: str, margin: int) -> list[Cell]:
    """The cells of a wall at least `margin` cells from each corner cell."""
    if side in ("top", "bottom"):
        y = 0 if side == "top" else world.height - 1
        return [(x, y) for x in range(margin, world.width - margin)]
    x = 0 if side == "left" else world.width - 1
    return [(x, y) for y in range(margin, world.height - margin)]
