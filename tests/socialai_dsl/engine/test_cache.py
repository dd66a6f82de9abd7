"""Compiled code on disk is private, keyed by all sources, and replaced when it is damaged."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.engine import cache

pytestmark = pytest.mark.skipif(cache.config.DISABLE_JIT, reason="nothing is compiled")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache of its own for the test."""
    monkeypatch.setenv("SOCIALAI_CACHE_DIR", str(tmp_path / "cache"))
    cache.cache_folder.cache_clear()
    found = cache.cache_folder()
    assert found is not None
    yield found
    cache.cache_folder.cache_clear()


def compiled() -> Any:
    """A new dispatcher of one and the same function, as in a new process."""

    def double(number: int) -> int:
        return 2 * number

    return cache.entry(double)


def other() -> Any:
    """A dispatcher of another function, whose entries look the same from outside."""

    def triple(number: int) -> int:
        return 3 * number

    return cache.entry(triple)


def test_the_second_process_loads_what_the_first_compiled(folder: Path) -> None:
    first, second = compiled(), compiled()
    assert first(21) == 42
    assert sum(first.stats.cache_misses.values()) == 1
    assert second(21) == 42
    assert sum(second.stats.cache_hits.values()) == 1
    assert folder.name == cache.fingerprint()


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "foreign"])
@pytest.mark.parametrize("suffix", ["nbc", "nbi"])
def test_damaged_entries_are_compiled_again(folder: Path, damage: str, suffix: str) -> None:
    compiled()(21)
    (entry,) = folder.glob(f"*double*.{suffix}")
    other()(21)
    (foreign,) = folder.glob(f"*triple*.{suffix}")
    data = bytearray(entry.read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 0xFF
    contents = {"cut": data[: len(data) // 2], "flip": data, "empty": b"", "foreign": foreign.read_bytes()}
    entry.write_bytes(contents[damage])
    again = compiled()
    assert again(21) == 42
    third = compiled()
    assert third(21) == 42
    if suffix == "nbc":
        assert not again.stats.cache_hits, "damaged code was loaded"
    assert sum(third.stats.cache_hits.values()) == 1, "the damaged entry was not replaced"


def test_the_folder_is_private(folder: Path) -> None:
    assert stat.S_IMODE(folder.stat().st_mode) & 0o077 == 0
    assert stat.S_IMODE(folder.parent.stat().st_mode) & 0o077 == 0


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
@pytest.mark.parametrize("whose", ["everybody's", "the group's", "a stranger's", "a link's"])
def test_a_folder_that_others_can_write_to_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whose: str
) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod({"everybody's": 0o777, "the group's": 0o770}.get(whose, 0o700))
    if whose == "a stranger's":
        stranger = os.getuid() + 1
        monkeypatch.setattr(cache, "_user", lambda: stranger)
    if whose == "a link's":
        shared.rename(tmp_path / "target")
        shared.symlink_to(tmp_path / "target")
    monkeypatch.setenv("SOCIALAI_CACHE_DIR", str(shared))
    cache.cache_folder.cache_clear()
    try:
        assert cache.cache_folder() is None
        assert compiled()(21) == 42, "it works without a cache"
        assert list(shared.rglob("*.nb?")) == []
    finally:
        cache.cache_folder.cache_clear()


def test_an_empty_setting_turns_it_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOCIALAI_CACHE_DIR", "")
    cache.cache_folder.cache_clear()
    try:
        assert cache.cache_folder() is None
    finally:
        cache.cache_folder.cache_clear()


def test_the_key_covers_every_source_of_the_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = Path(cache.__file__).parents[1]
    copy = tmp_path / "package"
    (copy / "engine").mkdir(parents=True)
    for source in [*(package / "engine").glob("*.py"), package / "program.py", package / "draws.py"]:
        (copy / source.relative_to(package)).write_bytes(source.read_bytes())
    monkeypatch.setattr(cache, "__file__", str(copy / "engine" / "cache.py"))
    keys = {cache.fingerprint.__wrapped__()}
    for source in copy.rglob("*.py"):
        source.write_bytes(source.read_bytes() + b"\n")
        keys.add(cache.fingerprint.__wrapped__())
    assert len(keys) == 1 + len(list(copy.rglob("*.py")))
