"""The agent's picture: a gather of 49 cells through a table by pose."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.entities import field
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import AGENT, Link, Row
from socialai_dsl.program import CODES_OF_TYPES, VIEW, Field, Flag, Header, pack_cell

CELLS: Final = VIEW * VIEW
OWN_PLACE: Final = (VIEW // 2) * VIEW + VIEW - 1
"""Where the agent is in the picture: image[3, 6]."""

OWN_LOOK = pack_cell(1)
_NPC = CODES_OF_TYPES["npc"]


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


@inline
def image_digest(image: NDArray[np.uint32]) -> np.uint64:
    """A number that tells pictures apart; two of a billion different ones are alike with probability 3 per cent."""
    digest = np.uint64(0)
    for i in range(CELLS):
        digest = (digest ^ np.uint64(image[i])) * rng.GOLDEN
        digest ^= digest >> np.uint64(32)
    return rng.mix(digest)


@inline
def take_picture(row: Row, link: int) -> None:
    """Write what the agent sees; its own cell reads empty."""
    x = field(row, AGENT, Field.X)
    y = field(row, AGENT, Field.Y)
    if x < 0:
        for i in range(CELLS):
            row.image[i] = row.program[Header.OUTSIDE]
    else:
        pose = (y * row.program[Header.CANVAS_WIDTH] + x) * 4 + field(row, AGENT, Field.DIR)
        view = (row.program[link + Link.VIEWS] + pose) * CELLS
        for i in range(CELLS):
            row.image[i] = row.board[row.views[view + i]]
        if row.program[Header.FLAGS] & Flag.EGOCENTRIC:
            _turn_npcs(row, field(row, AGENT, Field.DIR))
    row.image[OWN_PLACE] = OWN_LOOK


@outline
def _turn_npcs(row: Row, direction: int) -> None:
    """Show the directions of NPCs relative to the agent's: 0 the opposite, 2 the same."""
    stay_outline()
    for i in range(CELLS):
        look = row.image[i]
        if look & 0xFF == _NPC:
            row.image[i] = (look & 0xFFFFFF) | (((look >> 24) - direction + 2) & 3) << 24
