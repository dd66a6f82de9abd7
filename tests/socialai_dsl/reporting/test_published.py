"""Published figures beside ours: the test, its words, and the paper's own comparisons."""

import math
from pathlib import Path

import pytest

from socialai_dsl.experiments.record import Reference
from socialai_dsl.frontend import load_experiment
from socialai_dsl.reporting.published import Figure, against_published, sample_of
from socialai_dsl.reporting.statistics import Sample, compare, welch

EXPERIMENTS = Path(__file__).parents[3] / "experiments"


def verdict(ours: list[float], **published: float) -> str:
    figure = Figure(None, "one", "", ours, Reference.model_validate(published))
    (row,) = against_published([figure])
    return str(row["verdict"])


def test_welch_from_mean_deviation_and_number() -> None:
    # As of [0.1, 0.2, 0.3] and [0.4, 0.6, 0.8]: variances 0.01 and 0.04, standard error sqrt(1/60), 50/17 degrees.
    test = welch(Sample(0.2, 0.1, 3), Sample(0.6, 0.2, 3))
    assert test == pytest.approx(compare([0.1, 0.2, 0.3], [0.4, 0.6, 0.8]))
    assert test.low is not None
    assert test.high is not None
    assert (test.low + test.high) / 2 == pytest.approx(-0.4)
    # With two seeds each, alike in spread, the quantile of two degrees of freedom is 4.303.
    pair = welch(Sample(0.5, 0.1, 2), Sample(0.5, 0.1, 2))
    assert pair.high == pytest.approx(4.30265 * 0.1, rel=1e-5)


@pytest.mark.parametrize("std", [0.0, 1e-200])
def test_without_spread_there_is_no_test(std: float) -> None:
    assert welch(Sample(0.5, std, 3), Sample(0.4, 0.0, 16)).p is None


def test_a_deviation_of_the_population_becomes_one_of_the_sample() -> None:
    published = Reference(mean=0.12, std=0.03, n=16, deviation="population")
    assert sample_of(published).std == pytest.approx(0.03 * math.sqrt(16 / 15))
    assert sample_of(published.model_copy(update={"deviation": "sample"})).std == 0.03


@pytest.mark.parametrize(
    ("ours", "published", "said"),
    [
        ([0.44, 0.45, 0.46], {"mean": 0.45, "std": 0.01, "n": 16}, "matches within 0.10"),
        ([0.2, 0.5, 0.8], {"mean": 0.45, "std": 0.01, "n": 16}, "not shown to differ"),
        ([0.44, 0.45, 0.46], {"mean": 0.50, "std": 0.01, "n": 16}, "differs, by less than 0.10"),
        ([0.44, 0.45, 0.46], {"mean": 0.80, "std": 0.01, "n": 16}, "differs"),
        ([0.45], {"mean": 0.45, "std": 0.01, "n": 16}, "not testable: one seed of ours"),
        ([0.4, 0.5], {"mean": 0.45, "n": 16}, "not testable: no standard deviation published"),
        ([0.4, 0.5], {"mean": 0.45, "std": 0.01}, "not testable: number of seeds not published"),
        ([0.0, 0.0], {"mean": 0.0, "std": 0.0, "n": 16}, "not testable: no spread in either"),
        ([], {"mean": 0.45, "std": 0.01, "n": 16}, "no result"),
    ],
)
def test_a_match_and_a_difference_are_called_so(
    ours: list[float], published: dict[str, float], said: str
) -> None:
    assert verdict(ours, **published) == said


def test_p_is_corrected_for_the_figures_that_can_be_tested() -> None:
    told = Reference(mean=0.5, std=0.1, n=16)
    seeds: list[list[float]] = [[0.3, 0.4, 0.5], [0.4], [0.5, 0.6, 0.8], []]
    first, single, third, none = against_published([Figure("t", "c", "", ours, told) for ours in seeds])
    for row in (first, third):
        assert row["p_bonferroni"] == pytest.approx(min(1.0, 2 * row["p"]))
    assert (single["p"], none["p"], none["success_mean"]) == (None, None, None)
    assert single["difference"] == pytest.approx(-0.1)


@pytest.fixture(scope="module")
def paper() -> dict[str, Reference]:
    """The paper's figures, of a condition's test where it has none of its own scenario."""
    cells = load_experiment(EXPERIMENTS / "paper.yaml").cells["full"]
    return {
        cell.name: Reference.model_validate(told.model_dump())
        for cell in cells
        for told in (*cell.tests.values(), cell.reference)
        if told is not None
    }


@pytest.mark.parametrize(
    ("row", "column", "printed", "as_population"),
    [
        ("DiverseExit", "PPO+Explo", 0.0083, 0.0103),
        ("Help", "PPO+Explo", 0.035, 0.041),
        ("DiverseExit", "PPO", 0.086, 0.097),
        ("Help", "PPO", 0.135, 0.148),
        ("Dance", "PPO", 8.6e-7, 1.28e-6),
    ],
)
def test_the_papers_own_comparisons_with_unsocial(
    paper: dict[str, Reference], row: str, column: str, printed: float, as_population: float
) -> None:
    """Its text has p > .5 for the first four. Printed: its deviations taken as those of samples."""
    pair = paper[f"{row} / {column}"], paper[f"{row} / Unsocial"]
    assert welch(*(sample_of(one) for one in pair)).p == pytest.approx(as_population, rel=0.02)
    as_printed = (sample_of(one.model_copy(update={"deviation": "sample"})) for one in pair)
    assert welch(*as_printed).p == pytest.approx(printed, rel=0.02)


def test_the_whole_table_of_the_paper_is_there(paper: dict[str, Reference]) -> None:
    names = {cell.name for cell in load_experiment(EXPERIMENTS / "paper.yaml").cells["full"]}
    assert names - paper.keys() == {"SocialEnv / Unsocial"}, "which the paper did not run"
    assert {(one.n, one.std is None) for one in paper.values()} == {(16, False)}


def test_both_files_say_the_same_of_the_conditions_that_they_share() -> None:
    first, second = (
        {
            cell.name: (cell.reference, cell.tests)
            for cell in load_experiment(EXPERIMENTS / f"{name}.yaml").cells["full"]
        }
        for name in ("paper", "case_studies")
    )
    shared = first.keys() & second.keys()
    assert len(shared) == 11
    assert {name: first[name] for name in shared} == {name: second[name] for name in shared}
