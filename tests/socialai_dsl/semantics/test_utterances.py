"""What can be said, and the words that may be heard."""

from __future__ import annotations

import pytest

from socialai_dsl.frontend import load
from socialai_dsl.vocabulary import normal, words


@pytest.mark.parametrize("text", ["Open sesame", " open  SESAME. ", "open sesame!?"])
def test_case_and_final_punctuation_do_not_count(text):
    assert normal(text) == "open sesame"


def test_punctuation_inside_counts():
    assert normal("a, b") != normal("a b")


def test_a_value_that_cannot_be_said_is_an_error_if_it_is_drawn(mistakes):
    (found,) = mistakes(let={"n": "pick(2..5)"}, outcome=[{"success": 'agent.said("Here is <n>")'}])
    assert found.startswith("S402 `n` can be 4")


def test_a_value_that_cannot_be_said_is_a_warning_if_it_changes(examine):
    result = examine(outcome=[{"success": 'agent.said("Here is <exit.color>")'}])
    assert [(d.code, d.severity.value) for d in result.diagnostics] == [("S402", "warning")]
    assert result.checked is not None


def test_a_noun_may_be_a_number(outcome_term):
    assert outcome_term('agent.said("Here is 2")').pattern.pairs == {(1, 7)}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Don't go, John!", ["don't", "go", "john"]),
        ("Größe 3-4", ["grösse", "3", "4"]),
        ("a_b", ["a", "b"]),
        ("", []),
    ],
)
def test_words_are_letters_digits_and_apostrophes(text, found):
    assert words(text) == found


def test_vocabulary_is_in_order_of_the_file():
    vocabulary = load("talkitout").checked.words_in_order
    assert vocabulary[:6] == ("where", "is", "open", "which", "how", "are")
    assert vocabulary[6:9] == ("sesame", "the", "exit")
    rest = vocabulary[vocabulary.index("sofa") + 1 :]
    assert rest == (
        "gandalf", "john", "jack", "agent", "i", "am", "fine", "ask", "go", "to",
        "red", "green", "blue", "purple", "yellow", "grey", "door",
    )  # fmt: skip


def test_hidden_npcs_have_the_same_vocabulary():
    assert load("talkitout").checked.words_in_order == load("talkitout+unsocial").checked.words_in_order


def test_words_that_run_together_are_words_of_their_own(meaning):
    frames = {"talk": {"states": {"a": {"then": [{"say": "very <exit.color>ish"}]}}}}
    vocabulary = meaning(frames=frames, cast={"guide": {"frame": "talk"}}).words_in_order
    assert {"redish", "greyish"} <= set(vocabulary)
