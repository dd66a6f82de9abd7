"""`socialai fmt` rewrites files in one go or leaves them alone."""

import io
import os
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]

UNTIDY = b"scenario:   a   # what it is called\nroom: { size: 6 }\n"
TIDY = b"scenario: a     # what it is called\nroom: {size: 6}\n"
BROKEN = b"scenario: [a\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("untidy.yaml").write_bytes(UNTIDY)
    Path("tidy.yaml").write_bytes(TIDY)
    return tmp_path


def test_a_folder_is_rewritten(capsys: Capture) -> None:
    os.chmod("untidy.yaml", 0o640)
    assert main(["fmt", "."]) == 0
    assert Path("untidy.yaml").read_bytes() == TIDY
    assert Path("untidy.yaml").stat().st_mode & 0o777 == 0o640
    assert sorted(path.name for path in Path().iterdir()) == ["tidy.yaml", "untidy.yaml"]
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == "1 changed, 1 left as they are\n"
    assert main(["fmt", "--check", "."]) == 0


def test_check_names_the_files_and_writes_nothing(capsys: Capture) -> None:
    assert main(["fmt", "--check", "."]) == 1
    assert capsys.readouterr().out == "untidy.yaml\n"
    assert Path("untidy.yaml").read_bytes() == UNTIDY


def test_diff(capsys: Capture) -> None:
    assert main(["fmt", "--diff", "."]) == 0
    assert "\n+scenario: a     # what it is called\n+room: {size: 6}\n" in capsys.readouterr().out
    assert Path("untidy.yaml").read_bytes() == UNTIDY
    assert main(["fmt", "--diff", "--check", "untidy.yaml"]) == 1


def test_what_cannot_be_read_stays_and_the_others_are_formatted(capsys: Capture) -> None:
    Path("broken.yaml").write_bytes(BROKEN)
    assert main(["fmt", "."]) == 1
    assert Path("broken.yaml").read_bytes() == BROKEN
    assert Path("untidy.yaml").read_bytes() == TIDY
    captured = capsys.readouterr()
    assert "broken.yaml:" in captured.err
    assert "S001" in captured.err


@pytest.mark.parametrize("name", ["nowhere.yaml", "no\x00where"])
def test_what_is_not_there(name: str, capsys: Capture) -> None:
    assert main(["fmt", name, "untidy.yaml"]) == 2, "as `validate` ends"
    assert "S007" in capsys.readouterr().err
    assert Path("untidy.yaml").read_bytes() == TIDY


def test_line_breaks_and_marks_of_other_systems() -> None:
    Path("untidy.yaml").write_bytes(b"\xef\xbb\xbf" + TIDY.replace(b"\n", b"\r\n"))
    assert main(["fmt", "--check", "untidy.yaml"]) == 1
    assert main(["fmt", "untidy.yaml"]) == 0
    assert Path("untidy.yaml").read_bytes() == TIDY


def test_standard_input(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(UNTIDY)))
    assert main(["fmt", "-"]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == (TIDY.decode(), "")


def test_a_link_stays_a_link(folder: Path) -> None:
    (folder / "link.yaml").symlink_to("untidy.yaml")
    assert main(["fmt", "link.yaml"]) == 0
    assert (folder / "link.yaml").is_symlink()
    assert (folder / "untidy.yaml").read_bytes() == TIDY


def test_a_write_that_breaks_off_leaves_the_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert main(["fmt", "untidy.yaml"]) == 2
    assert (folder / "untidy.yaml").read_bytes() == UNTIDY
    assert sorted(path.name for path in folder.iterdir()) == ["tidy.yaml", "untidy.yaml"]
