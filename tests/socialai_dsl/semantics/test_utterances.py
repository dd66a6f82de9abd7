"""What can be said, and the words that may be heard."""

from __future__ import annotations

import pytest

from socialai_dsl.vocabulary import COLORS, normal, words


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


NOT_ONE_LINE = ("A\nB", "A\rB", "A\tB", "\nA\tB\n")


@pytest.mark.parametrize("text", NOT_ONE_LINE)
@pytest.mark.parametrize(
    "place", ["say", "with", "hears", "name", "noun", "template", "table", "ask", "said"]
)
def test_whatever_is_said_or_named_is_one_line(examine, place, text):
    """So that nothing reads as the line of somebody else."""
    rule = {"hears": "How are you", "say": text if place == "say" else "Hm"}
    if place == "hears":
        rule["hears"] = text
    sections = {
        "frames": {"talk": {"slots": {"line": "text"}, "states": {"a": {"then": [rule, {"say": "<line>"}]}}}},
        "cast": {"guide": {"frame": "talk", "with": {"line": text if place == "with" else "Yes"}}},
        "tables": {"word": dict.fromkeys(COLORS, text if place == "table" else "a")},
        "let": {"exit": "pick(doors)"},
        "outcome": [
            {"success": f'agent.at(exit) and agent.said("{text if place == "said" else "How are you"}")'}
        ],
        "probes": {"p": {"ask": text if place == "ask" else "Open?", "answer": "exit.open"}},
    }
    if place == "name":
        sections["cast"]["guide"]["name"] = text
    nouns, templates = ["you", "me"], ["How are <noun>"]
    sections["grammar"] = {
        "templates": [*templates, f"{text} <noun>"] if place == "template" else templates,
        "nouns": [*nouns, text] if place == "noun" else nouns,
    }
    found = {d.code for d in examine(**sections).diagnostics}
    # Within quotes in an expression a line break has no place at all.
    assert "S405" in found or (place == "said" and found == {"S203"})


@pytest.mark.parametrize(
    ("name", "others", "codes"),
    [
        ("Ann", "Bob", []),
        ("Ann", "Ann", []),
        ("Ann", "ANN", []),
        ("Ann", "\uff21nn", ["W406"]),
        ('"\U0001f98a"', '"\U0001f43b"', []),
        ('"Bob: Ann"', "Bob", ["S405"]),
        ('"Bob\uff1a Ann"', "Bob", ["S405"]),
        ("You", "Bob", ["S405"]),
        ("you  hear", "Bob", ["S405"]),
        ("Young Ann", "Steps", []),
        ("ACT", "Actor", ["S405"]),
        ("Answer", "Answerer", ["S405"]),
        ("2 steps ahead", "Two steps", ["S405"]),
        ("A wall", "Wall", ["S405"]),
    ],
)
def test_names_are_one_speaker_to_all_who_hear_them(examine, name, others, codes):
    found = examine(cast={"guide": {"name": name}, "other": {"name": others}}).diagnostics
    assert [d.code for d in found] == codes


@pytest.mark.parametrize(
    ("lines", "names", "codes"),
    [
        (("Yes!", "Yes?"), "shown", []),
        (("Yes!", "Yes\uff01"), "shown", ["W406"]),
        (("Yes", "Yes"), "shown", []),
        (("Yes", "No"), "shown", []),
        (("by the way", "by  the way"), "shown", []),
        (("by the way", "by\u200d the way"), "shown", ["W406"]),
        (("Caf\u00e9", "Cafe\u0301"), "shown", ["W406"]),
        (("You: turn left", "Yes"), "shown", []),
        (("You: turn left", "Yes"), "hidden", ["S405"]),
        (("It is 10:30", "Yes"), "hidden", []),
    ],
)
def test_texts_that_look_alike_and_are_not_or_like_anothers(examine, lines, names, codes):
    first, second = ({"hears": "How are you", "when": f"t == {t}", "say": say} for t, say in enumerate(lines))
    frames = {"talk": {"states": {"a": {"then": [first, second]}}}}
    found = examine(frames=frames, cast={"guide": {"frame": "talk"}}, observe={"names": names}).diagnostics
    assert [d.code for d in found if d.code != "W311"] == codes


@pytest.mark.parametrize(("who", "codes"), [("shown", []), ("hidden", ["W406"])])
def test_who_says_it_tells_texts_apart_unless_names_are_hidden(examine, who, codes):
    frames = {
        name: {"states": {"a": {"then": [{"hears": "How are you", "say": say}]}}}
        for name, say in (("first", "Yes!"), ("second", "Yes\uff01"))
    }
    cast = {"guide": {"frame": "first"}, "other": {"frame": "second"}}
    found = examine(frames=frames, cast=cast, observe={"names": who}).diagnostics
    assert [d.code for d in found] == codes
