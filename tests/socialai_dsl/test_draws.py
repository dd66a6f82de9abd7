"""The contract of randomness: known values, no repeated keys, uniform choices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl import draws

U64 = st.integers(0, draws.MASK)


def test_mix_is_the_finaliser_of_splitmix64() -> None:
    # First outputs of splitmix64 seeded with 0, as published with the generator.
    state, outputs = 0, []
    for _ in range(3):
        state = (state + draws.GOLDEN) & draws.MASK
        outputs.append(draws.mix(state))
    assert outputs == [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]


@given(U64, U64)
def test_mix_is_a_bijection(a: int, b: int) -> None:
    assert (draws.mix(a) == draws.mix(b)) == (a == b)


def test_no_two_episodes_of_many_seeds_share_a_key() -> None:
    keys = {draws.episode_key(s, i, e) for s in range(20) for i in range(50) for e in range(20)}
    keys |= {draws.episode_key(draws.TEST_DOMAIN, 0, e) for e in range(500)}
    assert len(keys) == 20 * 50 * 20 + 500


def test_neighbouring_seeds_do_not_share_environments() -> None:
    first = {draws.episode_key(0, i, 0) for i in range(4096)}
    second = {draws.episode_key(1, i, 0) for i in range(4096)}
    assert not first & second


@given(U64, st.integers(1, 1000))
def test_below_stays_below(bits: int, n: int) -> None:
    assert 0 <= draws.below(bits, n) < n


@pytest.mark.parametrize("n", [2, 3, 6, 16])
def test_choices_are_uniform_over_steps_sites_and_numbers(n: int) -> None:
    key = draws.episode_key(7, 0, 0)
    place = draws.site("let.exit")
    for vary in range(3):
        tuples = [tuple(k if j == vary else 3 for j in range(3)) for k in range(6000)]
        counts = np.bincount(
            [draws.below(draws.draw(key, place + a, b, c), n) for a, b, c in tuples], minlength=n
        )
        expected = 6000 / n
        chi_square = float(((counts - expected) ** 2 / expected).sum())
        assert chi_square < n - 1 + 6 * (2 * (n - 1)) ** 0.5, counts


def test_chance_is_exact_at_its_ends() -> None:
    assert not draws.holds_with_chance(0, 0.0)
    assert draws.holds_with_chance(draws.MASK, 1.0)


def test_sites_of_different_places_differ() -> None:
    paths = [
        f"cast.{name}.{leaf}" for name in ("wizard", "honest", "liar") for leaf in ("cell", "color", "facing")
    ]
    assert len({draws.site(path) for path in paths}) == len(paths)
    assert draws.site("let.exit") == draws.site("let.exit") < 1 << 31
