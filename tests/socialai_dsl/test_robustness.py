"""Whatever an author writes, there is a finding or a scenario, never an exception."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from socialai_dsl.frontend import check

SMALL = (Path(__file__).parent.parent / "diagnostics" / "small.yaml").read_text()
PIECES = [
    "(",
    ")",
    "|",
    "..",
    "<",
    ">",
    "pick(",
    "doors",
    "exit",
    "0",
    '"',
    "where",
    "not",
    "here",
    "left",
    ":",
    "$x",
    "t",
    "W",
    "null",
]


def mutated(text, rng):
    """The text with a word replaced by another, a line doubled or taken out, or a piece put in."""
    kind = rng.random()
    if kind < 0.6:
        words = list(re.finditer(r"\w+\([^()]*\)|\w+|[=<>|+-]+", text))
        old, new = rng.choice(words), rng.choice(words)
        return text[: old.start()] + new.group() + text[old.end() :]
    if kind < 0.8:
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        lines[at : at + 1] = rng.choice([[], [lines[at]] * 2])
        return "\n".join(lines)
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(PIECES) + text[at:]


@pytest.mark.parametrize("seed", range(8))
def test_a_mutilated_file_is_a_finding_or_a_scenario(seed, tmp_path):
    rng = random.Random(seed)
    file = tmp_path / "mutant.yaml"
    for _ in range(25):
        text = SMALL
        for _ in range(rng.choice((1, 1, 2, 3))):
            text = mutated(text, rng)
        file.write_text(text)
        result = check(file)
        assert result.diagnostics or result.checked, text
