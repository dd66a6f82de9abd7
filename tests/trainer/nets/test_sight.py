"""The map of what was seen agrees with the room as it is."""

from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.trainer.errors import ObservationError
from socialai_dsl.trainer.nets import NetSpec
from socialai_dsl.trainer.nets.naming import NamingSight
from socialai_dsl.trainer.nets.sight import MapSight, Sight

BOX, DOOR, BALL = 7, 4, 6
NPC = 11
SHAPE, HIGH, WORDS = (7, 7, 4), (11, 5, 2, 3), 12
SILENCE = np.zeros((1, 8), np.int16)
RIGHT, DOWN, LEFT, UP = range(4)
STEPS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


def view(*things: tuple[int, int, int, int]) -> np.ndarray:
    """An image of an empty room with things: cells to the right, cells ahead, type, colour."""
    image = np.zeros((1, 7, 7, 4), np.uint8)
    image[..., 0] = 1
    for right, ahead, kind, color in things:
        image[0, right + 3, 6 - ahead, :2] = kind, color
    return image


def related(sight: MapSight, image: np.ndarray, right: int, ahead: int) -> list[int]:
    found: list[int] = image[0, right + 3, 6 - ahead, 4 : 4 + len(sight.relations)].tolist()
    return found


def people(
    *standing: tuple[int, int, int, int], things: tuple[tuple[int, int, int, int], ...] = ()
) -> np.ndarray:
    """An image of people: cells to the right, cells ahead, colour, where they look; and of things."""
    image = view(*things)
    for right, ahead, color, looks in standing:
        image[0, right + 3, 6 - ahead] = NPC, color, 0, looks
    return image


def faced(image: np.ndarray, right: int, ahead: int) -> int:
    return int(image[0, right + 3, 6 - ahead, -1])


def test_others_in_view_are_counted() -> None:
    sight = MapSight(SHAPE, HIGH, WORDS)
    assert sight.relations == [(1,), (0, 1)]
    boxes = view((-1, 2, BOX, 3), (0, 2, BOX, 3), (1, 2, BOX, 3), (2, 2, DOOR, 3), (3, 2, BALL, 1))
    image, _ = sight.look(boxes, SILENCE, np.zeros((1, sight.size), np.int64))
    assert image.shape == (1, *sight.shape)
    assert (image[..., :4] == boxes).all()
    assert related(sight, image, 0, 2) == [2, 2], (
        "three others of its colour, two of them boxes; two stands for more"
    )
    assert related(sight, image, 2, 2) == [2, 0]
    assert related(sight, image, 3, 2) == [0, 0]
    assert related(sight, image, 0, 1) == [0, 0], "floor and walls have no relations"


def test_others_out_of_view_are_remembered_until_the_episode_ends() -> None:
    sight = MapSight(SHAPE, HIGH, WORDS)
    seen = np.zeros((1, sight.size), np.int64)
    wall = [(at, 3, 2, 5) for at in range(-3, 4)]
    _, seen = sight.look(view((2, 1, BOX, 4), *wall), SILENCE, seen)
    turned = [(ahead, at, kind, color) for at, ahead, kind, color in ((3, 3, 2, 5), (-1, 2, BOX, 4))]
    # To the left: what was to the right is behind now, and a second box comes into view.
    left = view(*((3, -at, 2, 5) for at in range(-3, 1)), (0, 2, BOX, 4))
    image, seen = sight.look(left, SILENCE, seen)
    assert related(sight, image, 0, 2) == [1, 1], turned
    fresh, _ = sight.look(left, SILENCE, np.zeros_like(seen))
    assert related(sight, fresh, 0, 2) == [0, 0]


def test_people_out_of_view_are_not_remembered() -> None:
    """One who walks behind the agent and comes back is not a second one."""
    sight = MapSight(SHAPE, HIGH, WORDS)
    seen = np.zeros((1, sight.size), np.int64)
    for at in ((2, 2), (2, 0)):
        _, seen = sight.look(people((*at, 4, DOWN)), SILENCE, seen)
    _, seen = sight.look(people(), SILENCE, seen)
    image, _ = sight.look(people((-1, 3, 4, UP)), SILENCE, seen)
    assert related(sight, image, -1, 3) == [0, 0]


@pytest.mark.parametrize("turned", range(4))
def test_who_faces_what_is_seen_once_somebody_has_walked(turned: int) -> None:
    """Orientations are those of the room, and the agent looks in any direction of it."""
    sight = MapSight(SHAPE, HIGH, WORDS)
    box = (1, 4, BOX, 3)
    up, right = turned, (turned + 1) % 4  # ahead of the agent, and to its right, as the room has it
    seen = np.zeros((1, sight.size), np.int64)
    image, seen = sight.look(people((-2, 3, 4, up), things=(box,)), SILENCE, seen)
    assert (faced(image, -2, 3), faced(image, 1, 4)) == (0, 0)
    for at in range(-2, 1):
        image, seen = sight.look(people((at, 4, 4, up if at == -2 else right), things=(box,)), SILENCE, seen)
        assert faced(image, at, 4) == (BOX if at == 0 else 1), "one step ahead is the box, or the floor"
        assert faced(image, 1, 4) == (2 + 4 if at == 0 else 0), "its colour is that of who faces it"
    image, _ = sight.look(people((0, 4, 4, (right + 1) % 4), things=(box,)), SILENCE, seen)
    assert (faced(image, 0, 4), faced(image, 1, 4)) == (1, 1), "somebody faced the box before"


def test_things_are_called_by_what_is_said_while_they_look_so() -> None:
    """A thing is marked while it is named; words that are said of everything are no names."""
    sight = NamingSight(SHAPE, HIGH, WORDS)
    this, one, other = 2, 3, 4

    def marked(which: int) -> np.ndarray:
        image = view((-1, 2, BALL, 1), (1, 2, BALL, 2))
        image[0, (2, 4)[which], 4, 2] = 1
        return image

    def called(image: np.ndarray) -> list[int]:
        return [int(image[0, column, 4, -1]) for column in (2, 4)]

    def told(*words: int) -> np.ndarray:
        return np.array([[*words, *[0] * (8 - len(words))]], np.int16)

    seen, history = np.zeros((1, sight.size), np.int64), [this, one]
    image, seen = sight.look(marked(0), told(*history), seen)
    assert called(image) == [0, 0], "all that was heard was heard in the same presence"
    history += [this, other]
    image, seen = sight.look(marked(1), told(*history), seen)
    assert called(image)[1] == other
    image, seen = sight.look(marked(0), told(*history), seen)
    assert called(image)[0] == one
    history += [this, this]
    image, seen = sight.look(marked(0), told(*history), seen)
    assert called(image)[0] == one, "what was said of it first counts"
    image, _ = sight.look(marked(0), told(), np.zeros_like(seen))
    assert called(image) == [0, 0]


@pytest.mark.parametrize("scenario", ["talkitout", "school/color_match", "novel/culprit"])
def test_the_agent_knows_where_it_is(scenario: str) -> None:
    """By its views alone, whatever it does, in nearly all steps."""
    env: Any = sd.make(scenario)
    spec = NetSpec.of(env)
    sight, rng, right, steps = (
        MapSight(spec.image_shape, spec.image_high, spec.vocabulary_size),
        np.random.default_rng(0),
        0,
        0,
    )
    for episode in range(20):
        observation, _ = env.reset(seed=episode)
        seen = np.zeros((1, sight.size), np.int64)
        begun, over = pose(env), False
        for _ in range(30):
            _, seen = sight.look(observation["image"][None], observation["tokens"][None], seen)
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
    assert Sight(SHAPE, HIGH, WORDS).look(images, SILENCE, seen) == (images, seen)
    assert (Sight(SHAPE, HIGH, WORDS).shape, Sight(SHAPE, HIGH, WORDS).high) == (SHAPE, HIGH)


def test_a_cell_out_of_bounds_is_told() -> None:
    sight = MapSight(SHAPE, HIGH, WORDS)
    with pytest.raises(ObservationError, match="image: a cell exceeds the bounds"):
        sight.look(view((0, 2, 12, 1)), SILENCE, np.zeros((1, sight.size), np.int64))
