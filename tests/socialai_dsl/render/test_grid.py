"""Pictures of rooms: what differs looks different, gaze turns with direction, sizes are as promised."""

from itertools import combinations

import numpy as np
import pytest

from socialai_dsl.library import prelude
from socialai_dsl.render import tiles
from socialai_dsl.render.grid import draw_ansi, draw_grid
from socialai_dsl.render.tiles import draw_tile

CODES = {name: type_.code for name, type_ in prelude().types.items()}

OBJECTS = [
    *[(kind, 0, 0, 0) for kind in (1, 2, 3, 4, 6, 7, 9, 11, 12, 13, 14, 15, 16, 17, 18, 19)],
    *[(CODES["door"], 0, status, 0) for status in (1, 2)],
    (CODES["remote_door"], 0, 1, 0),
    (CODES["box"], 0, 2, 0),
    *[
        (kind, 0, 1, 0)
        for kind in (CODES["box"], CODES["switch"], CODES["apple"], CODES["lever"], CODES["generator"])
    ],
    *[(tiles.NPC, 0, kind, 0) for kind in range(1, 24)],
    (CODES["ball"], 0, 1, 1),
    (tiles.UNSEEN, 0, 0, 0),
    (5, 0, 0, 0),
]


def room(width: int = 6, height: int = 5) -> np.ndarray:
    codes = np.zeros((height, width, 4), np.uint8)
    codes[...] = (CODES["wall"], 5, 0, 0)
    codes[1:-1, 1:-1] = (tiles.EMPTY, 0, 0, 0)
    return codes


def test_objects_can_be_told_apart() -> None:
    pictures = {code: draw_tile(code, None, False, 32).astype(int) for code in OBJECTS}
    for one, other in combinations(OBJECTS, 2):
        changed = np.abs(pictures[one] - pictures[other]).max(axis=2) > 40
        assert changed.sum() >= 8, f"{one} and {other} look alike"


@pytest.mark.parametrize(
    "kind", [CODES["door"], CODES["ball"], CODES["box"], CODES["switch"], tiles.NPC, CODES["marble"]]
)
def test_the_six_colours_can_be_told_apart(kind: int) -> None:
    pictures = [draw_tile((kind, colour, 0, 0), None, False, 32).astype(int) for colour in range(6)]
    for one, other in combinations(range(6), 2):
        assert np.abs(pictures[one] - pictures[other]).sum(axis=2).max() > 60, (one, other)


@pytest.mark.parametrize("kind", range(12))
def test_the_gaze_is_seen_under_every_hat(kind: int) -> None:
    """An arrow at the edge of the cell, on the side that the NPC faces and on no other."""
    edges = [np.s_[10:22, 25:31], np.s_[25:31, 10:22], np.s_[10:22, 1:7], np.s_[1:7, 10:22]]
    for direction, edge in enumerate(edges):
        face = draw_tile((tiles.NPC, 4, kind, direction), None, False, 32).astype(int)
        other = draw_tile((tiles.NPC, 4, kind, (direction + 1) % 4), None, False, 32).astype(int)
        changed = np.abs(face[edge] - other[edge]).max(axis=2) > 60
        assert changed.sum() >= 15, (kind, direction)


def test_whoever_stands_in_a_doorway_is_drawn_within_its_frame() -> None:
    npc, door = (tiles.NPC, 4, 2, 1), (CODES["door"], 1, 0, 0)
    alone = draw_tile(npc, None, False, 32)
    inside = draw_tile(npc, None, False, 32, below=door)
    frame = draw_tile(door, None, False, 32)
    assert (inside[:, 31] == frame[:, 31])[3:-3].mean() > 0.8, "the frame of the door is seen at the edge"
    assert (inside[16:24, 8:24] == alone[16:24, 8:24]).all(), "and the face in the middle"


@pytest.mark.parametrize("direction", [0, 1, 2, 3])
def test_the_agent_turns(direction: int) -> None:
    """Numbered clockwise: three quarter turns to the left of the picture are one to the right."""
    right = draw_tile((tiles.EMPTY, 0, 0, 0), 0, False, 32).astype(int)
    turned = draw_tile((tiles.EMPTY, 0, 0, 0), direction, False, 32).astype(int)
    difference = np.abs(np.rot90(right, -direction) - turned).max(axis=2)
    assert (difference > 60).mean() < 0.03


@pytest.mark.parametrize("direction", [0, 1, 2, 3])
def test_an_npc_looks_where_it_is_turned(direction: int) -> None:
    """The pupils lie off the face's centre, on the side of the gaze."""
    face = draw_tile((tiles.NPC, 4, 5, direction), None, False, 64).astype(int)
    dark = face[24:56].sum(axis=2) < 200
    rows, columns = np.nonzero(dark)
    dx, dy = columns.mean() + 0.5 - 32, rows.mean() + 24.5 - 0.53 * 64
    ahead = ((dx, dy), (dy, -dx), (-dx, -dy), (-dy, dx))[direction]
    assert ahead[0] > 4, ahead
    assert abs(ahead[1]) < ahead[0] / 2, ahead


def test_shape_and_dtype() -> None:
    picture = draw_grid(room(6, 5), (2, 2, 0), tile=20)
    assert picture.shape == (100, 120, 3)
    assert picture.dtype == np.uint8


def test_only_the_seen_cells_are_tinted() -> None:
    seen = np.zeros((5, 6), bool)
    seen[1, 1] = True
    plain = draw_grid(room(), (3, 3, 0), tile=16)
    tinted = draw_grid(room(), (3, 3, 0), seen, tile=16)
    changed = (plain != tinted).any(axis=2)
    assert changed[16:32, 16:32].all()
    changed[16:32, 16:32] = False
    assert not changed.any()


def test_the_view_is_outlined_over_walls() -> None:
    seen = np.zeros((5, 6), bool)
    seen[0, 0:2] = True
    picture = draw_grid(room(), (3, 3, 0), seen, tile=16)
    line = (picture == tiles.SEEN_LINE).all(axis=2)
    assert line[0, :32].all(), "along the top of both cells"
    assert line[:16, 0].all(), "down the left side"
    assert not line[1:15, 15:17].any(), "not between two cells that are seen"
    assert not line[16:].any()
    assert not line[:, 32:].any()


def test_what_lies_below_is_drawn_where_it_is() -> None:
    codes = room()
    codes[0, 2] = (tiles.NPC, 4, 0, 1)
    plain = draw_grid(codes, (3, 3, 0), tile=16)
    framed = draw_grid(codes, (3, 3, 0), tile=16, below={(2, 0): (CODES["door"], 1, 0, 0)})
    changed = (plain != framed).any(axis=2)
    assert changed[:16, 32:48].any()
    changed[:16, 32:48] = False
    assert not changed.any()


def test_the_agent_stands_where_it_is() -> None:
    without = draw_grid(room(), (-1, -1, 0), tile=16)
    changed = (draw_grid(room(), (3, 2, 1), tile=16) != without).any(axis=2)
    rows, columns = np.nonzero(changed)
    assert (rows.min() // 16, rows.max() // 16) == (2, 2)
    assert (columns.min() // 16, columns.max() // 16) == (3, 3)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected an array of shape \(H, W, 4\), got \(5, 6\)"):
        draw_grid(np.zeros((5, 6), np.uint8), (1, 1, 0))
    with pytest.raises(ValueError, match=r"seen: expected .*\(5, 6\), got \(6, 5\)"):
        draw_grid(room(), (1, 1, 0), np.zeros((6, 5), bool))


def test_text_picture() -> None:
    codes = room(5, 4)
    codes[0, 2] = (CODES["door"], 1, 2, 0)
    codes[1, 2] = (CODES["lava"], 0, 0, 0)
    codes[2, 3] = (tiles.NPC, 2, 1, 2)
    assert draw_ansi(codes, (1, 1, 3)).splitlines() == [
        "####gL####",
        "## ^ ~ .##",
        "## . .B<##",
        "##########",
    ]


def test_colours_of_the_text_picture_only_when_asked() -> None:
    codes = room(4, 3)
    assert "\x1b" not in draw_ansi(codes, (1, 1, 0))
    coloured = draw_ansi(codes, (1, 1, 0), colour=True)
    assert "\x1b[1;31m >\x1b[0m" in coloured
