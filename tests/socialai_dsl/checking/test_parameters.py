"""A parameter stands for a value that names no parameter, wherever either is written."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from socialai_dsl.frontend import check
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import DataPath, Source

BASE = """\
scenario: base
params: {PARAMS}
grammar: {templates: [Hello <noun>], nouns: [there]}
room: {size: 6}
state: {s: {start: $n, range: 0..9}}
cast: {agent: {}}
outcome: [{success: agent.said("Hello there") and s == $n + 1}]
"""
RICH = Path(__file__).parents[2] / "diagnostics" / "rich.yaml"


@pytest.mark.parametrize(
    "params",
    [
        "n: $m, m: 3",
        "n: $n",
        "n: $unknown",
        'n: "1 + $m", m: 3',
        "n: {default: $m, values: [1, $m]}, m: 3",
        'n: {default: 1, values: [1, "max($m, 1)"]}, m: 3',
        "n: {default: low, values: {low: $m, high: 9}}, m: 3",
        'n: {default: low, values: {low: 1, high: "$m + 1"}}, m: 3',
    ],
)
def test_a_value_that_names_a_parameter_is_a_finding_where_it_is_written(tmp_path: Path, params: str) -> None:
    file = tmp_path / "base.yaml"
    file.write_text(BASE.replace("PARAMS", params), encoding="utf-8")
    (found, *_) = check(file).diagnostics
    assert (found.code, found.span.line) == ("S206", 2)
    assert found.hint is not None
    assert "write the value itself" in found.hint


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("base.yaml?n=$m", None),
        ("base_more.yaml", "variant: base_more\nof: base.yaml\nset: {params.n: $m}\n"),
        ("both.yaml", "suite: both\nmembers: [base.yaml?n=1, base.yaml?n=$m]\n"),
        ("both.yaml", "suite: both\nmembers: [{scenario: base.yaml, set: {params.n: $m}}]\n"),
        ("grown.yaml", "suite: grown\ntree: {n: {a: {scenario: base.yaml?n=$m}}}\n"),
        (
            "tried.yaml",
            "experiment: tried\nconditions:\n  - {name: a, frames: 100, scenario: 'base.yaml?n=$m'}\n",
        ),
    ],
)
def test_so_is_one_that_another_file_or_a_name_gives(tmp_path: Path, name: str, text: str | None) -> None:
    (tmp_path / "base.yaml").write_text(BASE.replace("PARAMS", "n: 1, m: 3"), encoding="utf-8")
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    found = {d.code for d in check(tmp_path / name).diagnostics}
    assert found == {"S206"}


def test_a_text_may_have_a_dollar_sign(tmp_path: Path) -> None:
    params = 'n: 1, line: "It costs $much"'
    rule = "{states: {s: {then: [{hears: Hello there, say: $line}]}}}"
    text = BASE.replace("PARAMS", params) + f"frames: {{talk: {rule}}}\n"
    (tmp_path / "base.yaml").write_text(
        text.replace("{agent", "{ann: {frame: talk}, agent"), encoding="utf-8"
    )
    assert check(tmp_path / "base.yaml").diagnostics == ()


FREE = {("about",), ("params", "count", "values", 1)}
"""What may be any text."""


def _leaves() -> list[DataPath]:
    tree = read_document(Source("rich.yaml", RICH.read_text(encoding="utf-8")))
    return [path for path, node in tree.walk() if node.children is None]


@pytest.mark.parametrize("value", ["$unknown", "<$unknown>", "$count"])
def test_no_parameter_outlives_the_check(tmp_path: Path, value: str) -> None:
    """Whatever is replaced by one: there is a finding, or it is text for people or has a value."""
    shutil.copytree(RICH.parent / "guides", tmp_path / "guides")
    (tmp_path / "rich.yaml").write_text(RICH.read_text(encoding="utf-8"), encoding="utf-8")
    for path in _leaves():
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)[1:]
        changed = f"variant: changed\nof: rich.yaml\nset: {{{keys!r}: {value!r}}}\n"
        (tmp_path / "changed.yaml").write_text(changed, encoding="utf-8")
        result = check(tmp_path / "changed.yaml")
        assert result.has_errors or value == "$count" or path in FREE, path


def test_a_parameter_is_one_item_of_a_list_whatever_it_stands_for(tmp_path: Path) -> None:
    """A base in which a list is too short for any value is told so, not only the files that build on it."""
    file = tmp_path / "base.yaml"
    text = "scenario: base\nabstract: true\nparams: {n: {values: [a, b]}}\nlooks: {s: {for: balls, words: WORDS}}"
    file.write_text(text.replace("WORDS", "[$n]"), encoding="utf-8")
    assert [(d.code, d.message) for d in check(file).diagnostics] == [
        ("S106", "`words` has fewer than 2 entries")
    ]
    file.write_text(text.replace("WORDS", "[$n, middling]"), encoding="utf-8")
    assert check(file).diagnostics == ()


@pytest.mark.parametrize(
    ("param", "known"),
    [
        ('"5"', ["5", "6.5", "true", "yes", "a b", "010"]),
        ('{default: "5", values: ["5", "6", "true", "yes"]}', ["5", "6", "true", "yes"]),
        ("{default: 2, values: [1, 2]}", ["1", "2"]),
        ("{default: true, values: [true, false]}", ["true", "false"]),
    ],
)
def test_a_value_is_asked_for_as_it_is_spelt(tmp_path: Path, param: str, known: list[str]) -> None:
    """Also a text that YAML would read as a number, and each value that a finding says there is."""
    file = tmp_path / "base.yaml"
    file.write_text(BASE.replace("PARAMS", f"n: 1, one: {param}"), encoding="utf-8")
    for value in known:
        assert check(f"{file}?one={value}").diagnostics == ()
    if "values" in param:
        (found,) = check(f"{file}?one=none_of_them").diagnostics
        assert found.hint == "one of " + ", ".join(known)
