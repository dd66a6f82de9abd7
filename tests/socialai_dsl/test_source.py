"""Sources count lines as editors and the YAML parser do."""

from __future__ import annotations

import pytest

from socialai_dsl.source import Source, Span


@pytest.mark.parametrize("text", ["a\nb\nc", "a\r\nb\r\nc", "a\rb\rc"])
def test_line_breaks_of_all_systems(text: str) -> None:
    source = Source("f", text)
    assert [source.line(n) for n in range(5)] == ["", "a", "b", "c", ""]


def test_spans_are_ordered_by_place_and_print_clickably() -> None:
    assert Span("f", 2, 9) < Span("f", 10, 1)
    assert str(Span("f.yaml", 3, 4, 5)) == "f.yaml:3:4"
    assert Span("f", 3, 4).shifted(2, 7) == Span("f", 3, 6, 7)
