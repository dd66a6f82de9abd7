"""The room as pictures and text, without a display."""

from collections.abc import Container, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.library import types_by_code
from socialai_dsl.render import tiles
from socialai_dsl.render.figures import Ray
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.marks import Marks, mark_words
from socialai_dsl.render.tiles import PALETTE, SEEN_LINE, Code, draw_tile
from socialai_dsl.vocabulary import COLORS

_ARROWS: Final = ">v<^"
_ANSI_COLOURS: Final = (31, 32, 34, 35, 33, 37)
_SEEN_GROUND: Final = ";48;5;237"
_RESET: Final = "\x1b[0m"
_COLOUR_LETTERS: Final = "rgbpye"
_LETTERS: Final = {tiles.UNSEEN: " ", tiles.EMPTY: "."}
"""Letters of what is of no object type; the others have theirs in the prelude."""


def draw_grid(
    codes: NDArray[np.uint8],
    agent: tuple[int, int, int],
    seen: NDArray[np.bool_] | None = None,
    tile: int = 32,
    below: Mapping[tuple[int, int], Code] | None = None,
    gestures: Mapping[tuple[int, int], Gesture] | None = None,
    held: Mapping[tuple[int, int], Code] | None = None,
    marks: Mapping[tuple[int, int], Marks] | None = None,
) -> NDArray[np.uint8]:
    """Draw the room from above.

    Args:
        codes: uint8 (H, W, 4), each cell's (type, colour, status, orientation) as in the observation.
        agent: (x, y, direction); x to the right, y down, direction 0 right, 1 down, 2 left, 3 up.
        seen: bool (H, W), the cells in the agent's field of view, tinted and outlined; None marks nothing.
        tile: side of a cell in pixels.
        below: (x, y) -> what lies under the member there, such as a doorway.
        gestures: (x, y) -> where the NPC there points and what it did last.
        held: (x, y) -> what the agent or the NPC there carries.
        marks: (x, y) -> the looks of what is seen there; where the agent stands, of what it carries.

    Returns:
        uint8 (H * tile, W * tile, 3).

    Raises:
        ValueError: a shape does not fit.
    """
    _check(codes, seen)
    height, width = codes.shape[:2]
    x, y, direction = agent
    rows = []
    for row in range(height):
        cells = []
        for column in range(width):
            code = _code(codes, row, column)
            here = direction % 4 if (column, row) == (x, y) else None
            lit = bool(seen[row, column]) if seen is not None else False
            under = below.get((column, row)) if below else None
            gesture = gestures.get((column, row)) if gestures else None
            carried = held.get((column, row)) if held else None
            looks = marks.get((column, row), ()) if marks else ()
            crossing = _rays_at(column, row, codes, gestures or {})
            cells.append(draw_tile(code, here, lit, tile, under, gesture, carried, looks, crossing))
        rows.append(np.concatenate(cells, axis=1))
    picture = np.concatenate(rows, axis=0)
    if seen is not None:
        _outline(picture, seen, tile)
    return picture


def _rays_at(
    column: int, row: int, codes: NDArray[np.uint8], gestures: Mapping[tuple[int, int], Gesture]
) -> tuple[Ray, ...]:
    """The lines from NPCs to the cells that they point at, as far as they may come through a cell."""
    found: list[Ray] = []
    for (x, y), gesture in gestures.items():
        if gesture.cell is None or gesture.pointing is None:
            continue
        start = x - column, y - row
        end = start[0] + gesture.cell[0], start[1] + gesture.cell[1]
        if min(start[0], end[0]) <= 0 <= max(start[0], end[0]) and min(start[1], end[1]) <= 0 <= max(
            start[1], end[1]
        ):
            found.append((start, end, gesture.pointing, PALETTE[codes[y, x, 1] % len(PALETTE)]))
    return tuple(found)


def _outline(picture: NDArray[np.uint8], seen: NDArray[np.bool_], tile: int) -> None:
    """Draw a line inside the edge of what is seen, over walls as well, where a tint would not show."""
    width = max(1, tile // 16)
    padded = np.pad(seen, 1)
    height, columns = seen.shape
    cells = picture.reshape(height, tile, columns, tile, 3)
    left, right = slice(0, width), slice(tile - width, tile)
    # For each side where the neighbour is not seen: the pixels of a cell along that side.
    for open_side, down, across in (
        (~padded[1:-1, :-2], slice(None), left),
        (~padded[1:-1, 2:], slice(None), right),
        (~padded[:-2, 1:-1], left, slice(None)),
        (~padded[2:, 1:-1], right, slice(None)),
    ):
        for row, column in np.argwhere(seen & open_side):
            cells[row, down, column, across] = SEEN_LINE


def draw_ansi(
    codes: NDArray[np.uint8],
    agent: tuple[int, int, int],
    colour: bool = False,
    seen: NDArray[np.bool_] | None = None,
) -> str:
    """The room as text, two characters a cell.

    The agent and the NPCs show an arrow in their direction of gaze: the agent's stands alone, an NPC's
    follows the letter of its kind (`A` for kind 0). Objects have the first letter of their colour (`e` for
    grey) before their own: `gD` is a green closed door, `gL` a locked one, `g/` an open one, `g>` a marble that rolls
    to the right. With `colour`, escape codes show the colours as well, those of NPCs too, and cells of `seen`, bool
    (H, W), lie on a lighter ground.
    """
    _check(codes, seen)
    x, y, direction = agent
    lines = []
    for row in range(codes.shape[0]):
        cells = []
        for column in range(codes.shape[1]):
            code = _code(codes, row, column)
            ground = _SEEN_GROUND if seen is not None and seen[row, column] else ""
            if (column, row) == (x, y):
                cells.append(_paint(f" {_ARROWS[direction % 4]}", f"1;31{ground}", colour))
            elif code[0] == tiles.EMPTY:
                cells.append(_paint(" .", f"2{ground}", colour and bool(ground)))
            else:
                cells.append(_paint(_letters_of(code), f"{_ANSI_COLOURS[code[1] % 6]}{ground}", colour))
        lines.append("".join(cells))
    return "\n".join(lines)


def figures(
    codes: NDArray[np.uint8],
    gestures: Mapping[tuple[int, int], Gesture],
    places: Container[tuple[int, int]] | None = None,
    held: Mapping[tuple[int, int], Code] | None = None,
    marks: Mapping[tuple[int, int], Marks] | None = None,
) -> list[str]:
    """Further facts of NPCs, and of things that have looks, one line each in reading order: `A> 3,1 red, points down`.

    Args:
        codes: as for `draw_grid`.
        gestures: (x, y) -> where the NPC there points and what it did last.
        places: the cells of NPCs to be told of; None for all.
        held: (x, y) -> what the NPC there carries.
        marks: (x, y) -> the looks of what is seen there.
    """
    held, marks = held or {}, marks or {}
    lines = []
    for row, column in np.ndindex(codes.shape[:2]):
        code, looks = _code(codes, row, column), marks.get((column, row), ())
        said = [mark_words(looks)] if looks else []
        if code[0] == tiles.NPC:
            if not looks and places is not None and (column, row) not in places:
                continue
            gesture = gestures.get((column, row))
            said = [
                COLORS[code[1] % len(COLORS)],
                *([gesture.words] if gesture and gesture.words else []),
                *said,
            ]
            said += [f"carries {thing_words(held[column, row])}"] if (column, row) in held else []
        if said and code[0] not in (tiles.EMPTY, tiles.UNSEEN):
            lines.append(f"{_letters_of(code)} {column},{row} {', '.join(said)}")
    return lines


def thing_words(code: Code) -> str:
    """Colour and type of a thing."""
    type_ = types_by_code().get(code[0])
    return f"{COLORS[code[1] % len(COLORS)]} {'thing' if type_ is None else type_.name.replace('_', ' ')}"


def own_hands(code: Code, marks: Marks = ()) -> str:
    """What the agent carries, in words and letters: `you carry a red ball, rb, size small`."""
    more = f", {mark_words(marks)}" if marks else ""
    return f"you carry a {thing_words(code)}, {_letters_of(code).strip()}{more}"


def letters(codes: NDArray[np.uint8], row: int, column: int) -> str:
    """The two characters of a cell."""
    return _letters_of(_code(codes, row, column))


def _letters_of(code: Code) -> str:
    kind, colour, status, orientation = code
    if kind == tiles.NPC:
        return chr(ord("A") + status % 26) + _ARROWS[orientation % 4]
    if kind == tiles.UNSEEN and colour == 0:
        return "  "
    type_ = types_by_code().get(kind)
    choices = _LETTERS.get(kind, "?") if type_ is None else type_.letters
    letter = choices[min(status, len(choices) - 1)]
    if type_ is not None and status in type_.rolls:
        letter = _ARROWS[orientation % 4]
    if type_ is not None and type_.mark is not None and colour == type_.color:
        return type_.mark + letter
    return _COLOUR_LETTERS[colour % 6] + letter


def _paint(text: str, style: str, colour: bool) -> str:
    return f"\x1b[{style}m{text}{_RESET}" if colour else text


def _code(codes: NDArray[np.uint8], row: int, column: int) -> Code:
    kind, colour, status, orientation = (int(value) for value in codes[row, column])
    return kind, colour, status, orientation


def _check(codes: NDArray[np.uint8], seen: NDArray[np.bool_] | None) -> None:
    if codes.ndim != 3 or codes.shape[2] != 4:
        raise ValueError(f"codes: expected an array of shape (H, W, 4), got {codes.shape}")
    if seen is not None and seen.shape != codes.shape[:2]:
        raise ValueError(f"seen: expected an array of shape {codes.shape[:2]}, got {seen.shape}")
