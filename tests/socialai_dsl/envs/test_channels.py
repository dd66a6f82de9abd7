"""Pictures with gestures: six channels alone, in vectors, and beside scenarios that have four."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import socialai_dsl as sd
from socialai_dsl.program import LAST_ACTS, NO_GESTURE

PLAYROOM = str(Path(__file__).parents[2] / "data" / "playroom.yaml")
ROOM = {
    "room": {"width": 9, "height": 9},
    "agent": {"at": [4, 6], "facing": "up"},
    "peers": [
        {"at": [3, 4], "facing": "down", "pointing": "left", "last": "point", "state": "showing"},
        {"at": [5, 4], "facing": "down", "last": "forward"},
    ],
    "child": {"at": [1, 1], "last": "toggle"},
    "marble": {"at": [6, 2]},
    "lever": {"at": [1, 7]},
    "boxes": [{"at": [7, 7]}, {"at": [7, 5]}],
}


def random_steps(envs: Any, steps: int) -> list[Any]:
    rng = np.random.default_rng(0)
    return [
        envs.step(rng.integers(envs.single_action_space.nvec, size=(envs.num_envs, 4))) for _ in range(steps)
    ]


def test_gymnasiums_checker() -> None:
    check_env(gymnasium.make("SocialAI/Scenario-v1", scenario=PLAYROOM).unwrapped)


def test_pointing_and_last_acts_are_seen_from_the_agent() -> None:
    env = sd.make(PLAYROOM)
    observation, _ = env.reset(seed=0, options={"layout": ROOM})
    image = observation["image"]
    assert image.shape == (7, 7, 6)
    gestures = {tuple(map(int, cell)) for cell in image[..., 4:].reshape(-1, 2)}
    left_of_it = (2 - 3 + 2) % 4  # the direction "left" (2) as one who looks up (3) sees it
    assert gestures == {
        (NO_GESTURE, NO_GESTURE),
        (left_of_it, LAST_ACTS["point"] + left_of_it),
        (NO_GESTURE, LAST_ACTS["forward"]),
        (NO_GESTURE, LAST_ACTS["toggle"]),
    }


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_vector_shows_what_a_single_environment_shows(mode: str) -> None:
    envs, env = sd.make_vec(PLAYROOM, 3, autoreset_mode=mode), sd.make(PLAYROOM)
    observation, _ = envs.reset(seed=5)
    alone, _ = env.reset(seed=5, options={"index": 1})
    assert observation["image"].shape == (3, 7, 7, 6)
    rng = np.random.default_rng(1)
    for _ in range(30):
        assert np.array_equal(observation["image"][1], alone["image"])
        assert observation in envs.observation_space
        action = rng.integers(envs.single_action_space.nvec, size=(3, 4))
        observation, _, terminated, truncated, infos = envs.step(action)
        alone, *_, single_terminated, single_truncated, _ = env.step(action[1])
        assert (terminated[1], truncated[1]) == (single_terminated, single_truncated)
        if single_terminated or single_truncated:
            if mode == "SameStep":
                assert np.array_equal(infos["final_obs"]["image"][1], alone["image"])
            return
    pytest.fail("the episode did not end")


def test_scenarios_without_gestures_show_none_beside_those_with() -> None:
    envs = sd.make_vec([PLAYROOM, "talkitout"], 8)
    observation, _ = envs.reset(seed=0)
    assert observation["image"].shape == (8, 7, 7, 6)
    for step in (observation, *(result[0] for result in random_steps(envs, 20))):
        assert (step["image"][1::2, ..., 4:] == NO_GESTURE).all()
    assert (observation["image"][::2, ..., 5] != NO_GESTURE).any()


def test_a_copy_is_a_copy_and_a_snapshot_brings_the_picture_back() -> None:
    envs = sd.make_vec(PLAYROOM, 4, copy=False)
    first = envs.reset(seed=0)[0]["image"]
    kept, saved = first.copy(), envs.snapshot()
    later = random_steps(envs, 5)[-1][0]["image"]
    assert later is first
    assert not np.array_equal(kept, first)
    envs.restore(saved)
    assert np.array_equal(first, kept)
    copies = sd.make_vec(PLAYROOM, 4)
    assert copies.reset(seed=0)[0]["image"] is not copies.step(np.zeros((4, 4), np.int64))[0]["image"]


def test_pictures_that_differ_in_gestures_have_different_ids() -> None:
    envs = sd.make_vec(PLAYROOM, 2)
    still = {**ROOM, "peers": [{**ROOM["peers"][0], "pointing": "right"}, ROOM["peers"][1]]}  # type: ignore[index]
    envs.reset(seed=0, options={"layout": [ROOM, still]})
    one, other = envs.image_ids()
    assert one != other
