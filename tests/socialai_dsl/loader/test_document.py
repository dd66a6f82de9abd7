"""Places: of keys, of values, and of single characters inside every kind of scalar."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Node, Source, Span, Style


def read(text: str) -> Node:
    return read_document(Source("f", text))


def place(document: Node, key: str, word: str) -> tuple[int, int]:
    """Line and column of a word in the text at a top-level key."""
    assert isinstance(document.data, dict)
    text = document.data[key]
    assert isinstance(text, str)
    span = document.locate((key,), text.index(word))
    return span.line, span.column


def test_keys_and_values() -> None:
    document = read("a: {b: 12, c: [x, yz]}\nd:\n  - e: 'q r'\n")
    assert document.key_span(("a",)) == Span("f", 1, 1, 1)
    assert document.value_span(("a",)) == Span("f", 1, 4, 1)
    assert document.key_span(("a", "b")) == Span("f", 1, 5, 1)
    assert document.value_span(("a", "b")) == Span("f", 1, 8, 2)
    assert document.value_span(("a", "c", 1)) == Span("f", 1, 19, 2)
    assert document.key_span(("a", "c", 1)) == Span("f", 1, 19, 2)
    assert document.value_span(("d", 0, "e")) == Span("f", 3, 8, 5)
    assert document.at(("a", "b")).span.flow
    assert not document.at(("d", 0, "e")).span.flow
    assert document.at(("d",)).span.style is Style.SEQUENCE


def test_what_does_not_exist_is_where_its_nearest_ancestor_is() -> None:
    document = read("a:\n  b: 1\n")
    assert document.key_span(("a", "x", 3, "y")) == document.key_span(("a",))
    assert document.locate(("zz",)) == Span("f", 1, 1, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("k: one two three", (1, 8)),
        ("k:   one two three   # two", (1, 10)),
        ("k: one\n   two three", (2, 4)),
        ("k: one\n\n\n  zero two three", (4, 8)),
        ("k: 'one two three'", (1, 9)),
        ("k: 'it''s two'", (1, 11)),
        ("k: 'one\n  it''s two'", (2, 9)),
        ('k: "one two three"', (1, 9)),
        ('k: "\\x41\\u0042 \\t two"', (1, 19)),
        ('k: "one \\\n    two"', (2, 5)),
        ('k: "one\n\n    two"', (3, 5)),
        ("k: |\n  one\n  two three", (3, 3)),
        ("k: |-  # a comment with two\n\n  one\n\n    two three\n", (5, 5)),
        ("k: >\n  one\n  two three\n", (3, 3)),
        ("k: >2\n  one\n\n   two\n  three\n", (4, 4)),
        ("k: |\r\n  one\r\n  two\r\n", (3, 3)),
        ("k: é漢 two", (1, 7)),
    ],
)
def test_a_word_in_every_kind_of_scalar(text: str, expected: tuple[int, int]) -> None:
    assert place(read(text), "k", "two") == expected


def test_offsets_outside_the_text_are_its_ends() -> None:
    for text in ("k: push(a", "k: 'push(a'", 'k: "push(a"', "k: |\n  push(a"):
        document = read(text)
        last = document.locate(("k",), len("push(a") - 1)
        assert document.locate(("k",), len("push(a")) == last.shifted(1)
        assert document.locate(("k",), 99) == last.shifted(1)
        assert document.locate(("k",), -5) == document.locate(("k",), 0)


def test_offsets_in_what_is_no_text_are_its_start() -> None:
    document = read("k: {a: 1}\nn: 100\n")
    assert document.locate(("k",), 3) == Span("f", 1, 4, 1)
    assert document.locate(("n",), 2) == Span("f", 2, 6, 1)


WORDS = st.lists(st.text("abc'\"\\#:,é", min_size=1, max_size=6), min_size=1, max_size=12)


@given(WORDS, st.sampled_from(["", "'", '"', "|", ">"]), st.integers(5, 40), st.data())
def test_every_visible_character_is_found_where_it_stands(
    words: list[str], style: str, width: int, data: st.DataObject
) -> None:
    separators = [data.draw(st.sampled_from([" ", "\n", "\n\n", "\n  ", "  "])) for _ in words]
    value = "".join(word + gap for word, gap in zip(words, separators, strict=True))
    dumper = type("Dumper", (yaml.SafeDumper,), {})
    dumper.add_representer(
        str,
        lambda dump, text: dump.represent_scalar(
            "tag:yaml.org,2002:str", text, style if text == value else ""
        ),
    )
    text = yaml.dump({"k": value}, Dumper=dumper, allow_unicode=True, width=width)
    # PyYAML folds some lines of marks and spaces so that nobody reads them back as they were.
    assume(yaml.safe_load(text) == {"k": value})
    try:
        document = read(text)
    except ScenarioError:
        assume(False)
    assert document.data == {"k": value}
    quoted = document.at(("k",)).span.style is Style.DOUBLE
    for offset, character in enumerate(value):
        span = document.locate(("k",), offset)
        there = document.source.line(span.line)[span.column - 1 :]
        if character.isspace():
            continue
        # In double quotes a quote or backslash is written as an escape.
        assert there.startswith(character) or (quoted and there.startswith("\\"))


@given(st.text("ab \n'\"", max_size=30), st.integers(-3, 40))
def test_locating_never_fails(value: str, offset: int) -> None:
    for style in ("'", '"', "|", ">"):
        dumper = type("Dumper", (yaml.SafeDumper,), {})
        dumper.add_representer(
            str, lambda dump, text, style=style: dump.represent_scalar("tag:yaml.org,2002:str", text, style)
        )
        document = read(yaml.dump([value], Dumper=dumper))
        span = document.locate((0,), offset)
        assert span.line >= 1
        assert span.column >= 1
