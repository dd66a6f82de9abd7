"""Figures in cells: the agent as an arrow, NPCs as faces whose hat tells their kind."""

from collections.abc import Callable, Iterable
from math import hypot
from typing import Final

from socialai_dsl.render.canvas import INK, WHITE, Canvas, Rgb, mix
from socialai_dsl.render.gestures import Gesture

Ray = tuple[tuple[int, int], tuple[int, int], int, Rgb]
"""From the cell of an NPC to the one that it points at, as columns to the right and rows down; the direction of its arm
and its colour."""

_FACE: Final = (0.5, 0.565)
_FORWARD: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))


def turn(points: list[tuple[float, float]], direction: int) -> list[tuple[float, float]]:
    """Turn points that were drawn facing right about the centre; exact, so that directions match."""
    cos, sin = _FORWARD[direction % 4]
    return [
        (0.5 + (x - 0.5) * cos - (y - 0.5) * sin, 0.5 + (x - 0.5) * sin + (y - 0.5) * cos) for x, y in points
    ]


def draw_agent(canvas: Canvas, direction: int) -> None:
    """Draw the agent: a red arrow, the only figure without a face."""
    rim = [(0.97, 0.50), (0.10, 0.93), (0.25, 0.50), (0.10, 0.07)]
    body = [(0.90, 0.50), (0.16, 0.86), (0.30, 0.50), (0.16, 0.14)]
    inner = [(0.80, 0.50), (0.26, 0.76), (0.37, 0.50), (0.26, 0.24)]
    canvas.polygon(turn(rim, direction), fill=WHITE)
    canvas.polygon(turn(body, direction), fill=(120, 18, 24))
    canvas.polygon(turn(inner, direction), fill=(232, 48, 52))


def draw_npc(canvas: Canvas, colour: Rgb, status: int, orientation: int) -> None:
    """Draw an NPC: face in its colour, hat of its kind, eyes and an arrow at the edge in the direction of gaze."""
    x, y = _FACE
    canvas.circle(x, y, 0.36, fill=mix(colour, INK, 0.45))
    canvas.circle(x, y, 0.315, fill=colour)
    _draw_eyes(canvas, orientation)
    _draw_hat(canvas, status)
    _draw_gaze(canvas, orientation)


def _draw_gaze(canvas: Canvas, orientation: int) -> None:
    """The arrow at the edge; it comes last, since it must be seen over a hat or an arm."""
    canvas.polygon(turn([(1.0, 0.5), (0.80, 0.30), (0.80, 0.70)], orientation), fill=WHITE)
    canvas.polygon(turn([(0.97, 0.5), (0.83, 0.36), (0.83, 0.64)], orientation), fill=INK)


def draw_gesture(canvas: Canvas, colour: Rgb, orientation: int, gesture: Gesture) -> None:
    """Draw an arm with a pointing hand, and in the upper left corner a sign for what an NPC did last."""
    if gesture.pointing is not None:
        _draw_arm(canvas, colour, gesture.pointing)
        _draw_gaze(canvas, orientation)
    sign = _SIGNS.get(gesture.act)
    if sign is not None:
        fill, draw = sign
        canvas.circle(*_SIGN, 0.19, fill=fill, outline=WHITE, width=0.035)
        draw(canvas)


def _draw_arm(canvas: Canvas, colour: Rgb, direction: int) -> None:
    """An arm along the edge of the cell that the arrow of the gaze leaves free, a finger at its end."""
    shoulder, hand, tip = _ARMS[direction % 4]
    canvas.line([shoulder, hand], fill=WHITE, width=0.22)
    canvas.line([hand, tip], fill=INK, width=0.13)
    canvas.line([shoulder, hand], fill=mix(colour, INK, 0.6), width=0.15)
    canvas.circle(*hand, 0.11, fill=_SKIN, outline=INK, width=0.035)
    canvas.line([hand, tip], fill=_SKIN, width=0.07)


def draw_rays(canvas: Canvas, rays: Iterable[Ray]) -> None:
    """Draw the parts in a cell of lines from the fingers of NPCs to the cells that they point at, with a ring there."""
    for (x, y), (to_x, to_y), direction, colour in rays:
        finger, dark = _ARMS[direction][-1], mix(colour, INK, 0.3)
        start, goal = (x + finger[0], y + finger[1]), (to_x + 0.5, to_y + 0.5)
        share = max(0.0, 1 - _RING / hypot(goal[0] - start[0], goal[1] - start[1]))
        end = (start[0] + (goal[0] - start[0]) * share, start[1] + (goal[1] - start[1]) * share)
        canvas.circle(*goal, _RING + 0.02, outline=WHITE, width=0.11)
        canvas.line([start, end], fill=WHITE, width=0.11)
        canvas.line([start, end], fill=dark, width=0.06)
        canvas.circle(*goal, _RING, outline=dark, width=0.06)


def _turn_sign(side: int) -> Callable[[Canvas], None]:
    """An arrow bent to the left (-1) or to the right (1)."""

    def draw(canvas: Canvas) -> None:
        x, y = _SIGN
        foot, bend, neck = (
            (x - side * 0.07, y + 0.1),
            (x - side * 0.07, y - 0.03),
            (x + side * 0.03, y - 0.03),
        )
        canvas.line([foot, bend, neck], fill=WHITE, width=0.05)
        canvas.polygon(
            [(x + side * 0.14, y - 0.03), (x + side * 0.02, y - 0.12), (x + side * 0.02, y + 0.06)], WHITE
        )

    return draw


def _forward_sign(canvas: Canvas) -> None:
    x, y = _SIGN
    canvas.polygon([(x, y - 0.13), (x + 0.11, y + 0.0), (x - 0.11, y + 0.0)], fill=WHITE)
    canvas.rectangle(x - 0.045, y - 0.02, x + 0.045, y + 0.12, fill=WHITE)


def _toggle_sign(canvas: Canvas) -> None:
    x, y = _SIGN
    for dx, dy in ((0.12, 0.0), (0.06, 0.104), (0.06, -0.104)):
        canvas.line([(x - dx, y - dy), (x + dx, y + dy)], fill=INK, width=0.045)


def _point_sign(canvas: Canvas) -> None:
    x, y = _SIGN
    canvas.rectangle(x - 0.035, y - 0.12, x + 0.035, y + 0.04, fill=INK)
    canvas.circle(x, y + 0.1, 0.04, fill=INK)


def _stop_sign(canvas: Canvas) -> None:
    x, y = _SIGN
    for side in (-1, 1):
        canvas.line([(x - 0.08, y - side * 0.08), (x + 0.08, y + side * 0.08)], fill=WHITE, width=0.055)


_SIGN: Final = (0.2, 0.2)
_RING: Final = 0.42
_SKIN: Final[Rgb] = (252, 206, 160)
_ARMS: Final = (
    ((0.46, 0.85), (0.74, 0.85), (0.93, 0.85)),
    ((0.85, 0.42), (0.85, 0.74), (0.85, 0.93)),
    ((0.54, 0.85), (0.26, 0.85), (0.07, 0.85)),
    ((0.85, 0.62), (0.85, 0.26), (0.85, 0.07)),
)
"""Shoulder, hand and finger-tip of an arm to the right, down, left and up."""

_SIGNS: Final[dict[str, tuple[Rgb, Callable[[Canvas], None]]]] = {
    "forward": ((34, 122, 62), _forward_sign),
    "left": ((44, 82, 178), _turn_sign(-1)),
    "right": ((44, 82, 178), _turn_sign(1)),
    "toggle": ((255, 166, 40), _toggle_sign),
    "point": ((252, 220, 90), _point_sign),
    "stop": ((150, 40, 44), _stop_sign),
}


def _draw_eyes(canvas: Canvas, orientation: int) -> None:
    dx, dy = _FORWARD[orientation % 4]
    for side in (-1, 1):
        x, y = _FACE[0] + side * 0.13 + dx * 0.07, _FACE[1] + 0.02 + dy * 0.07
        canvas.circle(x, y, 0.105, fill=WHITE)
        canvas.circle(x + dx * 0.045, y + dy * 0.045, 0.058, fill=INK)


def _draw_hat(canvas: Canvas, kind: int) -> None:
    """Twelve hats tell the first kinds apart; later kinds repeat them with dots for the round."""
    _HATS[kind % len(_HATS)](canvas)
    for dot in range(min(kind // len(_HATS), 5)):
        canvas.circle(0.22 + dot * 0.14, 0.90, 0.055, fill=WHITE, outline=INK, width=0.02)


def _pointed_hat(canvas: Canvas) -> None:
    canvas.polygon([(0.5, 0.0), (0.74, 0.33), (0.26, 0.33)], fill=(58, 48, 120))
    canvas.rectangle(0.14, 0.31, 0.86, 0.39, fill=(58, 48, 120), radius=0.03)
    canvas.circle(0.51, 0.22, 0.05, fill=(250, 214, 90))


def _flat_cap(canvas: Canvas) -> None:
    canvas.rectangle(0.23, 0.14, 0.77, 0.36, fill=(52, 112, 100), radius=0.1)
    canvas.rectangle(0.23, 0.31, 0.95, 0.39, fill=(30, 66, 60), radius=0.03)


def _crown(canvas: Canvas) -> None:
    points = [(0.23, 0.38), (0.20, 0.10), (0.37, 0.23), (0.5, 0.03), (0.63, 0.23), (0.80, 0.10), (0.77, 0.38)]
    canvas.polygon(points, fill=(140, 96, 8))
    inner = [(0.27, 0.34), (0.26, 0.19), (0.38, 0.29), (0.5, 0.12), (0.62, 0.29), (0.74, 0.19), (0.73, 0.34)]
    canvas.polygon(inner, fill=(250, 206, 62))


def _top_hat(canvas: Canvas) -> None:
    canvas.rectangle(0.31, 0.02, 0.69, 0.34, fill=INK, radius=0.02)
    canvas.rectangle(0.31, 0.22, 0.69, 0.29, fill=(200, 56, 56))
    canvas.rectangle(0.15, 0.31, 0.85, 0.38, fill=INK, radius=0.03)


def _bow(canvas: Canvas) -> None:
    pink = (230, 76, 146)
    canvas.polygon([(0.5, 0.22), (0.20, 0.05), (0.20, 0.39)], fill=pink)
    canvas.polygon([(0.5, 0.22), (0.80, 0.05), (0.80, 0.39)], fill=pink)
    canvas.circle(0.5, 0.22, 0.08, fill=(150, 30, 86))


def _feather(canvas: Canvas) -> None:
    canvas.polygon([(0.62, 0.33), (0.64, 0.0), (0.80, 0.10), (0.74, 0.30)], fill=(226, 110, 36))
    canvas.line([(0.66, 0.32), (0.72, 0.08)], fill=(126, 52, 12), width=0.03)
    canvas.rectangle(0.17, 0.29, 0.83, 0.39, fill=WHITE, outline=INK, width=0.025, radius=0.02)


def _cooks_hat(canvas: Canvas) -> None:
    for x, y, radius in ((0.33, 0.17, 0.14), (0.67, 0.17, 0.14), (0.5, 0.14, 0.14)):
        canvas.circle(x, y, radius, fill=WHITE, outline=INK, width=0.025)
    canvas.rectangle(0.30, 0.15, 0.70, 0.30, fill=WHITE)
    canvas.rectangle(0.28, 0.27, 0.72, 0.39, fill=WHITE, outline=INK, width=0.025)


def _mortarboard(canvas: Canvas) -> None:
    canvas.rectangle(0.30, 0.22, 0.70, 0.38, fill=INK, radius=0.03)
    canvas.polygon([(0.5, 0.04), (0.94, 0.18), (0.5, 0.31), (0.06, 0.18)], fill=INK)
    canvas.line([(0.5, 0.18), (0.84, 0.22), (0.84, 0.40)], fill=(250, 206, 62), width=0.035)
    canvas.circle(0.84, 0.41, 0.05, fill=(250, 206, 62))


def _halo(canvas: Canvas) -> None:
    canvas.ellipse(0.22, 0.03, 0.78, 0.24, outline=(150, 104, 8), width=0.085)
    canvas.ellipse(0.24, 0.045, 0.76, 0.225, outline=(255, 214, 64), width=0.05)


def _broad_hat(canvas: Canvas) -> None:
    straw, band = (190, 142, 78), (110, 66, 28)
    canvas.ellipse(0.27, 0.06, 0.73, 0.48, fill=straw)
    canvas.rectangle(0.27, 0.24, 0.73, 0.32, fill=band)
    canvas.ellipse(0.03, 0.29, 0.97, 0.41, fill=straw, outline=band, width=0.025)


def _horned_helmet(canvas: Canvas) -> None:
    bone, iron = (246, 236, 210), (150, 156, 166)
    for side in (-1, 1):
        for corners, fill in (
            ([(0.16, 0.26), (0.20, 0.40), (0.43, 0.33), (0.46, 0.0), (0.33, 0.19)], INK),
            ([(0.19, 0.29), (0.22, 0.36), (0.39, 0.30), (0.43, 0.08), (0.34, 0.23)], bone),
        ):
            canvas.polygon([(0.5 + side * x, y) for x, y in corners], fill=fill)
    canvas.pie(0.5, 0.38, 0.28, 180, 360, fill=iron)
    canvas.rectangle(0.21, 0.33, 0.79, 0.40, fill=INK, radius=0.02)


def _propeller(canvas: Canvas) -> None:
    canvas.pie(0.5, 0.39, 0.25, 180, 360, fill=(66, 190, 200))
    canvas.pie(0.5, 0.39, 0.25, 240, 300, fill=(240, 120, 60))
    canvas.line([(0.5, 0.15), (0.5, 0.07)], fill=INK, width=0.04)
    canvas.ellipse(0.20, 0.02, 0.50, 0.11, fill=(220, 60, 60), outline=INK, width=0.02)
    canvas.ellipse(0.50, 0.02, 0.80, 0.11, fill=(220, 60, 60), outline=INK, width=0.02)


_HATS: Final[tuple[Callable[[Canvas], None], ...]] = (
    _pointed_hat,
    _flat_cap,
    _crown,
    _top_hat,
    _bow,
    _feather,
    _cooks_hat,
    _mortarboard,
    _halo,
    _broad_hat,
    _horned_helmet,
    _propeller,
)
