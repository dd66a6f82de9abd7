"""The agent's picture: a gather of 49 cells through a table by pose."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.entities import field, npc_at, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.pointers import uint16_of
from socialai_dsl.engine.shadows import light_next, look_around
from socialai_dsl.engine.state import AGENT, ONE, Book, Link, Row, Trait
from socialai_dsl.program import (
    CODES_OF_TYPES,
    LAST_ACTS,
    NO_GESTURE,
    VIEW,
    Body,
    Field,
    Flag,
    Header,
    pack_cell,
)

CELLS: Final = VIEW * VIEW
OWN_PLACE: Final = (VIEW // 2) * VIEW + VIEW - 1
"""Where the agent is in the picture: image[3, 6]."""

OWN_LOOK = pack_cell(1)
_NPC = CODES_OF_TYPES["npc"]
_HALF = np.int64(VIEW // 2)
_WITH_GESTURES = 6
_WORDS_OF_ACTS = {
    Body.FORWARD: "forward",
    Body.LEFT: "left",
    Body.RIGHT: "right",
    Body.TOGGLE: "toggle",
    Body.POINT: "point",
    Body.STOP_POINTING: "stop",
}
_ACTS = tuple(LAST_ACTS[_WORDS_OF_ACTS.get(body, "none")] for body in Body)
"""The code in the sixth channel for each `Body`."""


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
def image_digest(image: NDArray[np.uint32], extra: NDArray[np.uint16], gestures: int) -> np.uint64:
    """A number that tells pictures apart; two of a billion different ones are alike with probability 3 per cent."""
    digest = np.uint64(0)
    for i in range(CELLS):
        digest = (digest ^ np.uint64(image[i])) * rng.GOLDEN
        digest ^= digest >> np.uint64(32)
    for i in range(gestures):
        digest = (digest ^ np.uint64(extra[i])) * rng.GOLDEN
        digest ^= digest >> np.uint64(32)
    return rng.mix(digest)


@inline
def take_picture(row: Row, link: int, book: Any, number: int) -> None:
    """Write what the agent, in row `number` of the book, sees; its own cell reads empty."""
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
        if row.program[Header.FLAGS] & (Flag.EGOCENTRIC | Flag.OCCLUSION):
            if row.program[Header.FLAGS] & Flag.OCCLUSION:
                _hide_unlit(row, x, y, field(row, AGENT, Field.DIR))
            if row.program[Header.FLAGS] & Flag.EGOCENTRIC:
                _turn_npcs(row, field(row, AGENT, Field.DIR))
    row.image[OWN_PLACE] = OWN_LOOK
    if row.program[Header.FLAGS] & Trait.GESTURES:
        _take_gestures(row, link, uint16_of(book, Book.EXTRA, number))


@outline
def _hide_unlit(row: Row, x: int, y: int, direction: int) -> None:
    """Let cells that no light reaches the agent from read 0, which is unseen."""
    stay_outline()
    look_around(row)
    lit = ONE << _HALF
    for ahead in range(VIEW):
        lit = light_next(row, x, y, direction, _HALF, lit)
        for i in range(VIEW):
            if (lit >> i) & 1 == 0:
                row.image[i * VIEW + VIEW - 1 - ahead] = 0
        lit >>= 32
        x += step_x(direction)
        y += step_y(direction)


@outline
def _turn_npcs(row: Row, direction: int) -> None:
    """Show the directions of NPCs relative to the agent's: 0 the opposite, 2 the same."""
    stay_outline()
    for i in range(CELLS):
        look = row.image[i]
        if look & 0xFF == _NPC:
            row.image[i] = (look & 0xFFFFFF) | (((look >> 24) - direction + 2) & 3) << 24


@outline
def _take_gestures(row: Row, link: int, extra: NDArray[np.uint16]) -> None:
    """Write where the NPCs in the picture point and what they did last, if the program shows it."""
    stay_outline()
    width = row.program[Header.CANVAS_WIDTH]
    own = field(row, AGENT, Field.DIR)
    pose = (field(row, AGENT, Field.Y) * width + field(row, AGENT, Field.X)) * 4 + own
    view = (row.program[link + Link.VIEWS] + pose) * CELLS
    for i in range(CELLS):
        extra[i] = NO_GESTURE << 8 | NO_GESTURE
        if row.program[Header.CHANNELS] == _WITH_GESTURES and row.image[i] & 0xFF == _NPC:
            cell = np.int64(row.views[view + i])
            npc = npc_at(row, cell % width, cell // width)
            if npc > 0:
                extra[i] = _gesture(row, npc, own)


@inline
def _gesture(row: Row, npc: int, own: int) -> int:
    """Where an NPC points, and its last act << 8."""
    pointing = np.int64(NO_GESTURE)
    act = _ACTS[field(row, npc, Field.LAST)]
    if field(row, npc, Field.POINTING) > 0:
        pointing = field(row, npc, Field.POINTING) - 1
        if row.program[Header.FLAGS] & Flag.EGOCENTRIC:
            pointing = (pointing - own + 2) & 3
        if field(row, npc, Field.LAST) == Body.POINT:
            act += pointing
    return act << 8 | pointing
