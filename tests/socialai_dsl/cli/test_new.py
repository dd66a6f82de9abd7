"""`socialai new` writes a file that is sound as it stands."""

from pathlib import Path

import pytest

from socialai_dsl.cli.main import main


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["corridor", "corridor.yaml"])
def test_the_file_has_no_findings(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", name]) == 0
    assert Path("corridor.yaml").read_text().startswith("scenario: corridor\n")
    capsys.readouterr()
    assert main(["validate", "--strict", "corridor.yaml"]) == 0
    assert capsys.readouterr().out == "1 file checked: 0 errors, 0 warnings\n"


def test_an_existing_file_stays(capsys: pytest.CaptureFixture[str]) -> None:
    Path("corridor.yaml").write_text("mine")
    assert main(["new", "corridor"]) == 2
    assert Path("corridor.yaml").read_text() == "mine"
    assert capsys.readouterr().err == "socialai: corridor.yaml exists already\n"


@pytest.mark.parametrize("name", ["", "a b", "../x", "1a", "x" * 41])
def test_a_name_that_is_no_word_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", name]) == 2
    assert "expected letters, digits and underscores" in capsys.readouterr().err
