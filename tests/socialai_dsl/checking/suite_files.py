"""Suites of the folder that a test works in, and what is found in one that is written there."""

from __future__ import annotations

from pathlib import Path

from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.frontend import check, load


def suite(name: str) -> LoadedSuite:
    """A suite by its name."""
    loaded = load(name)
    assert isinstance(loaded, LoadedSuite)
    return loaded


def written(text: str) -> list[str]:
    """What is found in a suite with these keys, without the file's name."""
    Path("mine.yaml").write_text(f"suite: mine\n{text}\n")
    result = check("mine.yaml")
    assert result.suite is None
    return [str(finding).removeprefix("mine.yaml:") for finding in result.diagnostics]
