"""`make reference`: the page in the docs is what it prints, and leaves nothing of the language out."""

import re
from pathlib import Path

import pytest

from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.schema.annotations import CALLED, keys_of
from socialai_dsl.semantics.words import SIGNATURES
from tools.reference import main

PAGE = Path(__file__).parents[3] / "docs" / "reference.md"


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> str:
    assert main([]) == 0
    return capsys.readouterr().out


def test_the_page_in_the_docs_is_what_the_engine_says(printed: str, update_goldens: bool) -> None:
    if update_goldens:
        PAGE.write_text(printed, encoding="utf-8")
    assert printed == PAGE.read_text(encoding="utf-8"), "run: make reference"


def test_it_is_written_to_a_file(printed: str, tmp_path: Path) -> None:
    assert main(["--out", str(tmp_path / "page.md")]) == 0
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == printed


def test_every_key_has_a_row_under_its_model(printed: str) -> None:
    sections = printed.split("\n### ")[1:]
    for section, model in zip(sections, CALLED, strict=False):
        rows = re.findall(r"^\| `([^`]+)` \|", section.split("\n## ")[0], re.MULTILINE)
        assert rows[: len(keys_of(model))] == keys_of(model), section.splitlines()[0]
        assert set(rows[len(keys_of(model)) :]) <= {"extends", "count"}


def test_every_word_has_a_row(printed: str) -> None:
    words = re.findall(r"^\| `(?:\w\.)?(\w+)[(`]", printed, re.MULTILINE)
    assert {signature.name for signature in SIGNATURES} <= set(words)
    assert {*prelude().types, *shared_grammars()} <= set(words)


def test_what_a_key_takes_is_said_in_words(printed: str) -> None:
    assert "| `horizon` | a whole number, 1 to 10000 | `100` | the episode ends at t == horizon |" in printed
    assert "typing" not in printed
    assert "socialai_dsl" not in printed
    assert "tuple" not in printed


def test_no_word_in_angle_brackets_is_taken_for_html(printed: str) -> None:
    """Markdown leaves out `<noun>` where it does not stand in code."""
    assert re.findall(r"<\w+", re.sub(r"`[^`\n]*`", "", printed)) == []
