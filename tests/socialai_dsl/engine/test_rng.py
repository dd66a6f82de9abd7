"""The engine draws what `socialai_dsl.draws` draws, bit for bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from socialai_dsl import draws
from socialai_dsl.engine import rng

WORDS = st.integers(0, 2**64 - 1)


@njit
def all_draws(
    seed: np.uint64, index: np.uint64, episode: np.uint64, place: int, step: int, number: int, n: int
) -> tuple[np.uint64, np.uint64, int, bool]:
    key = rng.episode_key(seed, index, episode)
    bits = rng.draw(key, place, step, number)
    return key, bits, rng.below(bits, n), rng.holds_with_chance(bits, n & 0xFFFF)


@settings(deadline=None)
@given(
    seed=st.one_of(st.integers(0, draws.MAX_SEED), st.just(draws.TEST_DOMAIN)),
    index=st.integers(0, 2**40),
    episode=st.integers(0, 2**40),
    place=st.integers(0, 2**31 - 1),
    step=st.integers(0, 2**16 - 1),
    number=st.integers(0, 2**16 - 1),
    n=st.integers(1, 2**31),
)
def test_draws(seed: int, index: int, episode: int, place: int, step: int, number: int, n: int) -> None:
    key, bits, below, holds = all_draws(
        np.uint64(seed), np.uint64(index), np.uint64(episode), place, step, number, n
    )
    expected_key = draws.episode_key(seed, index, episode)
    expected = draws.draw(expected_key, place, step, number)
    assert (int(key), int(bits)) == (expected_key, expected)
    assert below == draws.below(expected, n)
    assert holds == draws.holds_with_chance(expected, (n & 0xFFFF) / 65536)
    assert 0 <= below < n


def test_below_nothing_is_zero() -> None:
    assert all_draws(np.uint64(1), np.uint64(1), np.uint64(1), 1, 1, 1, 0)[2] == 0
    assert all_draws(np.uint64(1), np.uint64(1), np.uint64(1), 1, 1, 1, -3)[2] == 0
