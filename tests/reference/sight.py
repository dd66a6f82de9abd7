"""What light reaches: the usual shadow casting of grid worlds, row by row away from the eye."""

from __future__ import annotations

from tests.reference.world import AHEAD, Cell, World


def cell_in_view(eye: Cell, facing: str, ahead: int, right: int) -> Cell:
    """The cell so far ahead of an eye and so far to its right."""
    fx, fy = AHEAD[facing]
    return eye[0] + ahead * fx - right * fy, eye[1] + ahead * fy + right * fx


def see_through(world: World, cell: Cell) -> bool:
    """Whether light passes. Beyond the room is nothing, as far as the canvas goes."""
    if world.inside(cell):
        return world.transparent(cell)
    return 0 <= cell[0] < world.canvas[0] and 0 <= cell[1] < world.canvas[1]


def lit(world: World, eye: Cell, facing: str, view: int) -> set[tuple[int, int]]:
    """The visible cells of a view square, as (ahead, right): a visible cell that is transparent lights its neighbour
    to the side and the two cells ahead of both, first to the right, then to the left."""
    half = view // 2
    bright = {(0, 0)}
    for ahead in range(view):
        for side in (1, -1):
            for right in range(-half * side, half * side, side):
                dark = (ahead, right) not in bright
                if dark or not see_through(world, cell_in_view(eye, facing, ahead, right)):
                    continue
                bright |= {(ahead, right + side), (ahead + 1, right), (ahead + 1, right + side)}
    return {(ahead, right) for ahead, right in bright if ahead < view}
