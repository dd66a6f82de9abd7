"""The interval of the mean success of several players in the same rooms."""

import numpy as np
import pytest

from socialai_dsl.episodes.results import interval_over_rooms, wilson_interval


@pytest.mark.parametrize("successes", [0, 3, 40])
def test_of_one_player_it_is_wilsons(successes: int) -> None:
    won = np.arange(40)[None] < successes
    assert interval_over_rooms(won) == pytest.approx(wilson_interval(successes, 40))


def test_playing_twice_the_same_says_nothing_more() -> None:
    won = np.arange(50)[None] % 5 == 0
    assert interval_over_rooms(np.repeat(won, 4, axis=0)) == pytest.approx(interval_over_rooms(won))


def test_rooms_that_repeat_those_before_them_say_nothing_more() -> None:
    generator = np.random.default_rng(1)
    won = generator.random((3, 100)) < np.array([[0.9], [0.6], [0.2]])
    found = interval_over_rooms(np.repeat(won, 5, axis=1), session=5)
    assert found == pytest.approx(interval_over_rooms(won), abs=0.005)


def test_players_who_always_win_may_share_their_luck() -> None:
    low, high = interval_over_rooms(np.ones((3, 60), np.bool_))
    assert (low, high) == pytest.approx(wilson_interval(60, 60))


@pytest.mark.parametrize("shared", [0.0, 1.0], ids=["rooms of one's own", "rooms that are hard for all"])
def test_it_covers_the_rate_as_often_as_it_says(shared: float) -> None:
    generator, rates, samples, rooms = np.random.default_rng(0), np.array([0.9, 0.6, 0.2]), 400, 60
    own, together = generator.random((samples, 3, rooms)), generator.random((samples, 1, rooms))
    won = np.where(generator.random((samples, 1, rooms)) < shared, together, own) < rates[:, None]
    found = np.array([interval_over_rooms(sample) for sample in won])
    covered = ((found[:, 0] <= rates.mean()) & (rates.mean() <= found[:, 1])).mean()
    assert 0.93 < covered < 0.98


def test_it_needs_rooms() -> None:
    with pytest.raises(ValueError, match=r"got the shape \(2, 0\)"):
        interval_over_rooms(np.zeros((2, 0), np.bool_))
