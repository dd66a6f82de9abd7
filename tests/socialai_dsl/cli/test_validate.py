"""`socialai validate`: what is checked, and how it ends."""

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Path:
    """A folder with one sound scenario and one with a misspelt key."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "sound"]) == 0
    text = Path("sound.yaml").read_text(encoding="utf-8")
    Path("broken.yaml").write_text(text.replace("horizon: 40 ", "horizn: 40 "), encoding="utf-8")
    capsys.readouterr()
    return tmp_path


def test_a_sound_file(capsys: Capture) -> None:
    assert main(["validate", "sound.yaml"]) == 0
    assert capsys.readouterr().out == "1 file checked: 0 errors, 0 warnings\n"


def test_a_mistake_is_shown_with_its_line(capsys: Capture) -> None:
    assert main(["validate", "broken.yaml"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("broken.yaml:3:1: S101 ")
    assert "did you mean `horizon`?" in lines[0]
    assert lines[2].strip() == "^~~~~~"


def test_a_folder_is_searched_and_json_is_pure(capsys: Capture) -> None:
    assert main(["validate", ".", "--format", "json"]) == 1
    (finding,) = json.loads(capsys.readouterr().out)
    assert (finding["file"], finding["line"], finding["severity"]) == ("broken.yaml", 3, "error")


def test_files_given_twice_are_checked_once(capsys: Capture) -> None:
    assert main(["validate", "sound.yaml", "sound.yaml", "."]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "2 files checked: 1 error, 0 warnings"


@pytest.mark.parametrize("name", ["nowhere.yaml", "no_such_scenario", "sound.yaml+nothing"])
def test_what_cannot_be_found_is_wrong_usage(name: str, capsys: Capture) -> None:
    assert main(["validate", name]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err != ""


def test_an_empty_folder_is_wrong_usage(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "empty").mkdir()
    assert main(["validate", "empty"]) == 2
    assert "expected scenario files" in capsys.readouterr().err


def test_a_file_that_names_another_that_is_missing_has_a_finding(capsys: Capture) -> None:
    Path("heir.yaml").write_text("scenario: heir\nextends: nowhere.yaml\n", encoding="utf-8")
    assert main(["validate", "heir.yaml"]) == 1
    assert capsys.readouterr().out.startswith("heir.yaml:2:")
