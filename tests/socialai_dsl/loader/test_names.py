"""Names of scenarios come apart at `+`, `?` and `&`, and point into themselves where they are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.loader.resolved import ScenarioName, name_source, parse_name, taken_apart
from socialai_dsl.traces.endings import short_name
from socialai_dsl.trainer.config import scenario_file


def parse(text: str, folder: Path | None = None) -> tuple[ScenarioName, list[str]]:
    found = DiagnosticBag()
    name = parse_name(text, name_source(text).span(1, 1), found, folder)
    return name, [f"{d.span.column}: {d.code} {d.message}" for d in found]


@pytest.mark.parametrize(
    ("text", "base", "variants", "params"),
    [
        ("dance", "dance", [], {}),
        ("dance+unsocial", "dance", ["unsocial"], {}),
        ("a/b.yaml+x+y", "a/b.yaml", ["x", "y"], {}),
        ("dance?length=2&sing=1", "dance", [], {"length": "2", "sing": "1"}),
        ("dance+u?f=a+b/c", "dance", ["u"], {"f": "a+b/c"}),
        ("a+b/c.yaml", "a+b/c.yaml", [], {}),
        ("a+b/c.yaml+d", "a+b/c.yaml", ["d"], {}),
        ("x?a=", "x", [], {"a": ""}),
        ("x?a==b", "x", [], {"a": "=b"}),
    ],
)
def test_parts(text: str, base: str, variants: list[str], params: dict[str, str]) -> None:
    name, found = parse(text)
    assert found == []
    assert name.base.text == base
    assert [part.text for part in name.variants] == variants
    assert {key: part.text for key, part in name.params.items()} == params


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "1: S508"),
        ("   ", "1: S508"),
        ("a\nb", "1: S508"),
        ("a\x1b[0m", "1: S508"),
        ("x" * 5000, "1: S508"),
        ("a+", "3: S508"),
        ("a++b", "3: S508"),
        ("a+b c", "3: S508"),
        ("a+../b", "1: "),
        ("a?", "3: S508"),
        ("a?b", "3: S508"),
        ("a?b=1&", "7: S508"),
        ("a?b=1&b=2", "7: S508"),
        ("a?1=2", "3: S508"),
    ],
)
def test_mistakes_are_placed(text: str, place: str) -> None:
    name, found = parse(text)
    # A `+` before the last slash belongs to a folder's name.
    if text == "a+../b":
        assert (name.base.text, found) == (text, [])
    else:
        assert found[0].startswith(place)


def test_files_with_plus_and_question_mark_in_their_names(tmp_path: Path) -> None:
    (tmp_path / "a+b.yaml").touch()
    (tmp_path / "c?d.yaml").touch()
    assert parse("a+b.yaml", tmp_path)[0].base.text == "a+b.yaml"
    name, _ = parse("a+b.yaml?k=1", tmp_path)
    assert (name.base.text, list(name.params)) == ("a+b.yaml", ["k"])
    assert parse("c?d.yaml", tmp_path)[0].base.text == "c?d.yaml"


@pytest.mark.parametrize(
    "text", ["dance+u?f=a+b/c", "a+b/c.yaml", "a+b/c.yaml+d?e=1", "/x/a+b/c.yaml+d", "a/b+c"]
)
def test_everybody_takes_names_apart_alike(text: str) -> None:
    base, rest = taken_apart(text)
    assert scenario_file(text) == Path(base)
    assert short_name(text) == (Path(base).name + rest if base.endswith(".yaml") else text)


@given(st.text("ab+?&=/. \n", max_size=12))
def test_any_text_is_taken_apart(text: str) -> None:
    name, found = parse(text)
    if not found:
        variants = "".join(f"+{part.text}" for part in name.variants)
        params = "&".join(f"{key}={part.text}" for key, part in name.params.items())
        assert name.base.text + variants + ("?" + params if name.params else "") == text
