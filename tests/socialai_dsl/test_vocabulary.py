"""How texts are compared is the same for checking a file and for playing it."""

import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.vocabulary import first_alike, normal, words
from tests.reference.speech import canonical
from tests.reference.speech import words as spelled
from tests.tiny import Folder


@pytest.mark.parametrize(
    "text", ["Open the door", " open  the\tdoor ", "OPEN THE DOOR!", "Open the door .", "Open the door?!"]
)
def test_case_blanks_and_final_marks_do_not_count(text: str) -> None:
    assert normal(text) == "open the door"


SAME = [
    ("Caf\u00e9", "Cafe\u0301"),
    ("Yes", "\uff39\uff25\uff33\uff1f"),
    ("Stra\u00dfe", "STRASSE"),
    ("don't", "Don\u2019t"),
    ("well\u00a0 done", "Well done\u2026"),
    ("by\u200dthe way", "bythe way!"),
    ("\u2764", "\u2764\ufe0f"),
    ("\u4f60\u597d", "\u4f60\u597d\u3002"),
    ("\u03a3\u03a3", "\u03c3\u03c2"),
]
"""Texts that look or sound alike."""


@pytest.mark.parametrize(("text", "other"), SAME)
def test_what_looks_alike_is_one_in_everything(text: str, other: str) -> None:
    """In hearing, in tokens, in suggestions."""
    assert normal(text) == normal(other)
    assert words(text) == words(other)
    assert did_you_mean(text, [unicodedata.normalize("NFD", text), text + "\u200d"]) is None
    assert first_alike(other, {normal(text): text}) == text


@given(st.text(max_size=20))
def test_comparing_is_settled(text: str) -> None:
    """What is compared is compared as itself, and its words are words; so says the reference."""
    assert normal(normal(text)) == normal(text)
    assert normal(text) == " ".join(normal(text).split())
    assert normal(text) == canonical(text)
    assert words(text) == spelled(text)
    assert [word for word in words(text) if words(word) != [word]] == []


def test_marks_alone_are_told_apart() -> None:
    assert len({normal(text) for text in ("?", "!", "...", "\U0001f642", "\U0001f641")}) == 5
    assert words("?!") == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("\u4f60\u597d, Bob", ["\u4f60", "\u597d", "bob"]),
        ("\u3053\u3093", ["\u3053", "\u3093"]),
        ("\u0e14\u0e35\u0e04", ["\u0e14\u0e35", "\u0e04"]),
        ("\u0939\u093f\u0928\u094d\u0926\u0940 7", ["\u0939\u093f\u0928\u094d\u0926\u0940", "7"]),
        ("\ud55c\uad6d\uc5b4 \ub9d0", ["\ud55c\uad6d\uc5b4", "\ub9d0"]),
    ],
)
def test_words_of_other_scripts(text: str, expected: list[str]) -> None:
    """A letter with its marks where there are no blanks, else a word with its marks."""
    assert words(text) == expected


def test_words_are_runs_of_letters_digits_and_apostrophes() -> None:
    assert words("Don't  go_to room 7!") == ["don't", "go", "to", "room", "7"]


@pytest.mark.parametrize("said", ["Say  hello", '"Say  <what>"'])
def test_blanks_do_not_count_in_what_a_script_says_and_others_hear(tmp_path: Path, said: str) -> None:
    episode = Folder(tmp_path)(
        f"""\
        let: {{what: pick("hello" | "bye")}}
        frames:
          script: {{states: {{a: {{then: [{{say: {said}}}]}}}}}}
          doorman: {{states: {{b: {{then: [{{hears: Say <noun>, say: Welcome  back}}]}}}}}}
        cast:
          agent: {{frame: script}}
          porter: {{frame: doorman, at: [3, 3]}}
        """,
    )
    episode.act(episode.env.unwrapped.scripted_action()).step()
    assert "Porter: Welcome  back" in episode.info["history"]
