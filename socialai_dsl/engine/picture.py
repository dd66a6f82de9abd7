"""The agent's picture: a gather of 49 cells through a table by pose."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.boards import object_look
from socialai_dsl.engine.carrying import carried_by
from socialai_dsl.engine.entities import field, is_present, npc_at, quadrant, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.pointers import bytes_of, uint16_of, uint32_of
from socialai_dsl.engine.shadows import lit_cells
from socialai_dsl.engine.state import AGENT, NOTHING, ArrayId, Link, Row, Trait
from socialai_dsl.engine.views import CELLS, OWN_LOOK, OWN_PLACE
from socialai_dsl.program import CELL, LAST_ACTS, NO_GESTURE, POINTING_HERE, VIEW, Body, Field, Flag, Header
from socialai_dsl.vocabulary import NPC

_HALF = np.int64(VIEW // 2)
_EVERYWHERE = np.uint64((1 << 64) - 1)
_WITH_GESTURES = 6
_WITH_CELLS = 8
_ACTS = tuple(LAST_ACTS.get(body.name.lower().removesuffix("_pointing"), LAST_ACTS["none"]) for body in Body)
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
    """Write what the agent, in row `number` of the book, sees; its own cell shows what it carries, or reads empty."""
    flags = row.program[Header.FLAGS]
    image = uint32_of(book, ArrayId.IMAGE, number)
    x = field(row, AGENT, Field.X)
    y = field(row, AGENT, Field.Y)
    if x < 0:
        for i in range(CELLS):
            image[i] = row.program[Header.OUTSIDE]
        image[OWN_PLACE] = OWN_LOOK
    else:
        lit = _EVERYWHERE
        if flags & Flag.OCCLUSION:
            lit = lit_cells(row, x, y, field(row, AGENT, Field.DIR))
        pose = (y * row.program[Header.CANVAS_WIDTH] + x) * 4 + field(row, AGENT, Field.DIR)
        view = uint16_of(book, ArrayId.VIEWS, row.program[link + Link.VIEWS] + pose)
        _gather(row, view, lit, image)
    if flags & Flag.CARRYING:
        carried = carried_by(row, AGENT)
        if carried != 0:
            image[OWN_PLACE] = object_look(row, carried)
    if flags & Trait.MORE:
        _show_more(
            row, link, image, bytes_of(book, ArrayId.EXTRA, number), bytes_of(book, ArrayId.PICTURE, number)
        )
    elif flags & (Flag.EGOCENTRIC | Trait.GESTURES):
        _show_npcs(
            row, image, uint16_of(book, ArrayId.EXTRA, number), uint16_of(book, ArrayId.PICTURE, number)
        )


@inline
def _gather(row: Row, view: NDArray[np.uint16], lit: np.uint64, image: NDArray[np.uint32]) -> None:
    """Write the cells of the board that a row of the table of views names; what is not lit reads 0, which is unseen."""
    for i in range(CELLS):
        image[i] = row.board[view[i]]
    if lit != _EVERYWHERE:
        for i in range(CELLS):
            image[i] &= np.int64(-((lit >> np.uint64(i)) & np.uint64(1)))
    image[OWN_PLACE] = OWN_LOOK


@inline
def _place_in_view(row: Row, npc: int) -> int:
    """Where in the picture an NPC would be seen if nothing was in the way, -1 if it is out of view."""
    direction = field(row, AGENT, Field.DIR)
    dx = field(row, npc, Field.X) - field(row, AGENT, Field.X)
    dy = field(row, npc, Field.Y) - field(row, AGENT, Field.Y)
    ahead = dx * step_x(direction) + dy * step_y(direction)
    right = dy * step_x(direction) - dx * step_y(direction)
    # One test instead of three: positions are as good as random, so each branch on them is often mispredicted.
    if (ahead < 0) | (ahead >= VIEW) | (abs(right) > _HALF):
        return NOTHING
    return (right + _HALF) * VIEW + VIEW - 1 - ahead


@outline
def _show_npcs(
    row: Row, image: NDArray[np.uint32], extra: NDArray[np.uint16], picture: NDArray[np.uint16]
) -> None:
    """Show which way NPCs look relative to the agent, where they point and what they did last, as far as shown.

    Then all channels are in `picture`. Whether the picture shows an NPC, which may be in the dark, hidden, or behind
    another in its cell, is known late, so nothing branches on it.
    """
    stay_outline()
    flags = row.program[Header.FLAGS]
    if flags & Trait.GESTURES:
        for i in range(CELLS):
            extra[i] = NO_GESTURE << 8 | NO_GESTURE
        _put_together(image, picture)
    own = field(row, AGENT, Field.DIR)
    for npc in range(1, row.program[Header.NPCS] + 1):
        place = _place_in_view(row, npc)
        if place < 0 or npc_at(row, field(row, npc, Field.X), field(row, npc, Field.Y)) != npc:
            continue
        look = image[place]
        shown = -np.int64(look & 0xFF == NPC)
        if flags & Flag.EGOCENTRIC:
            turned = (look & 0xFFFFFF) | _relative(look >> 24, own) << 24
            look ^= (look ^ turned) & shown
            image[place] = look
        if flags & Trait.GESTURES:
            gesture = np.int64(NO_GESTURE << 8 | NO_GESTURE)
            if row.program[Header.CHANNELS] == _WITH_GESTURES:
                gesture ^= (gesture ^ _gesture(row, npc, own)) & shown
            extra[place] = gesture
            picture[3 * place] = look
            picture[3 * place + 1] = look >> 16
            picture[3 * place + 2] = gesture


@outline
def _show_more(
    row: Row, link: int, image: NDArray[np.uint32], extra: NDArray[np.uint8], picture: NDArray[np.uint8]
) -> None:
    """As `_show_npcs`, where pictures of the batch also show which cells NPCs point at, what they carry, or looks."""
    stay_outline()
    flags = row.program[Header.FLAGS]
    gestures = (2 if flags & Trait.GESTURES else 0) + (2 if flags & Trait.CELLS else 0)
    more = row.program[link + Link.MORE]
    for i in range(more * CELLS):
        extra[i] = NO_GESTURE
    _show_looks_of_objects(row, link, image, extra)
    own = field(row, AGENT, Field.DIR)
    for npc in range(1, row.program[Header.NPCS] + 1):
        place = _place_in_view(row, npc)
        if place < 0 or npc_at(row, field(row, npc, Field.X), field(row, npc, Field.Y)) != npc:
            continue
        look = image[place]
        if look & 0xFF != NPC:
            continue
        if flags & Flag.EGOCENTRIC:
            image[place] = (look & 0xFFFFFF) | _relative(look >> 24, own) << 24
        shows = np.int64(flags & Flag.SHOWS_CARRYING != 0)
        if row.program[Header.CHANNELS] - shows >= _WITH_GESTURES:
            gesture = _gesture(row, npc, own)
            extra[more * place] = gesture & 0xFF
            extra[more * place + 1] = gesture >> 8
        if row.program[Header.CHANNELS] - shows == _WITH_CELLS and field(row, npc, Field.POINTING) >= CELL:
            dx, dy = _way_to_cell(row, npc)
            extra[more * place + 2] = POINTING_HERE + dy * step_x(own) - dx * step_y(own)
            extra[more * place + 3] = POINTING_HERE + dx * step_x(own) + dy * step_y(own)
        carried = carried_by(row, npc)
        if shows and carried != 0:
            look = object_look(row, carried)
            extra[more * place + gestures] = (look & 0xFF) | (look >> 8 & 0xFF) << 5
        _show_looks(row, link, extra, place, npc)
    # The commonest numbers, written out: loops with constant bounds are unrolled.
    if more == 1:
        _join(image, extra, picture, 1)
    elif more == 2:
        _join(image, extra, picture, 2)
    else:
        _join(image, extra, picture, more)


@inline
def _join(image: NDArray[np.uint32], extra: NDArray[np.uint8], picture: NDArray[np.uint8], more: int) -> None:
    """Write the channels of `image` and `extra` side by side."""
    for i in range(CELLS):
        place = (4 + more) * i
        look = image[i]  # read once: the compiler does not know that `picture` is no part of it
        for k in range(4):
            picture[place + k] = look >> 8 * k & 0xFF
        for k in range(more):
            picture[place + 4 + k] = extra[more * i + k]


@inline
def _show_looks_of_objects(row: Row, link: int, image: NDArray[np.uint32], extra: NDArray[np.uint8]) -> None:
    """Show the looks of objects that the picture shows: of several in a cell the last, which lies on top."""
    if row.program[link + Link.LOOKS] == 0 or field(row, AGENT, Field.X) < 0:
        return
    carried = carried_by(row, AGENT)
    for entity in range(row.program[Header.NPCS] + 1, row.program[Header.ENTITIES]):
        place = _place_in_view(row, entity)
        if entity == carried:
            _show_looks(row, link, extra, OWN_PLACE, entity)
        elif (
            place >= 0
            and place != OWN_PLACE
            and is_present(row, entity)
            and _shows(row, image, place, entity)
        ):
            _show_looks(row, link, extra, place, entity)


@inline
def _shows(row: Row, image: NDArray[np.uint32], place: int, entity: int) -> bool:
    """Whether the picture shows the type of an object; an NPC may stand before it, or it may lie in the dark."""
    return (image[place] ^ object_look(row, entity)) & 0xFF == 0


@inline
def _show_looks(row: Row, link: int, extra: NDArray[np.uint8], place: int, entity: int) -> None:
    """Show the looks of what is seen at a place of the picture."""
    looks, more = row.program[link + Link.LOOKS], row.program[link + Link.MORE]
    base = row.program[link + Link.LOOK_REGISTER_AT] + looks * entity
    for k in range(looks):
        register = row.program[base + k]
        shown = row.registers[register] if register != 0 else np.int64(NO_GESTURE)
        extra[more * place + row.program[row.program[link + Link.LOOK_AT] + k]] = shown


@inline
def _put_together(image: NDArray[np.uint32], picture: NDArray[np.uint16]) -> None:
    """Write the six channels of a picture in which nobody points or did anything."""
    for i in range(CELLS):
        picture[3 * i] = image[i]
        picture[3 * i + 1] = image[i] >> 16
        picture[3 * i + 2] = NO_GESTURE << 8 | NO_GESTURE


@inline
def _relative(direction: int, own: int) -> int:
    """A direction as it is seen by one who looks in another: 0 the opposite, 2 the same."""
    return (direction - own + 2) & 3


@inline
def _gesture(row: Row, npc: int, own: int) -> int:
    """Where an NPC points, and its last act << 8."""
    pointing = np.int64(NO_GESTURE)
    act = _ACTS[field(row, npc, Field.LAST)]
    if field(row, npc, Field.POINTING) > 0:
        if field(row, npc, Field.POINTING) >= CELL:
            dx, dy = _way_to_cell(row, npc)
            pointing = quadrant(dx, dy)
        else:
            pointing = field(row, npc, Field.POINTING) - 1
        if row.program[Header.FLAGS] & Flag.EGOCENTRIC:
            pointing = _relative(pointing, own)
        if field(row, npc, Field.LAST) == Body.POINT:
            act += pointing
    return act << 8 | pointing


@inline
def _way_to_cell(row: Row, npc: int) -> tuple[int, int]:
    """How far to the right and down of an NPC the cell lies that it points at."""
    cell = field(row, npc, Field.POINTING) - CELL
    return (cell & 31) - field(row, npc, Field.X), (cell >> 5) - field(row, npc, Field.Y)
