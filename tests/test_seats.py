"""The engine and the reference interpreter agree on all seats: what each sees, hears and earns, and the whole state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.envs.factory import make, make_vec
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.loader.shipped import shipped_scenarios
from tests.agreement import Pair, seats_agree
from tests.quick import one_in
from tests.scenario_fuzzer import write, write_seated
from tests.shipped import scenarios

SEAT = "seat: open"
FOLDER = Path(__file__).parent / "data" / "agreement"
SAMPLES = [str(path) for path in sorted(FOLDER.glob("*.yaml")) if SEAT in path.read_text(encoding="utf-8")]
SHIPPED = [
    name for name in scenarios() if SEAT in (shipped_folder() / f"{name}.yaml").read_text(encoding="utf-8")
]
NAMES = [*SAMPLES, *SHIPPED]


@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_all_seats_agree_over_some_episodes(name: str) -> None:
    assert seats_agree(load(name), 60, seed=20) > 2, "hardly an episode"


@pytest.mark.thorough("plays two thousand steps of each scenario with several seats on the slow interpreter")
@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_all_seats_agree(name: str) -> None:
    assert seats_agree(load(name), 2000, seed=21) > 40, "hardly an episode"


def compare(folder: Path, seed: int, steps: int) -> int:
    """Play the seated scenario of a seed on both sides, the agent alone and then all seats; the number of episodes."""
    path = folder / f"random_{seed}.yaml"
    path.write_text(write_seated(seed), encoding="utf-8")
    loaded = load(str(path))
    program = compile_scenario(loaded.checked)
    Pair.of(loaded, program, number_words=False).play(seed, 0, np.random.default_rng(seed))
    return seats_agree(loaded, steps, seed, program, number_words=False)


@pytest.mark.parametrize(
    "first", one_in(10, range(0, 80, 8), "plays random scenarios on the slow interpreter")
)
def test_random_scenarios_agree_on_all_seats(tmp_path: Path, first: int) -> None:
    assert sum(compare(tmp_path, seed, steps=25) for seed in range(first, first + 8)) > 16


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(0, 5_000, 250))
def test_five_thousand_random_scenarios_agree_on_all_seats(tmp_path: Path, first: int) -> None:
    for seed in range(first, first + 250):
        compare(tmp_path, seed, steps=60)


OPENED = [
    *shipped_scenarios(),
    "school/lever_door",
    "school/boxes",
    "school/color_match",
    "classics/ice_cream_van",
]


@pytest.mark.parametrize("name", OPENED)
def test_opening_the_seats_of_a_scenario_changes_nothing_for_its_agent(name: str) -> None:
    """While nobody sits there, whoever has a frame follows it as ever: the same pictures, words and rewards."""
    plain, opened = (make_vec(one, 4, autoreset_mode="SameStep") for one in (name, f"{name}+seats"))
    for envs in (plain, opened):
        envs.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(50):
        played = rng.integers(0, plain.single_action_space.nvec, (4, len(plain.single_action_space.nvec)))
        (first, *rest, _), (second, *same, _) = plain.step(played), opened.step(played)
        np.testing.assert_array_equal(first["image"], second["image"])
        for one, other in zip(rest, same, strict=True):
            np.testing.assert_array_equal(one, other)
        assert plain.utterances() == opened.utterances()


@pytest.mark.parametrize(
    "name", [name for name in OPENED if name != "social_env" and "no_social" not in name]
)
def test_a_scenario_with_open_seats_is_played_from_the_side_of_others(name: str) -> None:
    env = make(f"{name}+seats", seats={"agent": "random"})
    assert env.unwrapped.seat_names != ("agent",)
    env.reset(seed=1)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated


SPOKEN_OF = (
    "seat: open",
    "  for:",
    "  reward:\n    ",
    "ann.said(",
    "ann.did(",
    "bob.action",
    "bob.spoke",
    "crowd:",
)
"""What authors can write about seats, and what the random scenarios are to contain."""


def test_random_scenarios_have_what_there_is_of_seats() -> None:
    texts = [write_seated(seed) for seed in range(40)]
    assert [word for word in SPOKEN_OF if not any(word in text for text in texts)] == []
    assert all(SEAT in text for text in texts)
    assert SEAT not in write(0), "the files of seeds are otherwise as they were"
