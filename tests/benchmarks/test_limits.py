"""The hard-coded versions of TalkItOut play as the engine does, in rooms that both are put into."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from benchmarks.limits import WORDS, CompiledC, CompiledNumba, HardCoded, has_compiler

ENVS = 300
COLORS = ("red", "green", "blue", "purple", "yellow", "grey")
DIRECTIONS = ("right", "down", "left", "up")
NEEDS_C = pytest.mark.skipif(not has_compiler(), reason="there is no C compiler")
MAKERS = [
    pytest.param(CompiledC, id="c", marks=NEEDS_C),
    pytest.param(lambda count: CompiledC(count, portable=True), id="portable c", marks=NEEDS_C),
    pytest.param(CompiledNumba, id="numba"),
]

Make = Callable[[int], HardCoded]


@pytest.fixture
def engine(tmp_path: Path) -> Any:
    """The engine's environments in rooms of 8 x 8."""
    (tmp_path / "large.yaml").write_text("variant: large\nof: talkitout\nset: {room: {size: 8}}\n")
    return sd.make_vec(tmp_path / "large.yaml", num_envs=ENVS)


def rooms_of(engine: Any) -> np.ndarray:
    """The rooms that the engine's environments are in, as the hard-coded ones take them."""
    return np.array([room_of(engine.describe(i)) for i in range(ENVS)], np.int32)


def room_of(state: dict[str, Any]) -> list[int]:
    guides, doors = [state[name] for name in ("wizard", "honest", "liar")], state["doors"]
    return [
        *(cell(state["agent"]), DIRECTIONS.index(state["agent"]["facing"])),
        *(cell(door) for door in doors),
        *(COLORS.index(door["color"]) for door in doors),
        int(state["let"]["exit"][len("doors[") : -1]),
        *(cell(guide) for guide in guides),
        *(COLORS.index(guide["color"]) for guide in guides),
        int(state["honest"]["name"] == "Jack"),
    ]


def cell(thing: dict[str, Any]) -> int:
    x, y = thing["at"]
    return 8 * y + x


def told(tokens: np.ndarray, vocabulary: tuple[str, ...]) -> list[str]:
    return [vocabulary[token] for token in tokens if token]


def liars_draws(words: list[str], liar: str) -> list[str]:
    """What was heard but for the colors that the liar drew: he draws on his own in each version."""
    return ["?" if words[max(i - 4, 0)] == liar and word in COLORS else word for i, word in enumerate(words)]


def alike(word: str, expected: str) -> bool:
    return word == expected or (expected == "?" and word in COLORS)


def actions(rng: np.random.Generator) -> np.ndarray:
    """Walking and the utterances that mean something, and seldom what ends an episode."""
    plan = np.zeros((ENVS, 4), np.int64)
    plan[:, 0] = rng.choice(8, ENVS, p=[0.2, 0.2, 0.4, 0.02, 0.02, 0.005, 0.005, 0.15])
    plan[:, 1] = rng.integers(0, 2, ENVS)
    plan[:, 2:] = np.array([(3, 3), (0, 1), (1, 0), (2, 5)])[rng.choice(4, ENVS, p=[0.45, 0.4, 0.05, 0.1])]
    return plan


@pytest.mark.thorough("compiles what has TalkItOut hard-coded")
@pytest.mark.parametrize("make", MAKERS)
def test_the_same_happens_in_the_same_rooms(engine: Any, make: Make) -> None:
    rng = np.random.default_rng(0)
    seen, _ = engine.reset(seed=4)
    states = [engine.describe(i) for i in range(ENVS)]
    limit = make(ENVS)
    limit.reset(seed=0)
    got = limit.enter(rooms_of(engine))
    assert np.array_equal(got["image"], seen["image"])
    going, endings = np.ones(ENVS, bool), {"success": 0, "failure": 0, "timeout": 0}
    heard = 0
    for _ in range(100):
        plan = actions(rng)
        seen, reward, terminated, truncated, _ = engine.step(plan)
        got, *results, _ = limit.step(plan)
        assert np.array_equal(got["image"][going], seen["image"][going])
        for mine, yours in zip(results, (reward, terminated, truncated), strict=True):
            assert np.array_equal(mine[going], yours[going])
        for i in np.flatnonzero(going):
            expected = liars_draws(
                told(seen["tokens"][i], engine.vocabulary), states[i]["liar"]["name"].lower()
            )
            words = told(got["tokens"][i], WORDS)
            assert all(alike(*pair) for pair in zip(words, expected[-64:], strict=True)), (words, expected)
            heard = max(heard, len(expected))
        endings["success"] += np.count_nonzero(going & (reward > 0))
        endings["failure"] += np.count_nonzero(going & terminated & (reward == 0))
        endings["timeout"] += np.count_nonzero(going & truncated)
        going &= ~(terminated | truncated)
    assert not going.any()
    assert min(endings.values()) > 3, "every way to end was met"
    assert heard > 64, "some histories outgrew the room for them"


@pytest.mark.thorough("compiles the limit")
@pytest.mark.parametrize("make", MAKERS)
def test_an_episode_that_ended_is_drawn_anew(make: Make) -> None:
    limit = make(3)
    first = limit.reset(seed=1)[0]["image"].copy()
    done = np.array([[6, 0, 0, 0], [7, 0, 0, 0], [7, 0, 0, 0]])
    _, reward, terminated, truncated, _ = limit.step(done)
    assert (terminated.tolist(), truncated.any(), reward.any()) == ([True, False, False], False, False)
    after, _, terminated, *_ = limit.step(done)
    assert not terminated[0], "this step began the next episode"
    assert terminated.tolist() == [False, False, False]
    assert not np.array_equal(after["image"][0], first[0])
    assert np.array_equal(after["image"][1:], first[1:])


@pytest.mark.parametrize("make", MAKERS)
def test_rooms_are_drawn_as_the_engine_draws_them(engine: Any, make: Make) -> None:
    """What the agent sees at a reset holds as many things of each kind and color, up to chance."""
    limit = make(3000)
    got = limit.reset(seed=5)[0]["image"].reshape(-1, 4)
    seen = np.concatenate([engine.reset(seed=seed)[0]["image"].reshape(-1, 4) for seed in range(10)])
    for kind, share in ((4, 0.03), (11, 0.03)):
        for color in range(6):
            counts = [
                np.count_nonzero((cells[:, 0] == kind) & (cells[:, 1] == color)) for cells in (got, seen)
            ]
            assert abs(counts[0] - counts[1]) < 6 * sum(counts) ** 0.5, (kind, color)
        totals = [np.count_nonzero(cells[:, 0] == kind) for cells in (got, seen)]
        assert abs(totals[0] - totals[1]) < share * sum(totals)
