"""Marks: how the looks of a thing or an NPC are drawn.

A word that has a drawing of its own makes a thing smaller, lies over it as a pattern, or is a face in the upper right
corner. Any other word is a tag at the lower edge with as many dots as its place among the words of its look.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final, NamedTuple

from socialai_dsl.program import NO_GESTURE
from socialai_dsl.render.canvas import INK, WHITE, Canvas, Rgb


class Mark(NamedTuple):
    """A look of something.

    Attributes:
        look: the name of the look. word: its value.
        place: of the word among those of the look, from 0. row: of the look among those of the scenario, from 0.
    """

    look: str
    word: str
    place: int
    row: int


Marks = tuple[Mark, ...]
"""All looks of one thing or NPC."""
LookWords = Mapping[str, Sequence[str]]
"""Name of each look that pictures show -> its words; more may follow the name, after a colon (`look_channels`)."""


def marks_of(looks: LookWords, shown: Iterable[int]) -> Marks:
    """The marks for the channels of looks in a cell, in the order of the looks."""
    found = zip(looks.items(), shown, strict=True)
    return tuple(
        Mark(name.partition(":")[0], words[place], place, row)
        for row, ((name, words), place) in enumerate(found)
        if place != NO_GESTURE
    )


def mark_words(marks: Marks) -> str:
    """Looks in words: `size small, pattern striped`."""
    return ", ".join(f"{mark.look} {mark.word}" for mark in marks)


SIZES: Final = {"tiny": 0.4, "small": 0.55, "medium": 0.75, "large": 0.95}
"""Words that make a thing smaller: its side, as a part of what it is elsewhere."""


def sized(canvas: Canvas, marks: Marks) -> Canvas:
    """The part of a cell that a thing takes up."""
    side = 1.0
    for mark in marks:
        side *= SIZES.get(mark.word, 1.0)
    return canvas if side == 1.0 else canvas.part((1 - side) / 2, (1 - side) / 2, side)


def draw_patterns(canvas: Canvas, marks: Marks) -> bool:
    """Draw the patterns of a thing over it; whether it has any. `canvas` is the part of the cell that it takes up."""
    patterns = [_PATTERNS[mark.word] for mark in marks if mark.word in _PATTERNS]
    for draw in patterns:
        draw(canvas)
    return bool(patterns)


def draw_marks(canvas: Canvas, marks: Marks) -> None:
    """Draw faces and tags."""
    for mark in marks:
        if mark.word in _FACES:
            _draw_face(canvas, mark.word)
        elif mark.word not in SIZES and mark.word not in _PATTERNS:
            _draw_tag(canvas, mark)


def _draw_gloss(canvas: Canvas) -> None:
    canvas.arc(0.5, 0.5, 0.2, 190, 290, fill=WHITE, width=0.06)


def _draw_stripes(canvas: Canvas) -> None:
    for y in (0.38, 0.52, 0.66):
        canvas.line([(0.3, y), (0.7, y)], fill=INK, width=0.1)
        canvas.line([(0.3, y), (0.7, y)], fill=WHITE, width=0.06)


def _draw_spots(canvas: Canvas) -> None:
    for x, y in ((0.38, 0.4), (0.62, 0.4), (0.5, 0.53), (0.38, 0.66), (0.62, 0.66)):
        canvas.circle(x, y, 0.07, fill=WHITE, outline=INK, width=0.02)


def _draw_checks(canvas: Canvas) -> None:
    canvas.rectangle(0.32, 0.36, 0.68, 0.72, fill=INK)
    canvas.rectangle(0.34, 0.38, 0.5, 0.54, fill=WHITE)
    canvas.rectangle(0.5, 0.54, 0.66, 0.7, fill=WHITE)


_PATTERNS: Final[dict[str, Callable[[Canvas], None]]] = {
    "plain": _draw_gloss,
    "striped": _draw_stripes,
    "spotted": _draw_spots,
    "checked": _draw_checks,
}

_FACES: Final[dict[str, Rgb]] = {
    "calm": (255, 236, 160),
    "cheerful": (255, 214, 60),
    "laughing": (255, 170, 40),
    "sad": (150, 190, 240),
    "angry": (240, 90, 70),
    "afraid": (200, 170, 230),
    "surprised": (170, 230, 170),
}
"""Words that are drawn as a face, each with its colour."""


def _draw_face(canvas: Canvas, word: str) -> None:
    x, y = 0.8, 0.2
    canvas.circle(x, y, 0.19, fill=_FACES[word], outline=INK, width=0.03)
    eye = 0.045 if word in ("afraid", "surprised") else 0.03
    for side in (-1, 1):
        canvas.circle(x + side * 0.07, y - 0.04, eye, fill=INK)
        if word == "angry":
            canvas.line([(x + side * 0.12, y - 0.13), (x + side * 0.03, y - 0.08)], fill=INK, width=0.03)
    if word == "calm":
        canvas.line([(x - 0.07, y + 0.08), (x + 0.07, y + 0.08)], fill=INK, width=0.03)
    elif word == "cheerful":
        canvas.arc(x, y, 0.125, 20, 160, fill=INK, width=0.03)
    elif word == "laughing":
        canvas.pie(x, y + 0.02, 0.11, 0, 180, fill=INK)
    elif word in ("sad", "angry"):
        canvas.arc(x, y + 0.17, 0.12, 215, 325, fill=INK, width=0.03)
    else:
        canvas.circle(x, y + 0.09, 0.05 if word == "surprised" else 0.03, fill=INK)


def _draw_tag(canvas: Canvas, mark: Mark) -> None:
    y, left = 0.94 - 0.09 * mark.row, 0.5 - 0.035 * mark.place
    right = left + 0.07 * mark.place
    canvas.rectangle(left - 0.05, y - 0.045, right + 0.05, y + 0.045, fill=WHITE, outline=INK, width=0.015)
    for dot in range(mark.place + 1):
        canvas.circle(left + 0.07 * dot, y, 0.025, fill=INK)
