"""What ships and what lies in `tests/data` is read and compiled once: a few scenarios are played over and over."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs import factory

DATA = str(Path(__file__).parents[2] / "data")
_load, _compiled = factory.load, factory.compiled
_programs: dict[int, Any] = {}
"""Programs by the identity of what was loaded, which `_loaded` keeps alive."""


@cache
def _loaded(name: str) -> Loaded:
    loaded = _load(name)
    _programs[id(loaded)] = _compiled(loaded)
    return loaded


def _is_kept(name: str) -> bool:
    return name.startswith(DATA) or ".yaml" not in name


@pytest.fixture(autouse=True)
def once(monkeypatch: pytest.MonkeyPatch) -> None:
    """`make` and `make_vec` share programs, which nothing changes."""
    monkeypatch.setattr(
        factory, "load", lambda name: _loaded(str(name)) if _is_kept(str(name)) else _load(name)
    )
    monkeypatch.setattr(factory, "compiled", lambda loaded: _programs.get(id(loaded)) or _compiled(loaded))
