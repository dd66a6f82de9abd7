"""The cells that a member of the cast sees are those of the engine's `sees`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.gaze import Gaze
from socialai_dsl.frontend import Loaded, load

AHEAD = {"right": (1, 0), "down": (0, 1), "left": (-1, 0), "up": (0, -1)}


def env_of(loaded: Loaded) -> ScenarioEnv:
    return ScenarioEnv(compile_loaded(loaded), scenarios=scenarios_of(loaded))


def square(described: dict[str, Any], who: str, side: int) -> set[tuple[int, int]]:
    """The cells of a view square in a room without anything that hides."""
    (x, y), (dx, dy) = described[who]["at"], AHEAD[described[who]["facing"]]
    return {
        (x + ahead * dx - right * dy, y + ahead * dy + right * dx)
        for ahead in range(side)
        for right in range(-(side // 2), side // 2 + 1)
    }


def pictured(described: dict[str, Any], who: str, image: NDArray[np.uint8]) -> set[tuple[int, int]]:
    """The cells that somebody's picture shows, and where it stands."""
    (x, y), (dx, dy) = described[who]["at"], AHEAD[described[who]["facing"]]
    return {
        (x + ahead * dx - right * dy, y + ahead * dy + right * dx)
        for ahead in range(7)
        for right in range(-3, 4)
        if image[right + 3, 6 - ahead, 0] != 0 or (ahead, right) == (0, 0)
    }


@pytest.mark.parametrize("name", ["talkitout", "school/doors", "school/levers"])
def test_what_the_agent_sees_is_what_its_picture_shows(name: str) -> None:
    """Where opaque things hide others, too."""
    loaded = load(name)
    env, random = env_of(loaded), np.random.default_rng(0)
    gaze = Gaze(loaded, scenarios_of(loaded)[0], 0)
    hidden = 0
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        gaze.begin(seed, None, observation["image"])
        for step in range(25):
            described, image = env.describe(), observation["image"]
            shown = pictured(described, "agent", image)
            room = {
                (i, j) for i in range(described["room"]["width"]) for j in range(described["room"]["height"])
            }
            assert gaze.cells(begins=step == 0) & room == shown & room
            hidden += len(square(described, "agent", 7) & room - shown)
            action = random.integers(0, env.action_space.nvec, dtype=np.int64)  # type: ignore[attr-defined]
            observation, _, terminated, truncated, _ = env.step(action)
            gaze.follow([action], observation["image"])
            if terminated or truncated:
                break
    assert (hidden > 0) is (name != "talkitout")


WATCHERS = """scenario: watchers
about: Three who turn on the spot, and see far or near.
horizon: 9
grammar: {templates: [Hello <noun>], nouns: [you]}
room: {size: 20}
objects:
  door: {type: door, at: [0, 5]}
frames:
  turning: {steps: [{do: turn(left), for: ever}]}
cast:
  far: {at: [9, 9], view: 15, facing: up, frame: turning}
  near: {at: [5, 12], view: 4, facing: left}
  blind: {at: [2, 2], view: 1, facing: down}
  agent: {at: [9, 12]}
outcome: [{success: agent.at(door)}]
"""


def test_the_view_square_is_the_members_own(tmp_path: Path) -> None:
    file = tmp_path / "watchers.yaml"
    file.write_text(WATCHERS)
    loaded = load(str(file))
    env, checked = env_of(loaded), scenarios_of(loaded)[0]
    room = {(i, j) for i in range(20) for j in range(20)}
    for number, (who, side) in enumerate((("far", 15), ("near", 4), ("blind", 1)), 1):
        assert checked.entities[number].view == side
        gaze = Gaze(loaded, checked, number)
        observation, _ = env.reset(seed=1)
        gaze.begin(1, None, observation["image"])
        for step in range(3):
            assert gaze.cells(begins=step == 0) == square(env.describe(), who, side) & room
            action = env.encode_action((None, None))
            observation = env.step(action)[0]
            gaze.follow([action], observation["image"])


@pytest.mark.parametrize("others", [{"agent": "random"}, {"partner": "random"}, {"partner": "script"}])
def test_with_several_seats_it_follows_what_all_of_them_do(others: dict[str, str]) -> None:
    loaded = load("together/levers_together")
    env = ScenarioEnv(compile_loaded(loaded), scenarios=scenarios_of(loaded), seats=others)
    own = env.seats.index(env.seat_names[0])
    gazes = {
        seat: Gaze(loaded, scenarios_of(loaded)[0], number, own) for number, seat in enumerate(env.seats)
    }
    observation, _ = env.reset(seed=1)
    for gaze in gazes.values():
        gaze.begin(1, None, observation["image"])
    random, seen = np.random.default_rng(0), set()
    room = {(x, y) for x in range(9) for y in range(5)}
    for step in range(20):
        for seat, gaze in gazes.items():
            shown = pictured(env.describe(), seat, env.seat_moment(seat).observation["image"])
            assert gaze.cells(begins=step == 0) & room == shown & room
            seen.add((seat, frozenset(shown)))
        action = random.integers(0, env.action_space.nvec, dtype=np.int64)  # type: ignore[attr-defined]
        observation, _, terminated, truncated, _ = env.step(action)
        for gaze in gazes.values():
            gaze.follow([env.seat_moment(seat).action for seat in env.seats], observation["image"])
        if terminated or truncated:
            break
    assert len(seen) > 4, "somebody has moved"


def test_of_a_suite_the_member_is_asked_that_has_it() -> None:
    loaded = load("social_env")
    env, scenarios = env_of(loaded), scenarios_of(loaded)
    gaze = Gaze(loaded, scenarios[0], 1)
    seen = set()
    for seed in range(12):
        observation, _ = env.reset(seed=seed)
        gaze.begin(seed, None, observation["image"])
        assert bool(gaze.cells(begins=True)) is (env.scenario is scenarios[0])
        seen.add(env.scenario is scenarios[0])
    assert seen == {True, False}
