"""A frame of an episode's film: the room, and the dialogue beside it."""

import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from socialai_dsl.render.canvas import INK, PAPER, WHITE, Rgb, mix
from socialai_dsl.vocabulary import YOU

_MUTED: Final[Rgb] = (118, 120, 128)
_OWN: Final[Rgb] = (178, 34, 40)
_HEARD: Final[Rgb] = (36, 84, 160)
_HIGHLIGHT: Final[Rgb] = (255, 236, 170)
_TEXT_SIZE: Final = 14
_CAPTION_SIZE: Final = 13
_MARGIN: Final = 12
_LINE_HEIGHT: Final = 19
_FACE_SIZE: Final = 26
_MOST_FACES: Final = 6

_Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


@dataclass(frozen=True)
class DialogueLine:
    """One utterance of an episode.

    Attributes:
        t: the step in which it was said, counted from 1.
        speaker: a name, `YOU` for the agent, "" where the scenario hides names.
        text: what was said.
    """

    t: int
    speaker: str
    text: str

    @property
    def own(self) -> bool:
        """Whether the agent said it."""
        return self.speaker == YOU


@dataclass(frozen=True, eq=False)
class Face:
    """One of those whom the agent may meet.

    Attributes:
        label: what the viewer is told about it.
        look: how it is drawn, uint8 (S, S, 3).
    """

    label: str
    look: NDArray[np.uint8]


def draw_dialogue(
    lines: Sequence[DialogueLine], width: int, height: int, now: int | None = None
) -> NDArray[np.uint8]:
    """Draw the dialogue so far, the latest lines at the bottom, those of step `now` highlighted.

    Lines that no longer fit are dropped from the top; long ones are wrapped.

    Returns:
        uint8 (height, width, 3).
    """
    image = Image.new("RGB", (width, height), WHITE)
    draw = ImageDraw.Draw(image)
    if not lines:
        draw.text((_MARGIN, _MARGIN), "Nothing was said yet.", font=_font(_TEXT_SIZE), fill=_MUTED)
        return np.asarray(image, dtype=np.uint8).copy()
    blocks = [(line, _wrap(line, width - 2 * _MARGIN)) for line in lines]
    kept: list[tuple[DialogueLine, list[str]]] = []
    left = height - 2 * _MARGIN
    for line, rows in reversed(blocks):
        needed = len(rows) * _LINE_HEIGHT + 4
        if needed > left and kept:
            break
        kept.append((line, rows))
        left -= needed
    y = _MARGIN
    for line, rows in reversed(kept):
        y = _draw_line(draw, line, rows, y, width, highlighted=line.t == now)
    return np.asarray(image, dtype=np.uint8).copy()


def compose_frame(
    grid: NDArray[np.uint8],
    lines: Sequence[DialogueLine],
    caption: Sequence[str],
    now: int | None = None,
    size: tuple[int, int] = (640, 360),
    cast: Sequence[Face] = (),
) -> NDArray[np.uint8]:
    """Set the room on the left, the dialogue on the right with the cast above and the caption below it.

    Args:
        grid: uint8 (H, W, 3), a picture of the room; scaled down if it is too large, never up.
        lines: what was said so far.
        caption: short lines such as the step, the action and the reward; the first stands out.
        now: the step whose lines are highlighted.
        size: width and height of the result.
        cast: who is in the room; of many the first are shown.

    Returns:
        uint8 (height, width, 3).
    """
    width, height = size
    frame = Image.new("RGB", size, PAPER)
    room = Image.fromarray(grid)
    side = min(height - 2 * _MARGIN, round(width * 0.55))
    if max(room.size) > side:
        room.thumbnail((side, side), Image.Resampling.LANCZOS)
    frame.paste(room, (_MARGIN + (side - room.width) // 2, (height - room.height) // 2))

    left = side + 2 * _MARGIN
    panel = width - left - _MARGIN
    foot = _MARGIN + len(caption) * (_CAPTION_SIZE + 6)
    draw = ImageDraw.Draw(frame)
    top = _MARGIN + _draw_cast(frame, draw, cast[:_MOST_FACES], (left, _MARGIN), panel)
    dialogue = draw_dialogue(lines, panel, height - _MARGIN - top - foot, now)
    frame.paste(Image.fromarray(dialogue), (left, top))
    y = height - foot
    for row, text in enumerate(caption):
        fill = INK if row == 0 else _MUTED
        shown = _shorten(text, panel, _CAPTION_SIZE)
        draw.text((left, y), shown, font=_font(_CAPTION_SIZE, shown), fill=fill)
        y += _CAPTION_SIZE + 6
    return np.asarray(frame, dtype=np.uint8).copy()


def _draw_cast(
    frame: Image.Image,
    draw: ImageDraw.ImageDraw,
    cast: Sequence[Face],
    corner: tuple[int, int],
    width: int,
) -> int:
    """Draw faces with their labels in two columns; the height that took."""
    column = width // 2
    for number, face in enumerate(cast):
        x = corner[0] + number % 2 * column
        y = corner[1] + number // 2 * (_FACE_SIZE + 4)
        look = Image.fromarray(face.look).resize((_FACE_SIZE, _FACE_SIZE), Image.Resampling.LANCZOS)
        frame.paste(look, (x, y))
        text = _shorten(face.label, column - _FACE_SIZE - 8, _CAPTION_SIZE)
        draw.text((x + _FACE_SIZE + 5, y + 5), text, font=_font(_CAPTION_SIZE, text), fill=INK)
    rows = -(-len(cast) // 2)
    return rows * (_FACE_SIZE + 4) + (4 if rows else 0)


def _draw_line(
    draw: ImageDraw.ImageDraw, line: DialogueLine, rows: list[str], y: int, width: int, highlighted: bool
) -> int:
    """Draw one utterance and return where the next one starts."""
    bottom = y + len(rows) * _LINE_HEIGHT
    if highlighted:
        box = (_MARGIN // 2, y - 2, width - _MARGIN // 2, bottom)
        draw.rounded_rectangle(box, radius=4, fill=_HIGHLIGHT)
    speaker = _OWN if line.own else _HEARD
    ink = INK if highlighted else mix(INK, WHITE, 0.25)
    name = f"{line.speaker}: " if line.speaker else ""
    for number, row in enumerate(rows):
        x = float(_MARGIN)
        if number == 0 and name:
            draw.text((x, y), name, font=_font(_TEXT_SIZE, name), fill=speaker)
            x += _width(name, _TEXT_SIZE)
            row = row.removeprefix(name.rstrip()).lstrip()
        draw.text((x, y), row, font=_font(_TEXT_SIZE, row), fill=ink)
        y += _LINE_HEIGHT
    return y + 4


def _wrap(line: DialogueLine, width: int) -> list[str]:
    """Break `Name: text` at spaces so that each row fits; a longer word is cut."""
    text = f"{line.speaker}: {line.text}" if line.speaker else line.text
    rows = [""]
    for word in text.split(" "):
        longer = f"{rows[-1]} {word}" if rows[-1] else word
        if rows[-1] and _width(longer, _TEXT_SIZE) > width:
            rows.append(word)
        else:
            rows[-1] = longer
    return [_shorten(row, width, _TEXT_SIZE) for row in rows]


def _shorten(text: str, width: int, size: int) -> str:
    if _width(text, size) <= width:
        return text
    while text and _width(text + "…", size) > width:
        text = text[:-1]
    return text + "…"


def _width(text: str, size: int) -> float:
    return _font(size, text).getlength(text)


_FALLBACKS: Final = (
    *("DejaVuSans.ttf", "NotoSans-Regular.ttf", "Arial Unicode.ttf", "arialuni.ttf"),
    *("NotoSansCJK-Regular.ttc", "msyh.ttc", "PingFang.ttc", "NotoSansThai-Regular.ttf", "unifont.ttf"),
)
"""Fonts of systems, tried in order where Pillow's own lacks a letter; it has little beyond those of English."""

_NO_LETTER: Final = "\U0010ffff"
"""What no font has, so that it shows what a font draws for what it lacks."""


def _font(size: int, text: str = "") -> _Font:
    """Pillow's own font or, of a text that has other letters, the first font here that has them all.

    Warns once of letters that none has.
    """
    lacking = {character for character in text if not _has(size, 0, character)}
    if not lacking:
        return _fonts(size)[0]
    fonts = _fonts(size)
    missing = [{c for c in text if not _has(size, number, c)} for number in range(len(fonts))]
    best = min(range(len(fonts)), key=lambda number: len(missing[number]))
    if missing[best]:
        _warn_of("".join(sorted(missing[best])))
    return fonts[best]


@lru_cache(maxsize=8)
def _fonts(size: int) -> tuple[_Font, ...]:
    """Pillow's own font, then those of the fallbacks that this machine has."""
    found: list[_Font] = [ImageFont.load_default(size=size)]
    for name in _FALLBACKS:
        with suppress(OSError):
            found.append(ImageFont.truetype(name, size))
    return tuple(found)


@lru_cache(maxsize=4096)
def _has(size: int, number: int, character: str) -> bool:
    """Whether a font can draw a character."""
    font = _fonts(size)[number]
    if not character.isprintable() or character.isspace() or not isinstance(font, ImageFont.FreeTypeFont):
        return True
    drawn, nothing = font.getmask(character), font.getmask(_NO_LETTER)
    return (drawn.size, bytes(drawn)) != (nothing.size, bytes(nothing))


@lru_cache(maxsize=256)
def _warn_of(characters: str) -> None:
    warnings.warn(
        f"no font of this machine has {characters!r}, so pictures show boxes; Noto Sans has more letters",
        stacklevel=2,
    )
