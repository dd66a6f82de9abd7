"""The table by which the agent's picture is gathered from the board."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import VIEW, pack_cell

CELLS: Final = VIEW * VIEW

OWN_PLACE: Final = (VIEW // 2) * VIEW + VIEW - 1
"""Where the agent is in the picture: image[3, 6]."""

OWN_LOOK: Final = pack_cell(1)
"""What its own cell reads."""


def view_table(width: int, height: int) -> NDArray[np.uint16]:
    """The cell of the board for each cell of the picture, (height * width * 4, 49) by (y, x, direction).

    image[i, j] shows the cell 6 - j ahead and i - 3 to the right of the agent; cell width * height is off the canvas.
    """
    y, x, direction, i, j = np.ogrid[:height, :width, :4, :VIEW, :VIEW]
    ahead, right = VIEW - 1 - j, i - VIEW // 2
    ahead_x, ahead_y = (1 - direction) * (1 - direction % 2), (2 - direction) * (direction % 2)
    # The right-hand side of (dx, dy) is (-dy, dx), because y grows downwards.
    seen_x = x + ahead * ahead_x - right * ahead_y
    seen_y = y + ahead * ahead_y + right * ahead_x
    on_canvas = (seen_x >= 0) & (seen_x < width) & (seen_y >= 0) & (seen_y < height)
    cells = np.where(on_canvas, seen_y * width + seen_x, width * height)
    return cells.reshape(-1, CELLS).astype(np.uint16)
