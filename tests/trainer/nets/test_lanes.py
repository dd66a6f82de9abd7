"""Loops over lanes compute what NumPy and PyTorch do, on processors that round to bfloat16 and on those that do not."""

from typing import Any

import numpy as np
import pytest
import torch
from numba import njit
from numpy.typing import NDArray

from trainer.nets import lanes
from trainer.nets.lanes import LANES, Lanes, over_lanes

F32 = NDArray[np.float32]


def drawn(seed: int, count: int = LANES) -> F32:
    return np.random.default_rng(seed).normal(size=count).astype(np.float32)


def bits(numbers: F32) -> NDArray[np.uint16]:
    return torch.from_numpy(numbers).bfloat16().view(torch.uint16).numpy()


def as_float(numbers: NDArray[np.uint16]) -> F32:
    return torch.from_numpy(numbers).view(torch.bfloat16).float().numpy()


@pytest.mark.parametrize("by_hand", [False, True])
def test_numbers_are_rounded_to_the_nearest_and_to_even_between_two(
    by_hand: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if by_hand:
        monkeypatch.setattr(lanes, "ROUNDS", False)

    @over_lanes
    def copy(lanes: Lanes, into: Any, at: Any, source: Any, a: Any) -> None:
        lanes.put(into, at, lanes.get(source, a))

    @njit
    def run(into: NDArray[np.uint16], source: F32) -> None:
        copy(into, 0, source, 0)

    numbers = drawn(0)
    between = np.float32(1) + np.float32(2**-8) * np.array([1, 3, 0.999, 1.001], np.float32)
    numbers[:8] = [*between, np.inf, -np.inf, np.nan, 0]
    made = np.zeros(LANES, np.uint16)
    run(made, numbers)
    np.testing.assert_array_equal(as_float(made), as_float(bits(numbers)))


def test_sums_bounds_and_gates_are_those_of_numpy() -> None:
    @over_lanes
    def work(
        lanes: Lanes, into: Any, at: Any, source: Any, a: Any, u: Any, b: Any, v: Any, gates: Any, lowest: Any
    ) -> None:
        total = lanes.weighted(lanes.get(source, a), u, lanes.get(source, b), v)
        passed = lanes.where_positive(lanes.plus(total, lanes.get(source, b)), lanes.get(gates, a))
        lanes.put(into, at, lanes.at_least(passed, lowest))

    @njit
    def run(into: F32, source: F32, gates: NDArray[np.uint16]) -> None:
        work(into, 3, source, 1, np.float32(2), 5, np.float32(-0.5), gates, np.float32(-0.25))

    source, gates = drawn(1, LANES + 8), drawn(2, LANES + 8)
    gates[[4, 5]] = 0, np.nan
    made = np.zeros(LANES + 3, np.float32)
    run(made, source, bits(gates))
    here, there, open_ = source[1 : LANES + 1], source[5 : LANES + 5], gates[1 : LANES + 1]
    expected = np.maximum(np.where(~(open_ <= 0), 2 * here - 0.5 * there + there, 0), np.float32(-0.25))
    np.testing.assert_allclose(made[3:], expected, rtol=1e-5, atol=1e-6)
    assert not made[:3].any()


def test_pairs_lie_together() -> None:
    @over_lanes
    def pair(lanes: Lanes, into: Any, at: Any, even: Any, odd: Any, a: Any) -> None:
        lanes.put_pairs(into, at, lanes.get(even, a), lanes.get(odd, a))

    @njit
    def run(into: NDArray[np.uint32], even: NDArray[np.uint16], odd: NDArray[np.uint16]) -> None:
        pair(into, 0, even, odd, 0)

    even, odd, made = bits(drawn(3)), bits(drawn(4)), np.zeros(LANES, np.uint32)
    run(made, even, odd)
    np.testing.assert_array_equal(made.view(np.uint16).reshape(-1, 2), np.stack((even, odd), 1))
