"""Pointers read and write the row they are given, and the guarded ones of plain Python find what lies outside."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.engine.jit import compiled, inline
from socialai_dsl.engine.pointers import (
    GuardedArray,
    bare,
    float64_of,
    int16_of,
    int64_of,
    make_book,
    uint32_of,
)
from socialai_dsl.program import Field

ROOT = Path(__file__).parents[3]


def mix_up(book: np.ndarray, row: int) -> int:
    small = int16_of(book, 0, row)
    large = uint32_of(book, 1, row)
    flat = int64_of(book, 2, row)
    fraction = float64_of(book, 3, 0)
    small[1] = large[0] + 70000
    large[Field.Y] = -1
    flat[1] = small[0] * 10
    fraction[row] = 0.5
    return small[Field.X] + large[1]


_mix_up = inline(mix_up)


def mix_up_bare(book: np.ndarray, row: int) -> int:
    return _mix_up(bare(book), row)


@pytest.mark.parametrize("function", [mix_up, mix_up_bare])
def test_rows_of_arrays_of_all_kinds(function: Callable[[np.ndarray, int], int]) -> None:
    small = np.arange(12, dtype=np.int16).reshape(3, 4)
    large = np.full((3, 2), 5, np.uint32)
    flat = np.zeros(6, np.int64)
    fraction = np.zeros(3)
    book = make_book([small, large, flat, fraction])
    assert compiled(function)(book, 2) == 8 + 0xFFFFFFFF, "an unsigned number is read as one"
    assert small[2].tolist() == [8, np.int64(70005).astype(np.int16), 10, 11]
    assert small[:2].ravel().tolist() == list(range(8))
    assert large.tolist() == [[5, 5], [5, 5], [5, 0xFFFFFFFF]]
    assert flat.tolist() == [0, 0, 0, 80, 0, 0]
    assert fraction.tolist() == [0, 0, 0.5]


@pytest.mark.parametrize("index", [-1, 4])
def test_guards(index: int) -> None:
    row = GuardedArray(np.zeros(4, np.int16))
    with pytest.raises(IndexError, match=f"index {index} is outside a row of 4"):
        row[index]
    with pytest.raises(IndexError, match="outside"):
        row[index] = 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "tests",
    [
        ["tests/socialai_dsl/engine", "tests/test_one_step.py", "tests/test_odd_moments.py"],
        ["tests/test_agreement.py", "-k", "talkitout or walkers"],
    ],
    ids=["engine", "agreement"],
)
def test_plain_python_does_the_same_within_bounds(tests: list[str]) -> None:
    """The same functions without the compiler: every access is checked, and everything passes."""
    large = "not batch_size"
    selection = tests if "-k" in tests else [*tests, "-k", large]
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-W", "error::RuntimeWarning", "--timeout=1800", *selection],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        timeout=3000,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-3000:]
