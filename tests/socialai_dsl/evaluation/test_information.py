"""What messages tell: all of what they name, nothing of what they do not, whatever the numbers of both."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from socialai_dsl.evaluation.information import (
    Messages,
    entropy,
    information,
    mutual_information,
    topographic_similarity,
)

EPISODES = 300


def messages(said: NDArray[np.int64]) -> Messages:
    """One message before each step of each episode, int64 (N, T)."""
    episodes, steps = np.indices(said.shape)
    weights = np.full(said.size, 1 / said.shape[1])
    return Messages(said.ravel(), episodes.ravel(), steps.ravel(), weights)


def test_the_information_of_a_table_is_as_in_the_textbook() -> None:
    # Cover and Thomas, Elements of Information Theory, example 2.2.1: H(X) = 7/4, H(Y) = 2, I(X; Y) = 3/8 bits.
    joint = np.array([[4, 2, 1, 1], [2, 4, 1, 1], [2, 2, 2, 2], [8, 0, 0, 0]]) / 32
    assert mutual_information(joint) == pytest.approx(3 / 8)
    assert entropy(joint.sum(axis=0)) == pytest.approx(7 / 4)
    assert entropy(joint.sum(axis=1)) == pytest.approx(2)
    assert mutual_information(64 * joint) == pytest.approx(3 / 8), "counts do as well"


@pytest.mark.parametrize("count", [2, 3, 8, 25])
def test_who_names_the_value_tells_all_of_it_and_who_speaks_by_chance_nothing(count: int) -> None:
    random = np.random.default_rng(count)
    values = np.repeat(random.permutation(np.arange(EPISODES) % count)[:, None], 4, axis=1)
    told = information(messages(random.permutation(count)[values]), values)
    assert told.bits == pytest.approx(told.possible) == pytest.approx(math.log2(count), abs=0.01)
    assert (told.p, told.chance < 0.5 * told.bits) == (0.001, True)
    guessed = information(messages(random.integers(0, count, values.shape)), values)
    assert abs(guessed.bits) < 0.02 * guessed.possible + guessed.chance
    assert guessed.possible == pytest.approx(told.possible)


def test_who_keeps_to_a_word_in_an_episode_is_not_taken_to_mean_something() -> None:
    """Many utterances that are one choice are no evidence, so few of many such speakers look as if they told."""
    found = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        values = np.repeat(random.integers(0, 3, 60)[:, None], 10, axis=1)
        said = np.repeat(random.integers(0, 3, 60)[:, None], 10, axis=1)
        found.append(information(messages(said), values).p)
    assert np.mean(np.array(found) <= 0.05) <= 0.15
    assert np.mean(found) == pytest.approx(0.5, abs=0.15)


def test_what_is_named_may_change_in_an_episode() -> None:
    random = np.random.default_rng(0)
    values = random.integers(0, 2, (EPISODES, 5))
    assert information(messages(values), values).bits == pytest.approx(1, abs=0.01)
    before = np.roll(values, 1, axis=1)
    late = information(messages(before), values)
    assert late.bits <= late.chance, "it names what was"


def test_like_is_called_alike_by_a_name_for_each_part_alone() -> None:
    meanings = list(product("abc", "xyz"))
    parts = [(f"{shape}!", f"{size}?") for shape, size in meanings]
    assert topographic_similarity(meanings, parts) == (
        pytest.approx(1),
        pytest.approx(0, abs=0.005),
    )
    random = np.random.default_rng(1)
    whole = [parts[k] for k in random.permutation(len(parts))]
    found = topographic_similarity(meanings, whole)
    assert found is not None
    assert found[0] < 0.4
    assert found[1] > 0.01
    assert topographic_similarity(meanings, [("a", "b")] * 9) is None
    assert topographic_similarity([("a",), ("b",)], [("x",), ("y",)]) is None, "one pair"
