"""The folder of compiled code is private, and keyed by all sources."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from socialai_dsl.engine import cache


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache of its own for the test."""
    monkeypatch.setenv("SOCIALAI_CACHE_DIR", str(tmp_path / "cache"))
    cache.cache_folder.cache_clear()
    found = cache.cache_folder()
    assert found is not None
    yield found
    cache.cache_folder.cache_clear()


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
        assert list(shared.iterdir()) == []
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
    (copy / "program").mkdir()
    for source in [
        *(package / "engine").glob("*.py"),
        *(package / "program").glob("*.py"),
        package / "draws.py",
        package / "vocabulary.py",
        package / "widths.py",
    ]:
        (copy / source.relative_to(package)).write_bytes(source.read_bytes())
    monkeypatch.setattr(cache, "__file__", str(copy / "engine" / "cache.py"))
    keys = {cache.fingerprint.__wrapped__()}
    for source in copy.rglob("*.py"):
        source.write_bytes(source.read_bytes() + b"\n")
        keys.add(cache.fingerprint.__wrapped__())
    assert len(keys) == 1 + len(list(copy.rglob("*.py")))
