"""The canvas shows what the PNG pictures show."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

import socialai_dsl as sd
from socialai_dsl.episodes import trace_of
from socialai_dsl.library import prelude
from socialai_dsl.program import LAST_ACTS
from socialai_dsl.render import tiles
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.marks import SIZES, Mark
from socialai_dsl.render.tiles import draw_tile
from socialai_dsl.traces.scripts import bundled

if TYPE_CHECKING:
    from playwright.sync_api import Page

SIZE = 32
Tile = tuple[tiles.Code, dict[str, Any]]

DRAW = """(tiles) => {
  const canvas = document.createElement("canvas");
  canvas.width = SIZE * 16;
  canvas.height = SIZE * Math.ceil(tiles.length / 16);
  const context = canvas.getContext("2d");
  tiles.forEach(([look, more], k) => drawTile(context, k % 16 * SIZE, Math.floor(k / 16) * SIZE, SIZE, look, more));
  return canvas.toDataURL("image/png");
}""".replace("SIZE", str(SIZE))


def all_tiles() -> list[Tile]:
    """Every object type in every colour and status, NPCs of each kind and gaze, gestures, and who stands on what."""
    types = [(one.code, len(one.states)) for one in prelude().types.values()]
    found: list[Tile] = [
        ((code, colour, status, 0), {})
        for code, states in types
        for colour in range(6)
        for status in range(states)
    ]
    found += [((code, 0, 0, 0), {}) for code in (tiles.UNSEEN, tiles.EMPTY, 5)]
    found += [((tiles.NPC, kind % 6, kind, 1), {}) for kind in range(30)]
    found += [((tiles.NPC, 2, 3, gaze), {}) for gaze in range(4)]
    found += [((prelude().types["marble"].code, 1, 1, way), {}) for way in range(4)]
    found += [
        ((tiles.EMPTY, 0, 0, 0), {"agent": way, "seen": seen}) for way in range(4) for seen in (True, False)
    ]
    found += [
        ((tiles.NPC, 4, 1, 0), {"gesture": {"pointing": pointing, "act": act}})
        for pointing in (-1, 0, 1, 2, 3)
        for act in LAST_ACTS
    ]
    rays = (
        [[(0, 0), (3, -1), 0, 4]],
        [[(-2, 1), (0, 0), 3, 1], [(0, 3), (0, 0), 3, 2]],
        [[(-1, 2), (3, -2), 3, 5]],
    )
    found += [((tiles.EMPTY, 0, 0, 0), {"rays": ray}) for ray in rays]
    found += [
        ((tiles.NPC, 4, 1, 0), {"held": (code, colour, 0, 0)}) for code, _ in types for colour in range(6)
    ]
    words = (
        *SIZES,
        "plain",
        "striped",
        "spotted",
        "checked",
        "cheerful",
        "angry",
        "surprised",
        "calm",
        "sad",
    )
    found += [
        ((code, 3, 0, 1), {"marks": [("look", word, 0, 0)]})
        for code in (prelude().types["ball"].code, prelude().types["box"].code, tiles.NPC)
        for word in (*words, "laughing", "afraid")
    ]
    tags = [[("a", "cap", place, 0), ("b", "rank", 7 - place, 1)] for place in range(8)]
    found += [((tiles.NPC, 4, 1, 0), {"marks": tag}) for tag in tags]
    ball = (prelude().types["ball"].code, 2, 0, 0)
    marks = [("size", "small", 0, 0), ("pattern", "striped", 1, 1)]
    found += [
        ((*ball[:2], 1, 0), {"marks": marks}),
        (ball, {"marks": marks}),
        ((tiles.EMPTY, 0, 0, 0), {"agent": 2, "held": ball, "marks": marks}),
    ]
    found += [((tiles.EMPTY, 0, 0, 0), {"agent": 1, "held": (prelude().types["ball"].code, 2, 1, 1)})]
    return [*found, ((tiles.NPC, 1, 2, 3), {"below": (prelude().types["door"].code, 0, 0, 0)})]


def as_png(look: tiles.Code, more: dict[str, Any]) -> np.ndarray:
    gesture = more.get("gesture")
    if gesture is not None:
        pointing = gesture["pointing"]
        gesture = Gesture(None if pointing < 0 else pointing, gesture["act"])
    held = more.get("held")
    marks = tuple(Mark(*mark) for mark in more.get("marks", ()))
    seen = more.get("seen", False)
    rays = tuple((*ray[:3], tiles.PALETTE[ray[3]]) for ray in more.get("rays", ()))
    return draw_tile(look, more.get("agent"), seen, SIZE, more.get("below"), gesture, held, marks, rays)


def pixels(address: str) -> np.ndarray:
    data = base64.b64decode(address.partition(",")[2])
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


@pytest.fixture
def drawing(page: Page) -> Page:
    page.set_content("<title>tiles</title>")
    page.add_script_tag(
        content=bundled("room.js") + "\nObject.assign(globalThis, {drawTile, drawPicture, Episode});"
    )
    return page


def test_every_type_colour_and_status_looks_the_same(drawing: Page) -> None:
    wanted = all_tiles()
    sheet = pixels(drawing.evaluate(DRAW, wanted))
    for number, (look, more) in enumerate(wanted):
        y, x = divmod(number, 16)
        drawn = sheet[y * SIZE : (y + 1) * SIZE, x * SIZE : (x + 1) * SIZE].astype(int)
        apart = np.abs(drawn - as_png(look, more).astype(int)).max(axis=2)
        assert apart.mean() < 12, f"{look} {more}: pixels differ by {apart.mean():.1f} of 255 on average"
        assert (apart > 64).mean() < 0.04, f"{look} {more}: {(apart > 64).sum()} pixels differ much"


def test_a_room_looks_the_same(drawing: Page) -> None:
    env = sd.make("talkitout", render_mode="rgb_array")
    trace = trace_of(
        env, [np.array([2, 0, 0, 0])] * 3, {"seed": 3}, scenario="talkitout", agent="test", episode="3"
    )
    drawn = drawing.evaluate(
        """(trace) => {
          const canvas = document.createElement("canvas");
          drawPicture(canvas, new Episode(trace).scenes.at(-1).room, {tile: 32});
          return canvas.toDataURL("image/png");
        }""",
        trace.model_dump(),
    )
    apart = np.abs(pixels(drawn).astype(int) - env.render().astype(int)).max(axis=2)
    assert apart.mean() < 6
    assert (apart > 64).mean() < 0.01
