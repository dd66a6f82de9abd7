"""The opened folder: nothing outside of it is read or written, and nothing typed is lost."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.studio.files import ConflictError, FileError, Folder

_NOBODY: Final = 65534


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


def test_saving_keeps_who_may_read_a_file(root: Path) -> None:
    folder, file = Folder(root), root / "one.yaml"
    file.chmod(0o600)
    folder.write("one.yaml", "scenario: mine\n", folder.read("one.yaml")[1])
    assert file.stat().st_mode & 0o777 == 0o600


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


@contextmanager
def as_another_user() -> Iterator[Path]:
    """A folder of a user who may do no more than its files' modes say, which root could ignore."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        is_root = os.geteuid() == 0
        if is_root:
            os.chown(root, _NOBODY, _NOBODY)
        for file, mode in (("secret.yaml", 0o000), ("theirs.yaml", 0o444)):
            (root / file).write_text("scenario: one\n")
            (root / file).chmod(mode)
        if is_root:
            os.setresuid(_NOBODY, _NOBODY, 0)
        try:
            yield root
        finally:
            if is_root:
                os.setresuid(0, 0, 0)
            root.chmod(0o755)


def test_files_of_another_user_are_refused_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["studio", "none", "--no-browser"]) == 2  # everything is imported before the user changes
    with as_another_user() as root:
        folder = Folder(root)
        with pytest.raises(FileError, match=r"secret.yaml: .*permission denied"):
            folder.read("secret.yaml")
        text, known = folder.read("theirs.yaml")
        with pytest.raises(FileError, match="this user may not write"):
            folder.write("theirs.yaml", text + "# mine\n", known)
        folder.keep_draft("theirs.yaml", text + "# mine\n")
        assert folder.draft("theirs.yaml") == text + "# mine\n"
        shutil.rmtree(root / ".studio")
        root.chmod(0o555)
        with pytest.raises(FileError, match="cannot be written: Permission denied"):
            folder.create("new.yaml", text)
        with pytest.raises(FileError, match="the draft cannot be kept: Permission denied"):
            folder.keep_draft("theirs.yaml", "typed")
        assert folder.scenarios() == ["secret.yaml", "theirs.yaml"]
        root.chmod(0o000)
        assert main(["studio", str(root), "--no-browser"]) == 2
    assert "Permission denied" in capsys.readouterr().err


def test_copies_take_a_free_name(root: Path) -> None:
    folder = Folder(root)
    assert folder.create("one.yaml", "scenario: one\n") == "one_2.yaml"
    with pytest.raises(FileError):
        folder.create("../x.yaml", "x")
