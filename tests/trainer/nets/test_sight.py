"""The map of what was seen agrees with the room as it is."""

from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from trainer.errors import ObservationError
from trainer.nets import NetSpec
from trainer.nets.sight import MapSight, Sight

BOX, DOOR, BALL = 7, 4, 6
SHAPE, HIGH = (7, 7, 4), (11, 5, 2, 3)
STEPS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


def view(*things: tuple[int, int, int, int]) -> np.ndarray:
    """An image of an empty room with things: cells to the right, cells ahead, type, colour."""
    image = np.zeros((1, 7, 7, 4), np.uint8)
    image[..., 0] = 1
    for right, ahead, kind, color in things:
        image[0, right + 3, 6 - ahead, :2] = kind, color
    return image


def related(sight: MapSight, image: np.ndarray, right: int, ahead: int) -> list[int]:
    found: list[int] = image[0, right + 3, 6 - ahead, -len(sight.relations) :].tolist()
    return found


def test_others_in_view_are_counted() -> None:
    sight = MapSight(SHAPE, HIGH)
    assert sight.relations == [(1,), (0, 1)]
    boxes = view((-1, 2, BOX, 3), (0, 2, BOX, 3), (1, 2, BOX, 3), (2, 2, DOOR, 3), (3, 2, BALL, 1))
    image, _ = sight.look(boxes, np.zeros((1, sight.size), np.int64))
    assert image.shape == (1, *sight.shape)
    assert (image[..., :4] == boxes).all()
    assert related(sight, image, 0, 2) == [2, 2], (
        "three others of its colour, two of them boxes; two stands for more"
    )
    assert related(sight, image, 2, 2) == [2, 0]
    assert related(sight, image, 3, 2) == [0, 0]
    assert related(sight, image, 0, 1) == [0, 0], "floor and walls have no relations"


def test_others_out_of_view_are_remembered_until_the_episode_ends() -> None:
    sight = MapSight(SHAPE, HIGH)
    seen = np.zeros((1, sight.size), np.int64)
    wall = [(at, 3, 2, 5) for at in range(-3, 4)]
    _, seen = sight.look(view((2, 1, BOX, 4), *wall), seen)
    turned = [(ahead, at, kind, color) for at, ahead, kind, color in ((3, 3, 2, 5), (-1, 2, BOX, 4))]
    # To the left: what was to the right is behind now, and a second box comes into view.
    left = view(*((3, -at, 2, 5) for at in range(-3, 1)), (0, 2, BOX, 4))
    image, seen = sight.look(left, seen)
    assert related(sight, image, 0, 2) == [1, 1], turned
    fresh, _ = sight.look(left, np.zeros_like(seen))
    assert related(sight, fresh, 0, 2) == [0, 0]


@pytest.mark.parametrize("scenario", ["talkitout", "school/color_match", "novel/culprit"])
def test_the_agent_knows_where_it_is(scenario: str) -> None:
    """By its views alone, whatever it does, in nearly all steps."""
    env: Any = sd.make(scenario)
    spec = NetSpec.of(env)
    sight, rng, right, steps = MapSight(spec.image_shape, spec.image_high), np.random.default_rng(0), 0, 0
    for episode in range(20):
        observation, _ = env.reset(seed=episode)
        seen = np.zeros((1, sight.size), np.int64)
        begun, over = pose(env), False
        for _ in range(30):
            _, seen = sight.look(observation["image"][None], seen)
            x, y, direction = seen[0, :3]
            right += pose(env) == moved(begun, x, y, direction)
            steps += 1
            act = [rng.integers(size) for size in env.action_space.nvec]
            act[:2] = rng.integers(3), 0  # it turns and walks, and says nothing
            observation, _, ended, cut, _ = env.step(np.array(act))
            over = ended or cut
            if over:
                break
    assert steps > 200
    assert right / steps > 0.95, "now and then a corner looks alike from two sides"


def pose(env: Any) -> tuple[int, int, int]:
    agent = env.unwrapped.describe()["agent"]
    return (*agent["at"], ("up", "right", "down", "left").index(agent["facing"]))


def moved(begun: tuple[int, int, int], right: int, ahead: int, turned: int) -> tuple[int, int, int]:
    """A pose after steps to the right and ahead and turns to the right, all as seen from where it began."""
    x, y, facing = begun
    to_right, to_front = STEPS[(facing + 1) % 4], STEPS[facing]
    dx, dy = right * to_right + ahead * to_front
    return int(x + dx), int(y - dy), int((facing + turned) % 4)


def test_plain_sight_changes_nothing() -> None:
    images, seen = view((0, 2, BOX, 1)), np.zeros((1, 0), np.int64)
    assert Sight(SHAPE, HIGH).look(images, seen) == (images, seen)
    assert (Sight(SHAPE, HIGH).shape, Sight(SHAPE, HIGH).high) == (SHAPE, HIGH)


def test_a_cell_out_of_bounds_is_told() -> None:
    sight = MapSight(SHAPE, HIGH)
    with pytest.raises(ObservationError, match="image: a cell exceeds the bounds"):
        sight.look(view((0, 2, 12, 1)), np.zeros((1, sight.size), np.int64))
