"""The engine and the reference interpreter of the language agree on everything an episode shows and does."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.agreement import agree
from tests.quick import one_in
from tests.shipped import everything

SAMPLES = sorted(str(path) for path in (Path(__file__).parent / "data" / "agreement").glob("*.yaml"))
"""Scenarios that together have every word of the language."""

SHIPPED = [*everything()]
PLAIN = [name for name in SHIPPED if "+" not in name and "?" not in name]
CHANGED = [name for name in SHIPPED if name not in PLAIN]
"""Variants, and other values of parameters."""


def in_folder(name: str) -> bool:
    """Whether it is one of the School's scenarios or of the new ones, which are many and alike."""
    return "/" in name.partition("?")[0]


def episodes(name: str) -> int:
    """How many are played: changes of a scenario share most of what it does."""
    if in_folder(name) and name not in SAMPLES:
        return 10
    return 25 if "+" in name or "?" in name else 60


NAMES = [*SHIPPED, *SAMPLES]
OFTEN = [name for name in NAMES if "?" not in name or not in_folder(name)]
"""Those that are compared in every thorough run: many settings of scenarios in folders are left to the long one."""


@pytest.mark.parametrize(
    "name",
    [*SAMPLES, *PLAIN, *one_in(5, CHANGED, "plays every scenario on the slow interpreter")],
    ids=lambda name: Path(name).stem,
)
def test_agreement_over_some_episodes(name: str) -> None:
    steps = agree(name, 2, seed=10)
    assert steps > 2


@pytest.mark.thorough("plays up to 60 episodes of each scenario on the slow interpreter")
@pytest.mark.parametrize("name", OFTEN, ids=lambda name: Path(name).stem)
def test_agreement(name: str) -> None:
    steps = agree(name, episodes(name), seed=11)
    assert steps > episodes(name), "the episodes were too short to mean anything"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_agreement_over_a_hundred_episodes(name: str) -> None:
    agree(name, 100, seed=12)
