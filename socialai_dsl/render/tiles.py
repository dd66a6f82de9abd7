"""Tiles: one cell of the room with its object and its figure."""

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.library import types_by_code
from socialai_dsl.render.canvas import INK, PAPER, WHITE, Canvas, Rgb, mix
from socialai_dsl.render.figures import Ray, draw_agent, draw_gesture, draw_npc, draw_rays, turn
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.marks import Marks, draw_marks, draw_patterns, sized
from socialai_dsl.vocabulary import EMPTY as EMPTY
from socialai_dsl.vocabulary import NPC as NPC
from socialai_dsl.vocabulary import UNSEEN as UNSEEN

Code: TypeAlias = tuple[int, int, int, int]
"""A cell as in the observation: type, colour, status, orientation."""

# Codes of the observation, channel 1: red, green, blue, purple, yellow, grey.
PALETTE: Final[tuple[Rgb, ...]] = (
    (214, 64, 58),
    (62, 160, 82),
    (58, 110, 205),
    (142, 84, 178),
    (232, 182, 44),
    (136, 140, 148),
)
LINE: Final[Rgb] = (221, 218, 209)
_LAVA: Final[Rgb] = (240, 118, 34)
STONE: Final[Rgb] = (92, 97, 107)
SEEN_TINT: Final[Rgb] = (255, 226, 138)
SEEN_LINE: Final[Rgb] = (214, 150, 20)


@lru_cache(maxsize=4096)
def draw_tile(
    code: Code,
    agent_direction: int | None,
    seen: bool,
    size: int,
    below: Code | None = None,
    gesture: Gesture | None = None,
    held: Code | None = None,
    marks: Marks = (),
    rays: tuple[Ray, ...] = (),
) -> NDArray[np.uint8]:
    """Draw one cell.

    Args:
        code: (type, colour, status, orientation) as in the observation.
        agent_direction: 0 right, 1 down, 2 left, 3 up if the agent stands here, else None.
        seen: whether the cell lies in the agent's field of view; such cells are tinted.
        size: side of the tile in pixels.
        below: what lies under it, such as the doorway in which an NPC stands; None for plain floor.
        gesture: where an NPC points and what it did last; None where that is not shown.
        held: what the member here carries; None for nothing.
        marks: the looks of what is here; where the agent stands, of what it carries.
        rays: from NPCs to cells that they point at, as seen from this cell.

    Returns:
        A read-only array, uint8 (size, size, 3).
    """
    canvas = Canvas(size)
    canvas.fill(mix(PAPER, SEEN_TINT, 0.55) if seen else PAPER)
    canvas.rectangle(0, 0, 1, 1, outline=mix(LINE, SEEN_TINT, 0.5) if seen else LINE, width=0.03)
    if below is not None:
        _draw(canvas, below)
    _draw(canvas, code, () if agent_direction is not None else marks)
    if gesture is not None:
        draw_gesture(canvas, PALETTE[code[1] % len(PALETTE)], code[3], gesture)
    if agent_direction is not None:
        draw_agent(canvas, agent_direction)
    else:
        draw_marks(canvas, marks)
    if held is not None:
        _draw_held(canvas, held, marks if agent_direction is not None else ())
    draw_rays(canvas, rays)
    pixels = canvas.pixels()
    pixels.setflags(write=False)
    return pixels


def _dark(colour: Rgb) -> Rgb:
    return mix(colour, INK, 0.45)


def _light(colour: Rgb) -> Rgb:
    return mix(colour, WHITE, 0.55)


def _draw(canvas: Canvas, code: Code, marks: Marks = ()) -> None:
    """A thing or an NPC in its size and with its pattern."""
    kind, colour, status, orientation = code
    part = sized(canvas, marks)
    drawer = _drawer(kind)
    drawer(part, PALETTE[colour % len(PALETTE)], status, orientation)
    if draw_patterns(part, marks) and drawer is _draw_ball and status:
        part.polygon(_star(0.5, 0.5, 0.34), fill=WHITE)
        part.polygon(_star(0.5, 0.5, 0.25), fill=INK)


def _draw_held(canvas: Canvas, held: Code, marks: Marks) -> None:
    """A small picture of a thing in the lower left corner."""
    canvas.circle(0.2, 0.8, 0.19, fill=WHITE, outline=INK, width=0.03)
    part = canvas.part(0.05, 0.65, 0.3)
    _draw(part, held, marks)
    draw_marks(part, marks)


def _draw_nothing(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del canvas, colour, status, orientation


def _draw_unseen(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del colour, status, orientation
    canvas.fill(mix(STONE, INK, 0.7))


def _draw_unknown(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.rectangle(0.2, 0.2, 0.8, 0.8, outline=colour, width=0.06)
    canvas.line([(0.2, 0.2), (0.8, 0.8)], fill=colour, width=0.06)
    _draw_ticks(canvas, status)


def _draw_ticks(canvas: Canvas, count: int) -> None:
    for tick in range(min(count, 8)):
        canvas.circle(0.12 + 0.11 * tick, 0.91, 0.04, fill=INK)


def _draw_wall(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del status, orientation
    stone = STONE if colour == PALETTE[5] else mix(STONE, colour, 0.6)
    joint = mix(stone, INK, 0.35)
    canvas.fill(joint)
    for row in range(3):
        y0, y1 = row / 3 + 0.015, (row + 1) / 3 - 0.015
        edges = (0.0, 0.5, 1.0) if row % 2 == 0 else (-0.25, 0.25, 0.75, 1.25)
        for x0, x1 in pairwise(edges):
            canvas.rectangle(x0 + 0.015, y0, x1 - 0.015, y1, fill=stone)


def _draw_floor(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del status, orientation
    canvas.rectangle(0.08, 0.08, 0.92, 0.92, fill=mix(PAPER, colour, 0.35), radius=0.06)


def _draw_door(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.rectangle(0, 0, 1, 1, outline=_dark(colour), width=0.11)
    if status == 0:
        canvas.rectangle(0.03, 0.03, 0.23, 0.97, fill=colour, outline=_dark(colour), width=0.04)
        return
    canvas.rectangle(0.11, 0.11, 0.89, 0.89, fill=colour)
    for y0, y1 in ((0.18, 0.46), (0.54, 0.82)):
        canvas.rectangle(0.2, y0, 0.66, y1, outline=mix(colour, INK, 0.25), width=0.04)
    if status == 2:
        _draw_padlock(canvas)
    else:
        canvas.circle(0.77, 0.5, 0.065, fill=WHITE, outline=INK, width=0.03)


def _draw_padlock(canvas: Canvas) -> None:
    canvas.arc(0.5, 0.42, 0.15, 180, 360, fill=INK, width=0.06)
    canvas.line([(0.38, 0.42), (0.38, 0.5)], fill=INK, width=0.06)
    canvas.line([(0.62, 0.42), (0.62, 0.5)], fill=INK, width=0.06)
    canvas.rectangle(0.28, 0.47, 0.72, 0.79, fill=(250, 214, 90), outline=INK, width=0.04, radius=0.05)
    canvas.circle(0.5, 0.6, 0.05, fill=INK)
    canvas.line([(0.5, 0.6), (0.5, 0.69)], fill=INK, width=0.04)


def _draw_remote_door(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.rectangle(0, 0, 1, 1, outline=_dark(colour), width=0.11)
    bottom = 0.24 if status == 0 else 0.9  # a grating, drawn up when open
    for x in (0.28, 0.5, 0.72):
        canvas.line([(x, 0.1), (x, bottom)], fill=colour, width=0.07)
    for y in (0.34, 0.66):
        if y < bottom:
            canvas.line([(0.14, y), (0.86, y)], fill=colour, width=0.06)


def _draw_ball(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.circle(0.5, 0.5, 0.32, fill=_dark(colour))
    canvas.circle(0.5, 0.5, 0.275, fill=colour)
    if status:
        canvas.polygon(_star(0.5, 0.5, 0.22), fill=INK)
    else:
        canvas.circle(0.41, 0.40, 0.07, fill=_light(colour))


def _star(x: float, y: float, radius: float) -> list[tuple[float, float]]:
    """The ten corners of a five-pointed star, one point up."""
    corners = []
    for corner in range(10):
        reach = radius if corner % 2 == 0 else radius * 0.42
        angle = math.pi * (corner / 5 - 0.5)
        corners.append((x + reach * math.cos(angle), y + reach * math.sin(angle)))
    return corners


def _draw_box(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.rectangle(0.18, 0.36, 0.82, 0.84, fill=colour, outline=_dark(colour), width=0.05)
    if status == 1:
        canvas.polygon([(0.18, 0.36), (0.05, 0.16), (0.60, 0.10), (0.82, 0.36)], fill=_dark(colour))
        canvas.polygon([(0.23, 0.34), (0.13, 0.20), (0.57, 0.15), (0.74, 0.34)], fill=_light(colour))
    else:
        canvas.rectangle(0.14, 0.24, 0.86, 0.42, fill=_light(colour), outline=_dark(colour), width=0.05)
    if status == 2:
        _draw_padlock(canvas)


def _draw_lava(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del status, orientation
    canvas.fill(_LAVA if colour == PALETTE[0] else mix(_LAVA, colour, 0.6))
    for y in (0.22, 0.5, 0.78):
        wave = [(x / 20, y + 0.06 * math.sin(x / 20 * 4 * math.pi)) for x in range(21)]
        canvas.line(wave, fill=(140, 38, 18), width=0.06)


def _draw_switch(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    lit = status != 0
    canvas.rectangle(0.2, 0.08, 0.8, 0.92, fill=WHITE, outline=_dark(colour), width=0.05, radius=0.1)
    top, bottom = (0.16, 0.5) if lit else (0.5, 0.84)
    canvas.rectangle(0.3, 0.16, 0.7, 0.84, fill=mix(colour, WHITE, 0.7), radius=0.06)
    canvas.rectangle(0.3, top, 0.7, bottom, fill=colour, outline=_dark(colour), width=0.03, radius=0.06)
    if lit:
        for angle in range(0, 360, 45):
            dx, dy = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            start, end = (0.5 + 0.055 * dx, 0.33 + 0.055 * dy), (0.5 + 0.115 * dx, 0.33 + 0.115 * dy)
            canvas.line([start, end], fill=WHITE, width=0.035)


def _draw_apple(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    if status:  # only the core is left, and a little peel
        canvas.ellipse(0.34, 0.28, 0.66, 0.46, fill=colour)
        canvas.ellipse(0.36, 0.7, 0.64, 0.86, fill=colour)
        canvas.line([(0.5, 0.3), (0.5, 0.8)], fill=(244, 232, 196), width=0.13)
        canvas.circle(0.5, 0.55, 0.035, fill=(104, 70, 40))
    else:
        canvas.circle(0.38, 0.56, 0.24, fill=colour)
        canvas.circle(0.62, 0.56, 0.24, fill=colour)
        canvas.circle(0.5, 0.66, 0.22, fill=colour)
        canvas.circle(0.33, 0.47, 0.06, fill=_light(colour))
    canvas.line([(0.5, 0.38), (0.55, 0.18)], fill=(104, 70, 40), width=0.05)
    canvas.polygon([(0.56, 0.24), (0.80, 0.12), (0.72, 0.30)], fill=(70, 150, 70))


def _draw_lever(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    if status < 2:  # down, up
        tip = (0.76, 0.24) if status else (0.24, 0.24)
        canvas.line([(0.5, 0.7), tip], fill=INK, width=0.08)
        canvas.circle(*tip, 0.12, fill=colour, outline=_dark(colour), width=0.04)
    else:  # spent: broken off, and lying there
        canvas.line([(0.5, 0.7), (0.56, 0.54)], fill=INK, width=0.08)
        canvas.line([(0.14, 0.93), (0.6, 0.93)], fill=INK, width=0.06)
        canvas.circle(0.72, 0.9, 0.09, fill=colour, outline=_dark(colour), width=0.04)
    canvas.rectangle(0.18, 0.66, 0.82, 0.86, fill=STONE, outline=INK, width=0.03, radius=0.05)


def _draw_generator(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    canvas.rectangle(0.12, 0.16, 0.88, 0.84, fill=colour, outline=_dark(colour), width=0.06, radius=0.1)
    bolt = [(0.56, 0.22), (0.32, 0.54), (0.48, 0.54), (0.42, 0.78), (0.68, 0.44), (0.52, 0.44)]
    canvas.polygon(bolt, fill=(255, 238, 130) if status else _dark(colour))


def _draw_marble(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    canvas.circle(0.5, 0.5, 0.24, fill=_dark(colour))
    canvas.circle(0.5, 0.5, 0.2, fill=colour)
    canvas.arc(0.44, 0.5, 0.14, 270, 80, fill=WHITE, width=0.06)
    canvas.circle(0.42, 0.42, 0.045, fill=_light(colour))
    if status:  # rolling: two dashes trail it
        for y in (0.40, 0.60):
            canvas.line(turn([(0.06, y), (0.2, y)], orientation), fill=_dark(colour), width=0.05)


def _draw_platform(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del orientation
    face = colour if status else mix(PAPER, colour, 0.5)
    canvas.rectangle(0.1, 0.1, 0.9, 0.9, fill=face, outline=_dark(colour), width=0.05)
    canvas.rectangle(0.24, 0.24, 0.76, 0.76, outline=_dark(colour), width=0.04)
    canvas.line([(0.24, 0.24), (0.76, 0.76)], fill=_dark(colour), width=0.04)
    canvas.line([(0.76, 0.24), (0.24, 0.76)], fill=_dark(colour), width=0.04)


def _draw_fence(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    del status, orientation
    wood = mix(colour, (150, 110, 70), 0.5)
    for y in (0.42, 0.68):
        canvas.rectangle(0, y, 1, y + 0.09, fill=_dark(wood))
    for x in (0.08, 0.41, 0.74):
        canvas.polygon([(x, 0.9), (x, 0.26), (x + 0.09, 0.12), (x + 0.18, 0.26), (x + 0.18, 0.9)], fill=wood)


_Drawer: TypeAlias = Callable[[Canvas, Rgb, int, int], None]

_OF_NO_TYPE: Final[dict[int, _Drawer]] = {UNSEEN: _draw_unseen, EMPTY: _draw_nothing, NPC: draw_npc}

LOOKS: Final[dict[str, _Drawer]] = {
    "wall": _draw_wall,
    "floor": _draw_floor,
    "door": _draw_door,
    "ball": _draw_ball,
    "box": _draw_box,
    "lava": _draw_lava,
    "switch": _draw_switch,
    "apple": _draw_apple,
    "lever": _draw_lever,
    "generator": _draw_generator,
    "marble": _draw_marble,
    "platform": _draw_platform,
    "fence": _draw_fence,
    "remote_door": _draw_remote_door,
}
"""What the prelude calls a look -> what draws it in a colour, a status and an orientation."""


def _drawer(code: int) -> _Drawer:
    if code in _OF_NO_TYPE:
        return _OF_NO_TYPE[code]
    type_ = types_by_code().get(code)
    return _draw_unknown if type_ is None else LOOKS[type_.look]
