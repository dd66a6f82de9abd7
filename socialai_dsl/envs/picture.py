"""A row of a table as a picture: the room from above, as RGB or as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from socialai_dsl.envs.render import draw_ansi, draw_grid
from socialai_dsl.envs.table import Table
from socialai_dsl.program import VIEW, Header


def frame(table: Table, row: int, mode: str, tile: int = 32) -> Any:
    """uint8 (H * tile, W * tile, 3) for rgb_array, a text for ansi."""
    codes, agent = table.cells(row)
    width, height = table.room(row)
    if mode == "ansi":
        return draw_ansi(codes[:height, :width], agent)
    return draw_grid(codes[:height, :width], agent, _seen(table, row, agent)[:height, :width], tile)


def _seen(table: Table, row: int, agent: tuple[int, int, int]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Which cells of the canvas lie in the agent's field of view, bool (H, W)."""
    program = table.program(row)
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    x, y, direction = agent
    ys, xs = np.mgrid[:height, :width]
    dx, dy = xs - x, ys - y
    ahead_x, ahead_y = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    ahead, aside = dx * ahead_x + dy * ahead_y, -dx * ahead_y + dy * ahead_x
    seen: np.ndarray[Any, np.dtype[np.bool_]] = (ahead >= 0) & (ahead < VIEW) & (abs(aside) <= VIEW // 2)
    return seen
