"""Which of many like cases `make test` plays; `make test-all` plays them all."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def one_in(number: int, cases: Iterable[Any], why: str) -> list[Any]:
    """Cases for `parametrize`: the first of each `number` as it is, the others for the thorough run."""
    thorough = pytest.mark.thorough(why)
    return [
        pytest.param(case, marks=thorough) if place % number else case for place, case in enumerate(cases)
    ]
