"""The agent's picture: a gather of 49 cells through a table by pose."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.entities import field, npc_at, step_x, step_y
from socialai_dsl.engine.gather import PERMUTES, permute
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.pointers import uint16_of
from socialai_dsl.engine.shadows import lit_cells, look_around
from socialai_dsl.engine.state import AGENT, NOTHING, Book, Link, Row, Trait
from socialai_dsl.engine.views import CELLS
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
        if PERMUTES and row.program[Header.FLAGS] & Trait.SMALL:
            permute(row.image, row.board, row.views, view)
        else:
            for i in range(CELLS):
                row.image[i] = row.board[row.views[view + i]]
        if row.program[Header.FLAGS] & (Flag.EGOCENTRIC | Flag.OCCLUSION):
            if row.program[Header.FLAGS] & Flag.OCCLUSION:
                _hide_unlit(row, x, y, field(row, AGENT, Field.DIR))
            if row.program[Header.FLAGS] & Flag.EGOCENTRIC:
                _turn_npcs(row, field(row, AGENT, Field.DIR))
    row.image[OWN_PLACE] = OWN_LOOK
    if row.program[Header.FLAGS] & Trait.GESTURES:
        _take_gestures(row, uint16_of(book, Book.EXTRA, number), uint16_of(book, Book.PICTURE, number))


@outline
def _hide_unlit(row: Row, x: int, y: int, direction: int) -> None:
    """Let cells that no light reaches the agent from read 0, which is unseen."""
    stay_outline()
    look_around(row)
    lit = lit_cells(row, x, y, direction)
    for i in range(CELLS):
        row.image[i] &= np.int64(-((lit >> np.uint64(i)) & np.uint64(1)))


@inline
def _place_in_picture(row: Row, npc: int) -> int:
    """Where the picture shows an NPC, -1 if nowhere: it may be out of view, hidden, or behind another in its cell."""
    direction = field(row, AGENT, Field.DIR)
    x = field(row, npc, Field.X)
    y = field(row, npc, Field.Y)
    dx = x - field(row, AGENT, Field.X)
    dy = y - field(row, AGENT, Field.Y)
    ahead = dx * step_x(direction) + dy * step_y(direction)
    right = dy * step_x(direction) - dx * step_y(direction)
    if ahead < 0 or ahead >= VIEW or abs(right) > _HALF:
        return NOTHING
    place = (right + _HALF) * VIEW + VIEW - 1 - ahead
    shown = row.image[place] & 0xFF == _NPC and npc_at(row, x, y) == npc
    return place if shown else NOTHING


@outline
def _turn_npcs(row: Row, direction: int) -> None:
    """Show the directions of NPCs relative to the agent's: 0 the opposite, 2 the same."""
    stay_outline()
    for npc in range(1, row.program[Header.NPCS] + 1):
        place = _place_in_picture(row, npc)
        if place >= 0:
            look = row.image[place]
            row.image[place] = (look & 0xFFFFFF) | (((look >> 24) - direction + 2) & 3) << 24


@outline
def _take_gestures(row: Row, extra: NDArray[np.uint16], picture: NDArray[np.uint16]) -> None:
    """Write where the NPCs in the picture point and what they did last, if the program shows it, then all channels."""
    stay_outline()
    for i in range(CELLS):
        extra[i] = NO_GESTURE << 8 | NO_GESTURE
    if row.program[Header.CHANNELS] == _WITH_GESTURES:
        for npc in range(1, row.program[Header.NPCS] + 1):
            place = _place_in_picture(row, npc)
            if place >= 0:
                extra[place] = _gesture(row, npc, field(row, AGENT, Field.DIR))
    for i in range(CELLS):
        picture[3 * i] = row.image[i]
        picture[3 * i + 1] = row.image[i] >> 16
        picture[3 * i + 2] = extra[i]


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
