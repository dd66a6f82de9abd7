"""`socialai codes`: the list of codes, and the page of one."""

import pytest

from socialai_dsl.cli import main
from socialai_dsl.diagnostics import CODES


def test_all_codes_are_listed_with_their_titles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["codes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "S001  not YAML"
    assert len(lines) == len(CODES)


@pytest.mark.parametrize("word", ["S101", "s101"])
def test_a_code_has_its_page(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["codes", word]) == 0
    page = capsys.readouterr().out
    assert page.startswith("# S101: unknown key\n")
    assert "did you mean `horizon`?" in page


@pytest.mark.parametrize(("word", "said"), [("S1011", "did you mean S101?"), ("what", "lists them all")])
def test_an_unknown_code_is_a_mistake_of_the_caller(
    word: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main.main(["codes", word]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err
