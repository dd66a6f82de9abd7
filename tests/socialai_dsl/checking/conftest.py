"""The folder of suites that these tests work in."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "data" / "suites"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the suites to work in."""
    shutil.copytree(FOLDER, tmp_path / "suites")
    monkeypatch.chdir(tmp_path / "suites")
    return tmp_path / "suites"
