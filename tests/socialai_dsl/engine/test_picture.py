"""The picture shows the world cell `pos + (6 - j) * forward + (i - 3) * right`."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.views import view_table
from socialai_dsl.program import Field, Flag, Op, pack_cell
from tests.assembly import Assembly, batch_of, constant, entity_register, step


@pytest.mark.parametrize(("width", "height"), [(8, 8), (5, 9), (30, 4)])
def test_every_cell_of_every_pose(width: int, height: int) -> None:
    table = view_table(width, height).reshape(height, width, 4, 7, 7)
    rng = np.random.default_rng(0)
    for _ in range(2000):
        x, y, direction = rng.integers(width), rng.integers(height), rng.integers(4)
        i, j = rng.integers(7, size=2)
        forward = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
        right = ((0, 1), (-1, 0), (0, -1), (1, 0))[direction]
        seen = [
            at + (6 - j) * ahead + (i - 3) * aside
            for at, ahead, aside in zip((x, y), forward, right, strict=True)
        ]
        inside = 0 <= seen[0] < width and 0 <= seen[1] < height
        assert table[y, x, direction, i, j] == (seen[1] * width + seen[0] if inside else width * height)


@pytest.mark.parametrize("canvas", [(5, 9), (8, 8), (9, 9), (10, 10), (16, 8), (13, 10), (30, 30)])
@pytest.mark.parametrize("occlusion", [False, True], ids=["clear", "in the dark"])
def test_the_picture_is_that_part_of_the_board(canvas: tuple[int, int], occlusion: bool) -> None:
    """In every pose, for boards that are gathered by vectors and for larger ones."""
    width, height = canvas
    room = Assembly(size=canvas, canvas=canvas, flags=int(Flag.OCCLUSION) if occlusion else 0)
    poses = [
        (x, y, direction) for y in range(1, height - 1) for x in range(1, width - 1) for direction in range(4)
    ]
    batch = batch_of(room.program(), len(poses))
    rng = np.random.default_rng(0)
    cells = width * height + 1
    batch.state.boards[:, :cells] = rng.integers(0, 1 << 32, (len(poses), cells))
    own = [entity_register(0, name) for name in (Field.X, Field.Y, Field.DIR)]
    batch.state.registers[:, own] = poses
    step(batch)
    views = view_table(width, height).reshape(height, width, 4, 49)
    x, y, direction = np.array(poses).T
    expected = np.take_along_axis(
        batch.state.boards[:, :cells], views[y, x, direction].astype(np.intp), axis=1
    )
    if occlusion:  # of a bare room what is beyond the walls is dark
        expected[views[y, x, direction] == cells - 1] = 0
    expected[:, 3 * 7 + 6] = pack_cell(1)
    np.testing.assert_array_equal(batch.state.image, expected)


def test_what_is_seen() -> None:
    # The agent looks right from (1, 2); a door of colour 2 ahead in the right wall, an NPC to its left.
    colour = [
        (Op.LOAD, entity_register(2, Field.COLOR), constant(2)),
        (Op.LOAD, entity_register(1, Field.COLOR), constant(4)),
    ]
    room = Assembly(at=((1, 2), (2, 1), (4, 2)), npcs=1, objects=("door",), facing=(0, 3), reset=colour)
    image = batch_of(room.program()).state.image.view(np.uint8).reshape(7, 7, 4)
    assert image[3, 6].tolist() == [1, 0, 0, 0], "its own cell"
    assert image[3, 3].tolist() == [4, 2, 1, 0], "the door, three cells ahead"
    assert image[2, 5].tolist() == [11, 4, 1, 3], "the NPC, ahead to the left, facing up"
    assert image[1, 5].tolist() == [2, 5, 0, 0], "the wall"
    assert image[3, 2].tolist() == [1, 0, 0, 0], "beyond the room, on the canvas"
    assert image[3, 0].tolist() == [2, 5, 0, 0], "off the canvas"


def test_an_agent_without_a_place_sees_nothing() -> None:
    image = batch_of(Assembly(at=(None,)).program()).state.image[0]
    assert set(np.delete(image, 3 * 7 + 6).tolist()) == {pack_cell(2, 5)}


def test_digests_tell_pictures_apart() -> None:
    batch = batch_of(Assembly(at=((1, 2),)).program(), 2000)
    batch.state.image[:] = np.random.default_rng(0).integers(0, 3, batch.state.image.shape)
    batch.state.image[7] = batch.state.image[3]
    ids = batch.identify()
    assert ids[7] == ids[3]
    assert len(set(ids.tolist())) == 1999


def test_a_digest_depends_on_every_cell() -> None:
    batch = batch_of(Assembly(at=((1, 2),)).program(), 50)
    for k in range(49):
        batch.state.image[k, k] ^= 1 << 24
    assert len(set(batch.identify().tolist())) == 50


@pytest.mark.parametrize("own", range(4))
def test_egocentric_directions_of_npcs(own: int) -> None:
    """(direction - the agent's + 2) mod 4 for NPCs in view, after a reset and after steps; things stay as they are."""
    ahead = ((3, 2), (2, 3), (1, 2), (2, 1))[own]
    side = ((3, 3), (1, 3), (1, 1), (3, 1))[own]
    shown = {}
    for flags in (0, int(Flag.EGOCENTRIC)):
        for direction in range(4):
            room = Assembly(
                at=((2, 2), ahead, side), npcs=1, objects=("door",), facing=(own, direction), flags=flags
            )
            batch = batch_of(room.program())
            image = batch.state.image.view(np.uint8).reshape(7, 7, 4)
            shown[flags, direction] = image.copy()
            step(batch)
            np.testing.assert_array_equal(batch.state.image.view(np.uint8).reshape(7, 7, 4), image)
    for direction in range(4):
        plain, turned = shown[0, direction], shown[int(Flag.EGOCENTRIC), direction]
        assert plain[3, 5].tolist() == [11, 0, 1, direction]
        assert turned[3, 5].tolist() == [11, 0, 1, (direction - own + 2) % 4]
        turned[3, 5, 3] = direction
        np.testing.assert_array_equal(plain, turned)


def test_egocentric_directions_turn_with_the_agent() -> None:
    room = Assembly(at=((2, 2), (3, 2)), npcs=1, facing=(0, 1), flags=int(Flag.EGOCENTRIC))
    batch = batch_of(room.program())
    image = batch.state.image.view(np.uint8).reshape(7, 7, 4)
    assert image[3, 5].tolist() == [11, 0, 1, 3]
    step(batch, (1, 0, 0, 0))
    assert image[2, 6].tolist() == [11, 0, 1, 2]


def test_the_status_of_an_npc_is_its_code() -> None:
    """The greatest code unless the reset draws another one."""
    room = {"at": ((1, 2), (2, 2), (3, 2)), "npcs": 2}
    drawn = [(Op.LOAD, entity_register(2, Field.STATUS), constant(0))]
    for reset, expected in (((), [1, 2]), (drawn, [1, 0])):
        batch = batch_of(Assembly(reset=reset, **room).program())  # type: ignore[arg-type]
        image = batch.state.image.view(np.uint8).reshape(7, 7, 4)
        assert image[3, [5, 4], 2].tolist() == expected
