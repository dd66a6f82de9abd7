"""The opened folder: nothing outside of it is read or written, and nothing typed is lost."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from socialai_dsl.studio.files import ConflictError, FileError, Folder


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "work"
    (folder / "more").mkdir(parents=True)
    (folder / "one.yaml").write_text("scenario: one\n")
    (folder / "more" / "two.yml").write_text("scenario: two\n")
    (folder / "notes.txt").write_text("no")
    (tmp_path / "secret.yaml").write_text("secret: true\n")
    os.symlink(tmp_path / "secret.yaml", folder / "link.yaml")
    os.symlink(tmp_path, folder / "up")
    return folder


def test_scenarios_are_those_inside(root: Path) -> None:
    assert sorted(Folder(root).scenarios()) == ["more/two.yml", "one.yaml"]


@pytest.mark.parametrize(
    "name",
    "../secret.yaml|link.yaml|up/secret.yaml|/etc/passwd|/tmp/x.yaml|notes.txt|.studio/x.yaml|a\0.yaml|".split(
        "|"
    ),
)
def test_nothing_else_is_reached(root: Path, name: str) -> None:
    folder = Folder(root)
    with pytest.raises(FileError):
        folder.read(name)
    with pytest.raises(FileError):
        folder.write(name, "x", None)
    with pytest.raises(FileError):
        folder.keep_draft(name, "x")
    assert (root.parent / "secret.yaml").read_text() == "secret: true\n"


def test_two_windows_do_not_write_over_each_other(root: Path) -> None:
    folder = Folder(root)
    _, known = folder.read("one.yaml")
    first = folder.write("one.yaml", "scenario: mine\n", known)
    with pytest.raises(ConflictError, match="changed elsewhere"):
        folder.write("one.yaml", "scenario: theirs\n", known)
    with pytest.raises(ConflictError):
        folder.write("one.yaml", "scenario: new\n", None)
    assert folder.read("one.yaml") == ("scenario: mine\n", first)


def test_a_draft_is_kept_until_it_is_saved(root: Path) -> None:
    folder = Folder(root)
    folder.keep_draft("more/two.yml", "scenario: typed\n")
    assert folder.draft("more/two.yml") == "scenario: typed\n"
    assert folder.draft("one.yaml") is None
    folder.write("more/two.yml", "scenario: typed\n", folder.read("more/two.yml")[1])
    assert folder.draft("more/two.yml") is None


def test_what_is_no_text_is_told_in_words(root: Path) -> None:
    (root / "binary.yaml").write_bytes(b"\x00\x01\x02" * 50)
    (root / "large.yaml").write_bytes(b"a" * (5 << 20))
    folder = Folder(root)
    with pytest.raises(FileError, match=r"binary|UTF-16"):
        folder.read("binary.yaml")
    with pytest.raises(FileError, match="larger than"):
        folder.read("large.yaml")
    with pytest.raises(FileError, match="larger than"):
        folder.write("one.yaml", "a" * (5 << 20), folder.read("one.yaml")[1])


def test_copies_take_a_free_name(root: Path) -> None:
    folder = Folder(root)
    assert folder.create("one.yaml", "scenario: one\n") == "one_2.yaml"
    with pytest.raises(FileError):
        folder.create("../x.yaml", "x")
