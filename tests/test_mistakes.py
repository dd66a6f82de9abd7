"""Whatever mistakes a file has, its author is told so: random changes of keys and values bring no internal error."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest

from socialai_dsl.frontend import check
from socialai_dsl.source import Source

ROOT = Path(__file__).parents[1]
FOLDERS = ("docs/cookbook", "scenarios/novel", "scenarios/together", "experiments/studies")
FILES = [file for folder in FOLDERS for file in sorted((ROOT / folder).glob("*.yaml"))]
KEY = re.compile(r"(?:^ *(?:- )?|[{,] *)([a-z_]{3,}):(?= |$)", re.MULTILINE)
VALUE = re.compile(r": +([^\s{\[][^,}\n]*)")
NONSENSE = ("nonesuch", "nonesuch.yaml", "", "[]", "{}", "[[]]", "3", "-1e99", '"', "null", "true")


def changed(text: str, random: Random) -> str:
    """Two letters of a key change places, or a value becomes something else."""
    keys, values = list(KEY.finditer(text)), list(VALUE.finditer(text))
    if not values or (keys and random.random() < 0.5):
        found = random.choice(keys)
        middle = len(found[1]) // 2
        new = found[1][: middle - 1] + found[1][middle] + found[1][middle - 1] + found[1][middle + 1 :]
    else:
        found, new = random.choice(values), random.choice(NONSENSE)
    return text[: found.start(1)] + new + text[found.end(1) :]


def look_at_many(seeds: range) -> int:
    """Check as many changed files; how many have a finding."""
    told = 0
    for seed in seeds:
        random = Random(seed)
        file = random.choice(FILES)
        text = file.read_text(encoding="utf-8")
        for _ in range(random.choice((1, 1, 2, 3))):
            text = changed(text, random)
        try:
            told += bool(check(str(file), {file.resolve(): Source(str(file), text)}).diagnostics)
        except Exception as error:
            pytest.fail(f"seed {seed}: {error!r}\n{text}")
    return told


def test_no_mistake_is_an_internal_error() -> None:
    assert look_at_many(range(200)) > 150


@pytest.mark.thorough("checks five thousand files")
@pytest.mark.parametrize("first", range(1_000, 6_000, 500))
def test_no_mistake_of_many_is_an_internal_error(first: int) -> None:
    assert look_at_many(range(first, first + 500)) > 375


def test_what_was_found_so() -> None:
    """A misspelt key beside a file that is missing, no name where one frame is to stand, nothing to start with."""
    study = ROOT / "experiments" / "studies" / "asking.yaml"
    errand, mood = (ROOT / "docs" / "cookbook" / f"{name}.yaml" for name in ("errand", "mood"))
    for file, changes, codes in (
        (study, {"scenario: ": "scenrio: x"}, {"S101", "S007"}),
        (errand, {"agent: {frame: solve}": "agent: {frame: []}"}, {"S104"}),
        (mood, {"start: calm": "start: []"}, {"S106"}),
    ):
        text = file.read_text(encoding="utf-8")
        for old, new in changes.items():
            assert old in text
            text = text.replace(old, new)
        result = check(str(file), {file.resolve(): Source(str(file), text)})
        assert codes <= {finding.code for finding in result.diagnostics}
