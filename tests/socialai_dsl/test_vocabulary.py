"""How texts are compared is the same for checking a file and for playing it."""

import json
import unicodedata
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.vocabulary import composed, first_alike, normal, telling_pieces, tokens, words
from tests.reference.speech import canonical, spelt, telling_parts
from tests.reference.speech import words as spelled
from tests.test_same_world import differ_alike
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


PARTS = st.sampled_from(
    [
        *"aA1'?!,- .",
        "ab",
        "Ab",
        "AB",
        "\u00e9",
        "\u00c9",
        "\u4f60",
        "\U0001f642",
        "\u0345",
        "\u00df",
        "ss",
        "\uff01",
    ]
)


@given(st.lists(st.lists(PARTS, max_size=8).map("".join) | st.text(max_size=8), min_size=2, max_size=6))
def test_lines_differ_as_tokens_exactly_if_they_differ_as_they_look(lines: list[str]) -> None:
    """Blanks count as one; what the words of lines tell apart already needs no other token; so says the reference."""
    telling = telling_pieces(lines)
    looks = {line: " ".join(composed(line).split()) for line in lines}
    heard = {line: tuple(tokens(line, telling)) for line in lines}
    for one, other in combinations(lines, 2):
        assert (heard[one] == heard[other]) == (looks[one] == looks[other])
        assert words(one) == words(other) or heard[one] != heard[other]
    if len({tuple(words(line)) for line in lines}) == len(set(looks.values())):
        assert telling == []
        assert all(tokens(line, telling) == words(line) for line in lines)
    assert set(telling) == telling_parts(lines)
    assert [spelt(line, telling) for line in lines] == [[*heard[line]] for line in lines]


LINES = st.text("aAb!?,- ", min_size=1, max_size=5).filter(str.strip)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(LINES, min_size=2, max_size=3), names=st.sampled_from(["shown", "hidden"]))
def test_programs_tell_lines_apart_as_they_look(tmp_path: Path, lines: list[str], names: str) -> None:
    rules = [{"when": f"t == {t + 1}", "say": f'"{line}"'} for t, line in enumerate(lines)]
    content = {
        "observe": {"names": names},
        "frames": {"talk": {"states": {"a": {"then": rules}}}},
        "cast": {"ann": {"frame": "talk", "at": [2, 2]}},
    }
    episode = Folder(tmp_path)("\n".join(f"{key}: {json.dumps(one)}" for key, one in content.items()))
    assert differ_alike(episode.env.unwrapped.program)
