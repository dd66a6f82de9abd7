"""The engine draws what `socialai_dsl.draws` draws, bit for bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from socialai_dsl import draws
from socialai_dsl.engine import rng

WORDS = st.integers(0, 2**64 - 1)


@np.errstate(over="ignore")  # in plain Python, too, numbers wrap around
@njit
def all_draws(
    seed: np.uint64, index: np.uint64, episode: np.uint64, place: int, step: int, number: int, n: int
) -> tuple[np.uint64, np.uint64, int, bool, np.uint64]:
    key = rng.episode_key(seed, index, episode)
    bits = rng.draw(key, place, step, number)
    return (
        key,
        bits,
        rng.below(bits, n),
        rng.holds_with_chance(bits, n & 0xFFFF),
        rng.attempt_key(key, step & 63),
    )


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
    key, bits, below, holds, next_key = all_draws(
        np.uint64(seed), np.uint64(index), np.uint64(episode), place, step, number, n
    )
    expected_key = draws.episode_key(seed, index, episode)
    expected = draws.draw(expected_key, place, step, number)
    assert (int(key), int(bits)) == (expected_key, expected)
    assert below == draws.below(expected, n)
    assert holds == draws.holds_with_chance(expected, (n & 0xFFFF) / 65536)
    assert 0 <= below < n
    assert int(next_key) == draws.attempt_key(expected_key, step & 63)


def test_below_nothing_is_zero() -> None:
    assert all_draws(np.uint64(1), np.uint64(1), np.uint64(1), 1, 1, 1, 0)[2] == 0
    assert all_draws(np.uint64(1), np.uint64(1), np.uint64(1), 1, 1, 1, -3)[2] == 0


def test_attempts_have_keys_of_their_own() -> None:
    key = draws.episode_key(1, 2, 3)
    keys = [draws.attempt_key(key, attempt) for attempt in range(64)]
    assert keys[0] == key
    assert len(set(keys)) == 64
    assert not set(keys[1:]) & {draws.draw(key, 0, 0, number) for number in range(1 << 16)}
