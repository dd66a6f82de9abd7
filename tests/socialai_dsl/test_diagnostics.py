"""Findings: their order, their suggestions, their printed form, and nothing that acts on a terminal."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import socialai_dsl
from socialai_dsl.diagnostics import (
    CODES,
    Diagnostic,
    DiagnosticBag,
    ScenarioError,
    Severity,
    bounded_suggestions,
    did_you_mean,
    printable,
    render_text,
    to_json,
)
from socialai_dsl.source import Source, Span

SOURCE = Source("t.yaml", "scenario: x\nhorizont: 100\n")
UNKNOWN = Diagnostic(
    "S101",
    "unknown key `horizont` in a scenario",
    SOURCE.span(2, 1, 8),
    hint="a number",
    suggestion="horizon",
)


def test_printed_form() -> None:
    assert render_text([UNKNOWN], {"t.yaml": SOURCE}) == (
        "t.yaml:2:1: S101 unknown key `horizont` in a scenario; did you mean `horizon`?\n"
        "   2 | horizont: 100\n"
        "       ^~~~~~~~\n"
        "  help: a number"
    )


def test_suggestion_names_its_place_and_texts_keep_their_own_quotes() -> None:
    span = SOURCE.span(1, 1)
    named = Diagnostic(
        "S201", "unknown name `exitt`", span, suggestion="exit", suggestion_place="let, line 18"
    )
    text = Diagnostic("S401", 'nobody can say "As"', span, suggestion='"A"')
    assert str(named).endswith("unknown name `exitt`; did you mean `exit` (let, line 18)?")
    assert str(text).endswith('nobody can say "As"; did you mean "A"?')


def test_caret_stands_under_the_character_after_tabs_and_wide_characters() -> None:
    source = Source("w", "\t漢字 x")
    _, line, caret = render_text([Diagnostic("S101", "m", source.span(1, 5))], {"w": source}).split("\n")
    # tab = 4 cells, two wide characters = 4 cells, one space.
    assert caret.index("^") == len("   1 | ") + 4 + 4 + 1
    assert line == "   1 |     漢字 x"


def test_long_lines_are_cut_around_the_place() -> None:
    source = Source("l", "a" * 5000 + "B" + "c" * 5000)
    _, line, caret = render_text([Diagnostic("S101", "m", source.span(1, 5001))], {"l": source}).split("\n")
    assert len(line) < 140
    assert line[caret.index("^")] == "B"


def test_color_changes_nothing_but_escape_sequences() -> None:
    plain = render_text([UNKNOWN], {"t.yaml": SOURCE})
    colored = render_text([UNKNOWN], {"t.yaml": SOURCE}, color=True)
    assert colored != plain
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == plain


def test_json_has_the_promised_fields() -> None:
    assert json.loads(json.dumps(to_json([UNKNOWN], {"t.yaml": SOURCE}))) == [
        {
            "file": "t.yaml",
            "line": 2,
            "column": 1,
            "severity": "error",
            "code": "S101",
            "message": "unknown key `horizont` in a scenario; did you mean `horizon`?",
            "hint": "a number",
            "edits": [
                {"file": "t.yaml", "line": 2, "column": 1, "end_line": 2, "end_column": 9, "text": "horizon"}
            ],
        }
    ]


def test_bag_sorts_by_place_and_drops_repetitions() -> None:
    bag = DiagnosticBag()
    for file, line, column in [("b", 1, 1), ("a", 10, 1), ("a", 2, 7), ("a", 2, 3), ("a", 10, 1)]:
        bag.error("S101", "m", Span(file, line, column))
    assert [(d.span.file, d.span.line, d.span.column) for d in bag] == [
        ("a", 2, 3),
        ("a", 2, 7),
        ("a", 10, 1),
        ("b", 1, 1),
    ]


def test_warnings_alone_do_not_raise() -> None:
    bag = DiagnosticBag()
    bag.warning("W306", "state `gone` can never be entered", Span("f", 1, 1))
    bag.raise_errors()
    assert not bag.has_errors
    bag.error("S301", "no state `x`", Span("f", 2, 1))
    with pytest.raises(ScenarioError, match="no state `x`") as raised:
        bag.raise_errors()
    assert [d.severity for d in raised.value.diagnostics] == [Severity.WARNING, Severity.ERROR]


@pytest.mark.parametrize(
    ("word", "candidates", "meant"),
    [
        ("horizont", ["horizon", "room"], "horizon"),
        ("exitt", ["exit", "next"], "exit"),
        ("aquainted", ["stranger", "acquainted"], "acquainted"),
        ("whne", ["where", "when"], "when"),
        ("watch", ["finished", "watching"], "watching"),
        ("Horizon", ["horizon"], "horizon"),
        ("npc-defaults", ["npc_defaults"], "npc_defaults"),
        ("Where is the exits", ["Where is the exit", "Open the exit"], "Where is the exit"),
        ("on", ["do", "then", "first"], None),
        ("foo", ["barbaz", "horizon"], None),
        ("x", ["y"], None),
        ("", ["a"], None),
        ("same", ["same"], None),
        ("a" * 10_000, ["a"], None),
    ],
)
def test_did_you_mean(word: str, candidates: list[str], meant: str | None) -> None:
    assert did_you_mean(word, candidates) == meant


@given(st.text(min_size=4, max_size=20, alphabet="abcdefg"), st.data())
def test_one_slip_is_always_found(word: str, data: st.DataObject) -> None:
    place = data.draw(st.integers(0, len(word) - 1))
    slip = word[:place] + word[place + 1 :]
    assert did_you_mean(slip, [word, "zzzzzzzzzz"]) in (word, None if slip == word else word)


@given(st.text(st.characters()))
def test_printable_leaves_nothing_a_terminal_acts_on(text: str) -> None:
    assert printable(text).isprintable()
    assert printable(printable(text)) == printable(text)


def test_printable_shows_what_was_there() -> None:
    assert printable("a\x1b[31mb\u202ec\nd\ud800é漢") == r"a\x1b[31mb\u202ec\nd\ud800é漢"


@given(st.text(st.characters()), st.text(st.characters()), st.integers(1, 5), st.integers(1, 30))
def test_hostile_text_never_gets_through(message: str, text: str, line: int, column: int) -> None:
    finding = Diagnostic("S101", message, Span(message, line, column), hint=text, suggestion=text)
    shown = render_text([finding], {message: Source(message, text)})
    assert shown.replace("\n", "").isprintable()
    assert str(finding).isprintable()


def test_every_code_in_the_product_is_in_the_catalogue() -> None:
    package = Path(socialai_dsl.__file__).parent
    used = {
        code
        for file in package.rglob("*.py")
        for code in re.findall(r'"([SW]\d{3})"', file.read_text("utf-8"))
    }
    assert used - CODES.keys() == set()


def test_suggestions_are_looked_for_with_a_fixed_effort() -> None:
    looked_at = 0

    def names() -> Iterator[str]:
        nonlocal looked_at
        for i in range(1_000_000):
            looked_at += 1
            yield f"value{i}"

    with bounded_suggestions():
        assert did_you_mean("valeu1", names()) == "value1"
        assert looked_at < 100_000
        assert did_you_mean("valeu1", ["value1"]) is None
    assert did_you_mean("valeu1", ["value1"]) == "value1"
