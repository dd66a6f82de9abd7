"""No two episodes share their randomness: keys of many seeds and environments, and draws of neighbours."""

import numpy as np
import pytest

from socialai_dsl.draws import GOLDEN, draw, episode_key, mix, site

SEEDS, ENVS = 100, 4096
Keys = np.ndarray


def mixed(values: Keys) -> Keys:
    """`draws.mix` of many numbers."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))


def keys(episode: int = 0) -> Keys:
    """The keys of an episode of all seeds and environments, (SEEDS, ENVS)."""
    golden = np.uint64(GOLDEN)
    first = mixed(np.arange(SEEDS, dtype=np.uint64) + golden)
    second = mixed(first[:, None] + (np.arange(ENVS, dtype=np.uint64) + np.uint64(1)) * golden)
    return mixed(second + np.uint64(episode + 1) * golden)


def drawn(all_keys: Keys, place: int, step: int = 0, number: int = 0) -> Keys:
    """The draws as numbers between 0 and 1."""
    word = np.uint64((place << 32) | (step << 16) | number)
    return mixed(all_keys + word * np.uint64(GOLDEN)) / 2.0**64


@pytest.fixture(autouse=True)
def _numbers_may_wrap() -> None:
    np.seterr(over="ignore")


def test_these_are_the_engines_keys_and_draws() -> None:
    assert int(keys(3)[17, 4000]) == episode_key(17, 4000, 3)
    assert (
        drawn(keys(), site("let.exit"), 5, 2)[9, 8]
        == draw(episode_key(9, 8, 0), site("let.exit"), 5, 2) / 2**64
    )
    assert int(mixed(np.array([12345], np.uint64))[0]) == mix(12345)


def test_no_two_environments_share_a_key() -> None:
    """The key is all that draws depend on; of 1.2 million random ones two are alike with probability 4e-8."""
    found = np.concatenate([keys(episode).ravel() for episode in range(3)])
    assert len(np.unique(found)) == 3 * SEEDS * ENVS


def test_draws_of_neighbours_do_not_depend_on_each_other() -> None:
    place, other = site("let.exit"), site("cast.wizard.cell")
    one = drawn(keys(), place)
    pairs = {
        "seeds": (one[:-1], one[1:]),
        "environments": (one[:, :-1], one[:, 1:]),
        "episodes": (one, drawn(keys(1), place)),
        "steps": (one, drawn(keys(), place, step=1)),
        "numbers": (one, drawn(keys(), place, number=1)),
        "places": (one, drawn(keys(), other)),
    }
    for name, (a, b) in pairs.items():
        r = np.corrcoef(a.ravel(), b.ravel())[0, 1]
        assert abs(r) < 4 / a.size**0.5, name
    assert abs(one.mean() - 0.5) < 4 * (1 / 12 / one.size) ** 0.5
    per_seed = one.mean(axis=1)
    assert np.abs(per_seed - 0.5).max() < 5 * (1 / 12 / ENVS) ** 0.5
