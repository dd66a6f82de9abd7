"""Room templates: what a bare room looks like, where one can stand and what one can look through."""

from __future__ import annotations

from pathlib import Path

import socialai_dsl as sd
from socialai_dsl.program import MAX_SIDE, Header, room_words
from socialai_dsl.semantics.setup import LARGEST

BUILT = """
scenario: built
about: A room with something of everything in it.
horizon: 20
earshot: room
grammar: {templates: [Hello <noun>], nouns: [you]}
room: {size: 5..6, build: [{wall: column(2)}, {lava: row(2)}]}
cast: {agent: {place: anywhere}}
outcome: [success: agent.spoke]
"""


def rows(text: str) -> list[int]:
    """Rows of bits, the leftmost cell in bit 0."""
    return [int(line.strip()[::-1].replace("#", "1").replace(".", "0"), 2) for line in text.split()]


def test_what_is_solid_and_what_is_opaque(tmp_path: Path) -> None:
    path = tmp_path / "built.yaml"
    path.write_text(BUILT, encoding="utf-8")
    program = sd.compile(sd.load(path))
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    smallest = program.words[program.header(Header.ROOM_AT) :][: room_words(width, height)].tolist()
    solid, floor, opaque = (smallest[width * height + 1 + k * height :][:height] for k in range(3))
    # Lava is built over the wall; the canvas is 6 x 6, and nobody can stand outside of the room.
    assert solid == rows("###### #.#.## #...## #.#.## ###### ######")
    assert floor == rows("...... .#.#.. ...... .#.#.. ...... ......")
    assert opaque == rows("#####. #.#.#. #...#. #.#.#. #####. ......")
    assert smallest[-width:] == rows("#####. #...#. ##.##. #...#. #####. ......"), "by columns"


def test_the_largest_room_that_is_accepted_can_be_compiled(tmp_path: Path) -> None:
    path = tmp_path / "built.yaml"
    path.write_text(BUILT.replace("size: 5..6", f"size: {LARGEST}"), encoding="utf-8")
    assert sd.compile(sd.load(path)).header(Header.CANVAS_WIDTH) == LARGEST == MAX_SIDE
