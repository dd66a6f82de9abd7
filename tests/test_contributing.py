"""docs/contributing.md: the files of each walk exist and speak of what was added, and the code it shows is there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")
WALKS = dict(re.findall(r"^## [^\n`]*`(\w+)[^`\n]*`\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL))


def test_there_is_a_walk_for_an_activity_one_for_a_value_and_one_for_a_key() -> None:
    assert list(WALKS) == ["stay_near", "turns_in_state", "before"]


@pytest.mark.parametrize("word", WALKS)
def test_every_file_of_a_walk_speaks_of_what_was_added(word: str) -> None:
    files = re.findall(r"^\| `([\w/.]+)` \|", WALKS[word], flags=re.MULTILINE)
    assert 5 <= len(files) <= 7
    assert [file for file in files if word not in (ROOT / file).read_text(encoding="utf-8")] == []


def test_code_on_the_page_is_in_the_files() -> None:
    shown = re.findall(r"literalinclude\} \.\./(\S+)\n:language: python\n:pyobject: (\S+)", PAGE)
    assert len(shown) == 2
    for file, name in shown:
        names = set()
        for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8"))):
            for part in ast.iter_child_nodes(node):
                if isinstance(part, ast.FunctionDef):
                    names.add(f"{node.name}.{part.name}" if isinstance(node, ast.ClassDef) else part.name)
        assert name in names


def test_rows_on_the_page_are_those_of_the_table() -> None:
    for file, shown in re.findall(r"literalinclude\} \.\./(\S+)\n:language: python\n:start-at: (.*)\n", PAGE):
        assert (ROOT / file).read_text(encoding="utf-8").count(shown) == 1
