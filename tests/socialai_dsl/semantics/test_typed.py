"""What is typed becomes an action: split, completed and corrected."""

import pytest

from socialai_dsl.semantics.typed import Phrases, split_line
from socialai_dsl.vocabulary import Sentences, Slot

ACTIONS = ("left", "right", "forward", "pickup", "drop", "toggle", "done")
GRAMMAR = Sentences.of(("Where is <noun>", "Hello"), (Slot("noun", ("the exit", "you")),))
PHRASES = Phrases(ACTIONS, GRAMMAR)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("where is THE exit?", (None, "Where is the exit")),
        ("left  hello!", ("left", "Hello")),
        ("left", ("left", None)),
        ("hallo", (None, "hallo")),
    ],
)
def test_a_sentence_is_read_as_it_would_be_heard(line: str, expected: tuple[str | None, str | None]) -> None:
    assert PHRASES.act(line) == expected


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("", (None, None)),
        ("left", ("left", None)),
        ("f", ("forward", None)),
        ("Forward", ("forward", None)),
        ("forward How are you", ("forward", "How are you")),
        ("Open sesame", (None, "Open sesame")),
        ("t  Open sesame", ("toggle", "Open sesame")),
        ("d", (None, "d")),
        ("do", ("done", None)),
        ("Le mot", (None, "Le mot")),
        (".", (None, None)),
        ("none", (None, None)),
        (". Open sesame", (None, "Open sesame")),
        ("none Open sesame", (None, "Open sesame")),
    ],
)
def test_a_line_is_a_movement_an_utterance_or_both(
    line: str, expected: tuple[str | None, str | None]
) -> None:
    assert split_line(line, ACTIONS) == expected


def test_a_template_without_a_noun_is_one_sentence() -> None:
    assert PHRASES.sentences() == ["Where is the exit", "Where is you", "Hello"]


@pytest.mark.parametrize(
    ("line", "completed"),
    [
        ("wh", "Where is the exit"),
        ("Where is y", "Where is you"),
        ("f  Hel", "f  Hello"),
        ("forward", None),
        ("", None),
        ("What", None),
    ],
)
def test_completed(line: str, completed: str | None) -> None:
    assert PHRASES.completed(line) == completed


@pytest.mark.parametrize(
    ("line", "corrected"),
    [
        ("Wher is teh exit", "Where is the exit"),
        ("left Helo", "left Hello"),
        ("Sing a song", None),
        ("frward", "forward"),
        ("frward Hello", "forward Hello"),
        ("togle Helo", "toggle Hello"),
        ("nonne", "none"),
        ("frward Sing", None),
    ],
)
def test_corrected(line: str, corrected: str | None) -> None:
    assert PHRASES.corrected(line) == corrected


def test_what_is_wrong_with_a_line_names_what_was_meant_or_what_there_is() -> None:
    assert PHRASES.problem("frward") == "'frward' can be neither done nor said; did you mean 'forward'?"
    assert PHRASES.problem("Sing") == "'Sing' cannot be said"
    assert PHRASES.problem("left Helo") == "'Helo' cannot be said; did you mean 'left Hello'?"
    assert PHRASES.problem("sing") == (
        "'sing' can be neither done nor said; "
        "movements are left, right, forward, pickup, drop, toggle, done, ., none"
    )
