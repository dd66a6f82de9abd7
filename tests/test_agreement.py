"""The engine and the reference interpreter of the language agree on everything an episode shows and does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.resolved import resolve, shipped_names
from tests.agreement import agree

SAMPLES = sorted(str(path) for path in (Path(__file__).parent / "data" / "agreement").glob("*.yaml"))
SCENARIOS = Path(__file__).parent.parent / "scenarios"
FOLDERS = [f"{path.parent.name}/{path.stem}" for path in sorted(SCENARIOS.glob("[ns]*/*.yaml"))]
CUES = ("+color", "+pointing", "+feedback", "+emulation", "+scaffolding")
ALONE = ("+alone", "+asocial+oracle")
VARIANTS = ("+unsocial", "+oracle", "+as_coded", "+as_coded+unsocial")


def shipped() -> Iterator[str]:
    """Every shipped scenario, alone, with its variants, and with each value of its parameters."""
    for name in (*shipped_names(), *FOLDERS):
        if not alone(name) or name.endswith(("_oracle", "_as_coded")):
            continue
        yield name
        variants = ("+oracle", *CUES, *ALONE) if name in FOLDERS else VARIANTS
        if name.endswith(("_alone", "_asocial")):  # what has been changed so is not changed so once more
            variants = ("+oracle",)
        yield from (name + variant for variant in variants if exists(name + variant))
        yield from (f"{name}?{choice}" for choice in choices(resolve(name).data.get("params", {})))  # type: ignore[union-attr]


def alone(name: str) -> bool:
    """Whether it is a scenario that can be played, not what others are built on."""
    try:
        found = resolve(name)
    except ScenarioError:
        return False
    return found.kind == "scenario" and not found.data.get("abstract")  # type: ignore[union-attr]


def exists(name: str) -> bool:
    """Whether a scenario has these variants."""
    try:
        resolve(name)
    except ScenarioError:
        return False
    return True


def choices(params: dict) -> Iterator[str]:
    """Each value of each parameter, the others as they are."""
    for name, declared in params.items():
        for value in declared.get("values", ()) if isinstance(declared, dict) else ():
            if str(value) != str(declared["default"]):
                yield f"{name}={str(value).lower() if isinstance(value, bool) else value}"


def episodes(name: str) -> int:
    """How many are played: changes of a scenario share most of what it does."""
    if name.partition("+")[0].partition("?")[0] in FOLDERS:
        return 10
    return 60 if name in shipped_names() or name in SAMPLES else 25


NAMES = [*shipped(), *SAMPLES]
OFTEN = [name for name in NAMES if "?" not in name or name.partition("?")[0] not in FOLDERS]
"""Those that are compared in every thorough run: many settings of scenarios in folders are left to the long one."""
PLAIN = [name for name in OFTEN if "?" not in name and "+" not in name]


@pytest.mark.parametrize(
    "name", [*PLAIN, *sorted(set(OFTEN) - set(PLAIN))[::5]], ids=lambda name: Path(name).stem
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
