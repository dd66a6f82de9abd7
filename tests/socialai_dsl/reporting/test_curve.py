"""The learning curve's picture and its smoothing."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from socialai_dsl.reporting.curve import Curve, draw_learning_curve, draw_outcomes, member_success, smooth

NAN = float("nan")
WINS = frozenset({"success@3"})


def test_smoothing_is_the_mean_of_the_last_known_values() -> None:
    np.testing.assert_allclose(smooth([1, 3, NAN, 5], 2), [1, 2, 3, 5])


def test_smoothing_knows_nothing_before_the_first_value() -> None:
    assert np.isnan(smooth([NAN, NAN, 4], 2)).tolist() == [True, True, False]


@pytest.mark.parametrize(
    "curve",
    [
        Curve(
            [100, 200, 300], [NAN, 0.2, 0.4], {"success@3": [NAN, 0.2, 0.4], "timeout": [NAN, 0.8, 0.6]}, WINS
        ),
        Curve([100], [0.5], {}, WINS, {}, (100, 0.5, 0.46, 0.54)),
        Curve([], [], {}, WINS),
        Curve([100, 200], [NAN, NAN], {"success@3": [NAN, NAN]}, WINS),
        Curve([100, 200], [0.5, 0.5], {"easy: success@3": [NAN, 0.5], "hard: timeout": [1, 0.5]}, WINS),
    ],
    ids=["usual", "one update", "nothing", "no episode ended", "a suite"],
)
def test_a_picture_is_written(curve: Curve, tmp_path: Path) -> None:
    draw_learning_curve(curve, "title", tmp_path / "curve.png")
    with Image.open(tmp_path / "curve.png") as picture:
        assert min(picture.size) > 400


def test_the_success_of_a_member_is_among_its_own_episodes() -> None:
    outcomes = {
        "easy: success@3": [0.5, 0.25],
        "easy: timeout": [0.5, 0],
        "hard: success@3": [0, 0.25],
        "hard: failure@4": [0, 0.5],
    }
    rates = member_success(
        Curve([1, 2], [0.5, 0.5], outcomes, frozenset({"easy: success@3", "hard: success@3"}))
    )
    np.testing.assert_allclose(rates["easy"], [0.5, 1])
    np.testing.assert_allclose(rates["hard"], [NAN, 1 / 3])
    assert member_success(Curve([1], [1], {"success@3": [1]}, WINS)) == {}


def test_of_many_outcomes_the_most_frequent_are_drawn_and_the_rest_is_one() -> None:
    axes = Figure().subplots()
    shares = {f"failure@{k}": np.full(3, (k + 1) / 45.0) for k in range(9)}
    words = {"failure@7": "failure: agent.at(wrong)", "failure@0": "never drawn alone"}
    draw_outcomes(axes, [0, 1, 2], shares, frozenset(), words, {})
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        *("failure, line 8", "failure: agent.at(wrong)", "failure, line 6", "6 more failures"),
    ]
    top = max(path.vertices[:, 1].max() for area in axes.collections for path in area.get_paths())  # type: ignore[index]
    assert top == pytest.approx(1.0)


def test_an_outcome_has_the_same_colour_however_often_it_happened() -> None:
    def colours(first: float, second: float) -> dict[str, object]:
        axes = Figure().subplots()
        shares = {"failure@1": np.full(3, first), "failure@2": np.full(3, second)}
        draw_outcomes(axes, [0, 1, 2], shares, frozenset(), {}, {})
        return {str(area.get_label()): tuple(area.get_facecolor()[0]) for area in axes.collections}  # type: ignore[index]

    often, seldom = colours(0.9, 0.1), colours(0.1, 0.9)
    assert often == seldom
    assert len(set(often.values())) == 2
    never = colours(0.0, 1.0)
    assert never == {"failure, line 2": often["failure, line 2"]}, "what never happened is not drawn"
