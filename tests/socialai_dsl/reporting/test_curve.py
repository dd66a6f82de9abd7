"""The learning curve's picture and its smoothing."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from socialai_dsl.reporting.curve import Curve, draw_learning_curve, smooth

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
        Curve([100], [0.5], {}, WINS, test=(100, 0.5, 0.46, 0.54)),
        Curve([], [], {}, WINS),
        Curve([100, 200], [NAN, NAN], {"success@3": [NAN, NAN]}, WINS),
    ],
    ids=["usual", "one update", "nothing", "no episode ended"],
)
def test_a_picture_is_written(curve: Curve, tmp_path: Path) -> None:
    draw_learning_curve(curve, "title", tmp_path / "curve.png")
    with Image.open(tmp_path / "curve.png") as picture:
        assert min(picture.size) > 400
