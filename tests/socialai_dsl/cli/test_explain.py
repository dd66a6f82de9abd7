"""`socialai explain`: the list of codes, the page of one, and the data sheet of a scenario."""

import pytest

from socialai_dsl.cli import main
from socialai_dsl.diagnostics import CODES


def test_all_codes_are_listed_with_their_titles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "S001  not YAML"
    assert len(lines) == len(CODES)


@pytest.mark.parametrize("word", ["S101", "s101"])
def test_a_code_has_its_page(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain", word]) == 0
    page = capsys.readouterr().out
    assert page.startswith("# S101: unknown key\n")
    assert "did you mean `horizon`?" in page


@pytest.mark.parametrize(("word", "said"), [("S109", "did you mean S10"), ("S999", "lists all codes")])
def test_an_unknown_code_is_a_mistake_of_the_caller(
    word: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main.main(["explain", word]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err


def test_a_scenario_has_its_sheet(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain", "talkitout"]) == 0
    sheet = capsys.readouterr().out
    assert sheet.startswith("# talkitout\n\nLeave by the right one of four doors.")
    assert "* `talkitout+unsocial`: " in sheet


@pytest.mark.parametrize("name", ["dance+unsocial", "school/collaboration", "novel/whisper", "novel/gossip"])
def test_so_has_everything_that_can_be_loaded(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain", name]) == 0
    assert capsys.readouterr().out.startswith(f"# {name}\n")


def test_a_name_that_is_neither(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain", "talkitot"]) == 2
    assert "talkitout" in capsys.readouterr().err


def test_a_sheet_has_the_reward_and_the_channels_of_its_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["explain", "school/boxes"]) == 0
    sheet = capsys.readouterr().out
    assert "| reward | 1 - 0.1 t / horizon for a success in step t, else 0 |" in sheet
    assert "| observation | image 7 x 7 x 6 and " in sheet
