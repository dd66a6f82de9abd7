"""A small square canvas with soft edges for tiles, and their colours."""

from copy import copy
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

Rgb: TypeAlias = tuple[int, int, int]

INK: Final[Rgb] = (38, 40, 46)
PAPER: Final[Rgb] = (243, 241, 235)
WHITE: Final[Rgb] = (255, 255, 255)

_SUPERSAMPLING = 4


class Canvas:
    """A square picture whose corners are (0, 0) and (1, 1), y down, drawn large and then scaled down."""

    def __init__(self, size: int) -> None:
        self._scale: float = size * _SUPERSAMPLING
        self._left = self._top = 0.0
        self._image = Image.new("RGB", (size * _SUPERSAMPLING, size * _SUPERSAMPLING))
        self._draw = ImageDraw.Draw(self._image)

    def part(self, x: float, y: float, size: float) -> "Canvas":
        """A square of this canvas as a canvas of its own: its upper left corner and its side."""
        part = copy(self)
        part._left, part._top = self._left + x * self._scale, self._top + y * self._scale
        part._scale = size * self._scale
        return part

    def pixels(self) -> NDArray[np.uint8]:
        """The finished picture, uint8 (size, size, 3)."""
        return np.asarray(self._image.reduce(_SUPERSAMPLING), dtype=np.uint8).copy()

    def fill(self, colour: Rgb) -> None:
        """Paint the whole square."""
        self._draw.rectangle(self._box(0, 0, 1, 1), fill=colour)

    def rectangle(
        self,
        x0: float,
        y0: float,
        x1: float,
        y1: float,
        fill: Rgb | None = None,
        outline: Rgb | None = None,
        width: float = 0.05,
        radius: float = 0.0,
    ) -> None:
        """Draw a rectangle between two corners, with rounded corners if `radius` is given."""
        self._draw.rounded_rectangle(
            self._box(x0, y0, x1, y1),
            radius=radius * self._scale,
            fill=fill,
            outline=outline,
            width=self._width(width) if outline else 0,
        )

    def circle(
        self,
        x: float,
        y: float,
        radius: float,
        fill: Rgb | None = None,
        outline: Rgb | None = None,
        width: float = 0.05,
    ) -> None:
        """Draw a disc, a ring, or both."""
        self.ellipse(x - radius, y - radius, x + radius, y + radius, fill, outline, width)

    def ellipse(
        self,
        x0: float,
        y0: float,
        x1: float,
        y1: float,
        fill: Rgb | None = None,
        outline: Rgb | None = None,
        width: float = 0.05,
    ) -> None:
        """Draw the ellipse that fills the rectangle between two corners."""
        box = self._box(x0, y0, x1, y1)
        self._draw.ellipse(box, fill=fill, outline=outline, width=self._width(width) if outline else 0)

    def pie(self, x: float, y: float, radius: float, start: float, end: float, fill: Rgb) -> None:
        """Draw a slice of a disc between two angles in degrees, clockwise from the right."""
        self._draw.pieslice(self._box(x - radius, y - radius, x + radius, y + radius), start, end, fill=fill)

    def polygon(self, points: list[tuple[float, float]], fill: Rgb) -> None:
        """Draw a filled polygon."""
        self._draw.polygon(self._scaled(points), fill=fill)

    def line(self, points: list[tuple[float, float]], fill: Rgb, width: float = 0.05) -> None:
        """Draw a line through points, with round ends."""
        self._draw.line(self._scaled(points), fill=fill, width=self._width(width), joint="curve")
        for x, y in (points[0], points[-1]):
            self.circle(x, y, width / 2, fill=fill)

    def arc(
        self, x: float, y: float, radius: float, start: float, end: float, fill: Rgb, width: float
    ) -> None:
        """Draw a part of a circle between two angles in degrees, clockwise from the right."""
        box = self._box(x - radius, y - radius, x + radius, y + radius)
        self._draw.arc(box, start, end, fill=fill, width=self._width(width))

    def _box(self, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float, float, float]:
        last, left, top = self._scale - 1, self._left, self._top
        return left + x0 * last, top + y0 * last, left + x1 * last, top + y1 * last

    def _scaled(self, points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        return [(self._left + x * self._scale, self._top + y * self._scale) for x, y in points]

    def _width(self, width: float) -> int:
        return max(1, round(width * self._scale))


def mix(a: Rgb, b: Rgb, share: float) -> Rgb:
    """The colour `share` of the way from `a` to `b`."""
    red, green, blue = (round(x + (y - x) * share) for x, y in zip(a, b, strict=True))
    return red, green, blue
