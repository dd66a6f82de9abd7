"""Compiled code on disk is private, keyed by all sources, and not read when it is damaged."""

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


def test_what_one_process_keeps_another_reads(folder: Path) -> None:
    assert cache.read("serve") is None
    cache.keep("serve", b"code")
    cache.keep("script", b"other code")
    assert cache.read("serve") == b"code"
    assert cache.read("script") == b"other code"
    assert folder.name == cache.fingerprint()
    assert {path.name for path in folder.iterdir()} == {"serve", "script"}, "nothing is left over"


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "foreign"])
def test_what_is_damaged_is_not_read_and_can_be_replaced(folder: Path, damage: str) -> None:
    cache.keep("serve", bytes(range(100)))
    cache.keep("script", bytes(100))
    data = bytearray((folder / "serve").read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 0xFF
    foreign = (folder / "script").read_bytes()
    contents = {"cut": data[: len(data) // 2], "flip": data, "empty": b"", "foreign": foreign}
    (folder / "serve").write_bytes(contents[damage])
    assert cache.read("serve") is None
    cache.keep("serve", bytes(range(100)))
    assert cache.read("serve") == bytes(range(100))


def test_a_vanished_folder_stops_nothing(folder: Path) -> None:
    folder.rmdir()
    cache.keep("serve", b"code")
    assert cache.read("serve") is None


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
        cache.keep("serve", b"code")
        assert cache.read("serve") is None
        assert list(shared.rglob("serve")) == []
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
    ]:
        (copy / source.relative_to(package)).write_bytes(source.read_bytes())
    monkeypatch.setattr(cache, "__file__", str(copy / "engine" / "cache.py"))
    keys = {cache.fingerprint.__wrapped__()}
    for source in copy.rglob("*.py"):
        source.write_bytes(source.read_bytes() + b"\n")
        keys.add(cache.fingerprint.__wrapped__())
    assert len(keys) == 1 + len(list(copy.rglob("*.py")))
