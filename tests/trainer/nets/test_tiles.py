"""A tile is the product of its matrices, wherever they lie in their arrays, and nothing beside it is written."""

import numpy as np
import pytest
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from trainer.nets import tiles

pytestmark = pytest.mark.skipif(not tiles.NATIVE, reason="this processor has no dot products of bfloat16")

U16 = NDArray[np.uint16]
PAIRS, MARGIN = 5, 7


@njit
def _written(left: U16, right: U16, target: U16, margin: int, pairs: int) -> None:
    tiles.multiply(
        left, margin, 2 * pairs, 2, right, margin, 2 * tiles.PANEL, target, margin, tiles.PANEL, pairs
    )


@njit
def _added(
    left: NDArray[np.uint32], right: NDArray[np.uint32], target: NDArray[np.float32], pairs: int
) -> None:
    rows, columns = tiles.ADDED_ROWS, tiles.ADDED_COLUMNS
    tiles.multiply_add(left, 0, 1, rows, right, 0, columns, target, 0, columns, pairs)


def drawn(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed)).bfloat16()


def paired(matrix: Tensor) -> Tensor:
    """Numbers of two rows that are one above the other lie together."""
    return matrix.view(-1, 2, matrix.shape[1]).transpose(1, 2).contiguous()


def inside(numbers: Tensor) -> U16:
    """Numbers with others on both sides."""
    around = torch.full((MARGIN,), torch.nan).bfloat16()
    return torch.cat((around, numbers.flatten(), around)).view(torch.uint16).numpy()


def test_a_tile_is_written_and_nothing_beside_it() -> None:
    left, right = drawn(tiles.ROWS, 2 * PAIRS), drawn(2 * PAIRS, tiles.PANEL, seed=1)
    size = tiles.ROWS * tiles.PANEL
    target = np.full(size + 2 * MARGIN, 7, np.uint16)
    _written(inside(left), inside(paired(right)), target, MARGIN, PAIRS)
    made = torch.from_numpy(target[MARGIN:-MARGIN]).view(torch.bfloat16).view(tiles.ROWS, tiles.PANEL)
    torch.testing.assert_close(made.double(), left.double() @ right.double(), rtol=0.004, atol=0.01)
    assert (target[:MARGIN] == 7).all()
    assert (target[-MARGIN:] == 7).all()


def test_a_tile_is_added() -> None:
    left, right = drawn(2 * PAIRS, tiles.ADDED_ROWS), drawn(2 * PAIRS, tiles.ADDED_COLUMNS, seed=1)
    before = drawn(tiles.ADDED_ROWS, tiles.ADDED_COLUMNS, seed=2).float()
    target = before.clone().numpy()
    words = [paired(matrix).view(torch.uint32).squeeze(-1).flatten().numpy() for matrix in (left, right)]
    _added(words[0], words[1], target.reshape(-1), PAIRS)
    expected = before.double() + left.double().t() @ right.double()
    torch.testing.assert_close(torch.from_numpy(target).double(), expected, rtol=1e-5, atol=1e-5)
