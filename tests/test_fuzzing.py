"""Made-up files: findings or a document, nothing read outside the folder, nothing executed; and the fuzzing has teeth.

Short versions run with the suite; `make fuzz` drives the same targets with atheris, `make nightly` for long.
"""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from socialai_dsl.frontend import check
from tests.fuzzing.inputs import WORDS, mutated, seeds
from tests.fuzzing.planted import PLANTED
from tests.fuzzing.playground import Playground
from tests.fuzzing.targets import TARGETS, Violation, in_time

SHORT = {"document": 200, "whole": 120, "expression": 600}
LONG = {"document": 40_000, "whole": 40_000, "expression": 100_000}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Playground:
    place = Playground(tmp_path_factory.mktemp("fuzzing"))
    # What is imported late would look like code that a file brought.
    for name in ("small.yaml", "rich.yaml", "town.yaml"):
        assert check(place.folder / name).diagnostics == ()
    check("social_env")
    for data in seeds("expression"):
        TARGETS["expression"](data, place)
    return place


def attempt(target: str, data: bytes, place: Playground) -> None:
    with in_time():
        TARGETS[target](data, place)


def made_up(target: str, count: int, seed: int) -> list[bytes]:
    texts, rng = seeds(target), random.Random(seed)
    return [mutated(rng.choice(texts), rng.choice(texts), rng) for _ in range(count)]


@pytest.mark.parametrize("target", TARGETS)
def test_made_up_inputs(target: str, place: Playground) -> None:
    for data in made_up(target, SHORT[target], 1):
        attempt(target, data, place)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("target", TARGETS)
def test_many_made_up_inputs(target: str, place: Playground) -> None:
    for data in [*seeds(target), *made_up(target, LONG[target], 2)]:
        attempt(target, data, place)


def executions_until_found(name: str, most: int, place: Playground) -> int | None:
    """After how many inputs a planted mistake shows; None if it does not."""
    target, plant = PLANTED[name]
    texts, rng = seeds(target), random.Random(3)
    with pytest.MonkeyPatch.context() as patch:
        plant(patch)
        for number in range(1, most + 1):
            try:
                attempt(target, mutated(rng.choice(texts), rng.choice(texts), rng), place)
            except Exception:
                return number
    return None


def test_a_planted_mistake_is_found(place: Playground) -> None:
    assert executions_until_found("keys given twice in braces", 500, place) is not None


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", PLANTED)
def test_planted_mistakes_are_found(name: str, place: Playground) -> None:
    found = executions_until_found(name, 20_000, place)
    print(f"{name}: found after {found} inputs")
    assert found is not None


def test_the_judge_sees_what_it_is_to_see(place: Playground, tmp_path: Path) -> None:
    """Reading a file outside the folder, and text that no terminal should get, do not pass."""
    with pytest.MonkeyPatch.context() as patch:
        PLANTED["`..` not followed"][1](patch)
        with pytest.raises(Violation, match="opened"):
            attempt("whole", b"scenario: f\nextends: guides/../../outside/secret.yaml\n", place)
    with pytest.MonkeyPatch.context() as patch:
        PLANTED["control characters as escapes"][1](patch)
        with pytest.raises(Violation, match="the text"):
            attempt("document", b'a: "\\e[31m"', place)


def test_words_are_spelt_once() -> None:
    assert len(set(WORDS)) == len(WORDS)
