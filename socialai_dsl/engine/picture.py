"""The picture of each seat: a gather of 49 cells through a table by pose."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine import rng
from socialai_dsl.engine.boards import npcs_are_hidden, object_look
from socialai_dsl.engine.carrying import carried_by
from socialai_dsl.engine.entities import column, field, is_at, is_present, npc_at, quadrant, step_x, step_y
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.pointers import bytes_of, uint16_of, uint32_of
from socialai_dsl.engine.seats import seat_word, seats_played
from socialai_dsl.engine.shadows import lit_cells
from socialai_dsl.engine.state import AGENT, NOTHING, ONE, ArrayId, Link, Row, Trait
from socialai_dsl.engine.views import CELLS, OWN_LOOK, OWN_PLACE
from socialai_dsl.program import (
    CELL,
    LAST_ACTS,
    NO_GESTURE,
    POINTING_HERE,
    VIEW,
    Body,
    EntityColumn,
    Field,
    Flag,
    Header,
    SeatColumn,
)
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
def take_pictures(row: Row, link: int, book: Any, number: int) -> None:
    """Write what the players of all seats see; the agent is in row `number` of the book, the others follow."""
    _take_picture(row, link, book, number, AGENT)
    if row.program[Header.FLAGS] & Flag.SEATS:
        for seat in range(1, seats_played(row)):
            _take_picture_of(row, link, book, number, seat)


@outline
def _take_picture_of(row: Row, link: int, book: Any, number: int, seat: int) -> None:
    """Of a seat other than the agent's; its own cell tells which one it is, unless that is hidden."""
    stay_outline()
    _take_picture(row, link, book, number + seat, seat_word(row, seat, SeatColumn.ENTITY))
    if row.program[Header.FLAGS] & Flag.SEATS_HIDDEN:
        return
    image = uint32_of(book, ArrayId.IMAGE, number + seat)
    image[OWN_PLACE] = (image[OWN_PLACE] & 0xFFFFFF) | seat << 24
    if row.program[row.program[Header.SIZE] + Link.MORE] > 0:
        picture = bytes_of(book, ArrayId.PICTURE, number + seat)
        picture[(4 + row.program[link + Link.MORE]) * OWN_PLACE + 3] = seat


@inline
def _take_picture(row: Row, link: int, book: Any, number: int, viewer: int) -> None:
    """Write what a member of the cast sees into a row; its own cell shows what it carries, or reads empty."""
    flags = row.program[Header.FLAGS]
    image = uint32_of(book, ArrayId.IMAGE, number)
    x = field(row, viewer, Field.X)
    y = field(row, viewer, Field.Y)
    if not is_present(row, viewer):
        for i in range(CELLS):
            image[i] = row.program[Header.OUTSIDE]
        image[OWN_PLACE] = OWN_LOOK
    else:
        lit = _EVERYWHERE
        if flags & Flag.OCCLUSION:
            lit = lit_cells(row, x, y, field(row, viewer, Field.DIR))
        pose = (y * row.program[Header.CANVAS_WIDTH] + x) * 4 + field(row, viewer, Field.DIR)
        view = uint16_of(book, ArrayId.VIEWS, row.program[link + Link.VIEWS] + pose)
        _gather(row, view, lit, image)
        if viewer != AGENT:
            _show_agent(row, image, viewer)
    if flags & Flag.CARRYING:
        carried = carried_by(row, viewer)
        if carried != 0:
            image[OWN_PLACE] = object_look(row, carried)
    if flags & Trait.MORE:
        extra = bytes_of(book, ArrayId.EXTRA, number)
        _show_more(row, link, viewer, image, extra, bytes_of(book, ArrayId.PICTURE, number))
    elif flags & (Flag.EGOCENTRIC | Trait.GESTURES):
        words = uint16_of(book, ArrayId.EXTRA, number)
        _show_npcs(row, viewer, image, words, uint16_of(book, ArrayId.PICTURE, number))


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
def _show_agent(row: Row, image: NDArray[np.uint32], viewer: int) -> None:
    """Show the agent, which is not on the board, where another one sees it."""
    place = _place_in_view(row, viewer, AGENT)
    if place >= 0 and place != OWN_PLACE and image[place] != 0 and is_shown(row, AGENT):
        kind = column(row, AGENT, EntityColumn.KIND)
        color = field(row, AGENT, Field.COLOR)
        image[place] = NPC | color << 8 | kind << 16 | field(row, AGENT, Field.DIR) << 24


@inline
def is_shown(row: Row, member: int) -> bool:
    """Whether players see a member of the cast where it is lit."""
    return is_present(row, member) and not npcs_are_hidden(row)


@inline
def _place_in_view(row: Row, viewer: int, thing: int) -> int:
    """Where in the picture something would be seen if nothing was in the way, -1 if it is out of view."""
    direction = field(row, viewer, Field.DIR)
    dx = field(row, thing, Field.X) - field(row, viewer, Field.X)
    dy = field(row, thing, Field.Y) - field(row, viewer, Field.Y)
    ahead = dx * step_x(direction) + dy * step_y(direction)
    right = dy * step_x(direction) - dx * step_y(direction)
    # One test instead of three: positions are as good as random, so each branch on them is often mispredicted.
    if (ahead < 0) | (ahead >= VIEW) | (abs(right) > _HALF):
        return NOTHING
    return (right + _HALF) * VIEW + VIEW - 1 - ahead


@outline
def _show_npcs(
    row: Row, viewer: int, image: NDArray[np.uint32], extra: NDArray[np.uint16], picture: NDArray[np.uint16]
) -> None:
    """Show which way NPCs look relative to the viewer, where they point and what they did last, as far as shown.

    Then all channels are in `picture`. Whether the picture shows an NPC, which may be in the dark, hidden, or behind
    another in its cell, is known late, so nothing branches on it.
    """
    stay_outline()
    flags = row.program[Header.FLAGS]
    if flags & Trait.GESTURES:
        for i in range(CELLS):
            extra[i] = NO_GESTURE << 8 | NO_GESTURE
        _put_together(image, picture)
    own = field(row, viewer, Field.DIR)
    for npc in range(_first_seen(viewer), row.program[Header.NPCS] + 1):
        place = _place_in_view(row, viewer, npc)
        if place < 0 or not _is_in_front(row, viewer, npc):
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


@inline
def _first_seen(viewer: int) -> int:
    """The first member of the cast that is shown as an NPC: nobody sees oneself."""
    return ONE if viewer == AGENT else AGENT


@inline
def _is_in_front(row: Row, viewer: int, npc: int) -> bool:
    """Whether a member is the first in its cell, the one that a viewer sees of several."""
    x = field(row, npc, Field.X)
    y = field(row, npc, Field.Y)
    if viewer == AGENT:
        return npc_at(row, x, y) == npc
    if is_at(row, AGENT, x, y):
        return npc == AGENT
    return npc != viewer and npc_at(row, x, y) == npc


@outline
def _show_more(
    row: Row,
    link: int,
    viewer: int,
    image: NDArray[np.uint32],
    extra: NDArray[np.uint8],
    picture: NDArray[np.uint8],
) -> None:
    """As `_show_npcs`, where pictures of the batch also show which cells NPCs point at, what they carry, or looks."""
    stay_outline()
    flags = row.program[Header.FLAGS]
    gestures = (2 if flags & Trait.GESTURES else 0) + (2 if flags & Trait.CELLS else 0)
    more = row.program[link + Link.MORE]
    for i in range(more * CELLS):
        extra[i] = NO_GESTURE
    _show_looks_of_objects(row, link, viewer, image, extra)
    own = field(row, viewer, Field.DIR)
    for npc in range(_first_seen(viewer), row.program[Header.NPCS] + 1):
        place = _place_in_view(row, viewer, npc)
        if place < 0 or not _is_in_front(row, viewer, npc):
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
def _show_looks_of_objects(
    row: Row, link: int, viewer: int, image: NDArray[np.uint32], extra: NDArray[np.uint8]
) -> None:
    """Show the looks of objects that the picture shows: of several in a cell the last, which lies on top."""
    if row.program[link + Link.LOOKS] == 0:
        return
    carried = carried_by(row, viewer)
    if not is_present(row, viewer):
        if carried != 0:  # who has gone still sees what it carries
            _show_looks(row, link, extra, OWN_PLACE, carried)
        return
    for entity in range(row.program[Header.NPCS] + 1, row.program[Header.ENTITIES]):
        place = _place_in_view(row, viewer, entity)
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
