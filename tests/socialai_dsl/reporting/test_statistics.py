"""The statistics of a report against figures computed by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from socialai_dsl.baselines import _quantile_of_t
from socialai_dsl.episodes.results import wilson_interval
from socialai_dsl.reporting.statistics import (
    area_under,
    bonferroni,
    bootstrapped_iqm,
    clustered_rate,
    compare,
    frames_to,
    interquartile_mean,
    mean_interval,
    paired_difference,
)


def test_welch_with_unequal_variances() -> None:
    # Means 0.2 and 0.6, variances 0.01 and 0.04: t = -0.4 / sqrt(0.01/3 + 0.04/3) = -0.4 / sqrt(1/60).
    # df = (0.01/3 + 0.04/3)^2 / ((0.01/3)^2/2 + (0.04/3)^2/2) = 25 / ((1 + 16)/2) = 50/17.
    test = compare([0.1, 0.2, 0.3], [0.4, 0.6, 0.8])
    assert test.difference == pytest.approx(-0.4)
    assert test.t == pytest.approx(-0.4 * math.sqrt(60))
    assert test.degrees == pytest.approx(50 / 17)


def test_p_and_effect_size() -> None:
    # Means 2 and 4, variances 1: t^2 = 4 / (2/3) = 6, df = 4. Student's distribution with four degrees of freedom is
    # F(t) = 1/2 + 3/8 u (1 - u^2/12) with u = t / sqrt(1 + t^2/4); here u = sqrt(6/2.5) = sqrt(2.4).
    test = compare([1, 2, 3], [3, 4, 5])
    upper = 0.5 - 3 / 8 * math.sqrt(2.4) * (1 - 2.4 / 12)
    assert test.p == pytest.approx(2 * upper)
    assert test.p == pytest.approx(0.0705, abs=5e-5)
    # The pooled standard deviation is 1; J(4) = gamma(2) / (sqrt(2) gamma(3/2)) = 1 / (sqrt(2) sqrt(pi)/2).
    assert test.g == pytest.approx(-2 * math.sqrt(2 / math.pi))


@pytest.mark.parametrize(("first", "second"), [([0.5], [0.1, 0.2]), ([1.0, 1.0], [0.0, 0.0])])
def test_a_test_that_says_nothing_says_so(first: list[float], second: list[float]) -> None:
    test = compare(first, second)
    assert (test.t, test.degrees, test.p, test.g) == (None, None, None, None)
    assert test.difference == pytest.approx(np.mean(first) - np.mean(second))


def test_spread_in_one_group_is_enough_for_a_test() -> None:
    # Variances 0 and 0.02: t = 0.5 / sqrt(0.02/2) = 5, df = 1, for which F(t) = 1/2 + atan(t)/pi.
    test = compare([1.0, 1.0], [0.4, 0.6])
    assert test.t == pytest.approx(5)
    assert test.p == pytest.approx(1 - 2 * math.atan(5) / math.pi)


def test_comparing_nothing_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="groups of 0 and 1"):
        compare([], [1.0])


def test_bonferroni_counts_the_tests_that_were_made() -> None:
    assert bonferroni([0.01, None, 0.7]) == [0.02, None, 1.0]


def test_the_interquartile_mean_leaves_out_a_quarter_at_either_end() -> None:
    # Together 0, .2, .4, .5, .5, .6, .8, 1: two go at either end, (.4 + .5 + .5 + .6) / 4.
    assert interquartile_mean([[0.0, 0.2], [0.4, 0.6], [0.8, 1.0], [0.5, 0.5]]) == pytest.approx(0.5)
    with pytest.raises(ValueError, match="got none"):
        interquartile_mean([])


def test_the_bootstrap_draws_within_tasks_only() -> None:
    # Drawn from all together, 0.2 and 0.8 would come in other numbers; within each task nothing can change.
    estimate = bootstrapped_iqm([[0.2, 0.2], [0.8, 0.8]])
    assert (estimate.value, estimate.low, estimate.high) == pytest.approx((0.5, 0.5, 0.5))
    # Two seeds 0 and 1 give 0, 1/2, 1 with probabilities 1/4, 1/2, 1/4: both tails are longer than 2.5 %.
    estimate = bootstrapped_iqm([[0.0, 1.0]])
    assert (estimate.value, estimate.low, estimate.high) == pytest.approx((0.5, 0.0, 1.0))


def test_the_bootstrap_can_be_repeated() -> None:
    scores = np.random.default_rng(0).random((3, 16)).tolist()
    assert bootstrapped_iqm(scores) == bootstrapped_iqm(scores)
    assert bootstrapped_iqm(scores, seed=1) != bootstrapped_iqm(scores, seed=2)


def test_the_interval_of_a_mean() -> None:
    # Mean 0.5, standard error 0.1; with one degree of freedom the quantile is tan(0.475 pi) = 12.706.
    interval = mean_interval([0.4, 0.6])
    assert interval == pytest.approx(
        (0.5 - 0.1 * math.tan(0.475 * math.pi), 0.5 + 0.1 * math.tan(0.475 * math.pi))
    )
    assert mean_interval([0.4]) is None


def test_a_paired_difference_has_the_interval_of_bonett_and_price() -> None:
    """With 12 rooms that the first alone solves and 3 that the second alone solves, of 50."""
    first = [1.0] * 12 + [0.0] * 3 + [1.0] * 20 + [0.0] * 15
    second = [0.0] * 12 + [1.0] * 3 + [1.0] * 20 + [0.0] * 15
    found = paired_difference(first, second)
    ahead, behind = 13 / 52, 4 / 52
    half = 1.959964 * math.sqrt((ahead + behind - (ahead - behind) ** 2) / 52)
    assert found.value == pytest.approx(9 / 50)
    assert (found.low, found.high) == pytest.approx((ahead - behind - half, ahead - behind + half), abs=1e-6)


def test_rooms_that_all_agree_leave_an_interval() -> None:
    found = paired_difference([1.0] * 10, [0.0] * 10)
    assert (found.value, found.high) == (1.0, 1.0)
    assert 0.4 < found.low < 0.7
    alike = paired_difference([1.0] * 10, [1.0] * 10)
    assert alike.value == 0.0
    assert alike.low == -alike.high < -0.1
    with pytest.raises(ValueError, match="got 1 and 2 rooms, expected as many, at least one"):
        paired_difference([1.0], [1.0, 0.0])


def test_sample_efficiency_passes_over_unknown_bins() -> None:
    frames, success = np.array([100.0, 200.0, 300.0]), np.array([np.nan, 0.4, 0.8])
    assert frames_to(frames, success, 0.4) == 200
    assert frames_to(frames, success, 0.0) == 200
    assert frames_to(frames, success, 0.81) is None
    assert area_under(success) == pytest.approx(0.6)
    assert area_under(np.array([np.nan])) is None


@given(st.lists(st.booleans(), min_size=2, max_size=60))
def test_the_interval_of_single_episodes_is_wilsons(won: list[bool]) -> None:
    found = clustered_rate([int(one) for one in won], [1] * len(won))
    assert found is not None
    assert found[1:] == pytest.approx(wilson_interval(sum(won), len(won)))


CLUSTERS = st.lists(
    st.integers(1, 12).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))), min_size=2, max_size=20
)


@given(CLUSTERS)
def test_an_interval_over_people_holds_their_rate_and_is_one_of_rates(people: list[tuple[int, int]]) -> None:
    won, played = zip(*people, strict=True)
    found = clustered_rate(won, played)
    assert found is not None
    assert found.value == pytest.approx(sum(won) / sum(played))
    assert 0 <= found.low <= found.value <= found.high <= 1
    assert found.low < found.high
    low, high = wilson_interval(sum(won), sum(played))
    assert found.low <= low + 1e-9, "never narrower than if all episodes were of different people"
    assert found.high >= high - 1e-9


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 7, 30, 99, 499, 4999])
def test_students_quantile_is_that_of_scipy(freedom: int) -> None:
    assert _quantile_of_t(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), rel=1e-9)


def test_people_who_are_always_alike_count_as_people_and_not_as_episodes() -> None:
    """Six of eight people succeed in all of their ten episodes: by hand.

    p = 0.75, the residuals are 2.5 and -7.5, their variance 8/7 * (6 * 6.25 + 2 * 56.25) / 80^2 = 0.0267857, so that
    p (1 - p) over it is 7 episodes; Student's quantiles with 79 and 7 degrees of freedom are 1.9905 and 2.3646.
    """
    found = clustered_rate([10] * 6 + [0] * 2, [10] * 8)
    assert found is not None
    trials = 7 * (1.9905 / 2.3646) ** 2
    z = 1.959964
    centre = (0.75 + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z * math.sqrt(0.75 * 0.25 / trials + z * z / (4 * trials**2)) / (1 + z * z / trials)
    assert found == pytest.approx((0.75, centre - half, centre + half), abs=1e-4)


def test_of_one_cluster_no_interval_is_known() -> None:
    assert clustered_rate([3], [5]) is None
    with pytest.raises(ValueError, match="got 0 and 0 clusters"):
        clustered_rate([], [])


def test_intervals_over_people_hold_the_rate_about_as_often_as_they_say() -> None:
    """1,000 studies of 15 people with 6 episodes each, whose rates are drawn from a beta distribution of mean 0.7."""
    rng = np.random.default_rng(7)
    holds = 0
    for _ in range(1000):
        won = rng.binomial(6, rng.beta(1.4, 0.6, 15))
        found = clustered_rate(won.tolist(), [6] * 15)
        assert found is not None
        holds += found.low <= 0.7 <= found.high
    assert 0.93 <= holds / 1000 <= 0.98
