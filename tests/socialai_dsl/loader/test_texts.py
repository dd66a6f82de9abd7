"""Where a text is expected, plain words are that text; elsewhere they are what YAML makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source
from tests.tiny import Folder

WORDS = [
    "Yes",
    "no",
    "On",
    "off",
    "y",
    "true",
    "False",
    "null",
    "Null",
    "5",
    "-7",
    "1.50",
    "007",
    "0x1F",
    "1:30",
    "2024-01-31",
]
TEXTS = [
    ("frames", "f", "states", "s", "then", 0, "say"),
    ("frames", "f", "states", "s", "then", 0, "hears"),
    ("frames", "f", "states", "s", "then", 0, "hears", 1),
    ("frames", "f", "states", "s", "first", 0, "goto"),
    ("frames", "f", "states", "s", "then", 2, "goto_now"),
    ("frames", "f", "start"),
    ("frames", "f", "steps", 0, "state"),
    ("objects", "lamp", "state"),
    ("grammar", "templates", 0),
    ("cast", "ann", "name"),
    ("cast", "team", "name", 1),
    ("instructions", "en"),
    ("set", "instructions.en"),
    ("set", "instructions", "en"),
    ("set", "frames.f.states.s.then[0].say"),
    ("add", "frames.f.states", "off", "then", 0, "say"),
]  # fmt: skip
"""Places where nothing but a text can stand."""


def value(path: tuple[str | int, ...], word: str) -> Any:
    """What a plain word is read as at a place."""
    text = word
    for step in reversed(path):
        text = f"{{{step!r}: {text}}}" if isinstance(step, str) else "[" + "filler, " * step + text + "]"
    data: Any = read_document(Source("f.yaml", text + "\n")).data
    for step in path:
        data = data[step]
    return data


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: ".".join(map(str, path)))
@pytest.mark.parametrize("word", WORDS)
def test_where_a_text_is_expected_it_is_what_is_written(path: tuple[str | int, ...], word: str) -> None:
    assert value(path, word) == word


@pytest.mark.parametrize("path", [("cast", "ann", "with", "answer"), ("tables", "reply", "red")])
def test_where_a_number_or_truth_can_stand_too_these_are_kept(path: tuple[str | int, ...]) -> None:
    read = {word: value(path, word) for word in WORDS}
    assert read == {word: word for word in WORDS} | {"true": True, "5": 5, "-7": -7}


@pytest.mark.parametrize("path", [("grammar", "nouns", 0), ("grammars", "g", "nouns", 2)])
def test_nouns_that_are_numbers_are_numbers(path: tuple[str | int, ...]) -> None:
    assert {word: value(path, word) for word in WORDS} == {word: word for word in WORDS} | {"5": 5, "-7": -7}


OTHERS = [
    ("let", "say"),
    ("state", "name"),
    ("frames", "f", "let", "start"),
    ("let", "mood", "start"),
    ("frames", "f", "states", "s", "then", 0, "set", "goto"),
    ("frames", "f", "states", "s", "then", 0, "once"),
    ("objects", "lamp", "dark"),
    ("horizon",),
    ("params", "name"),
]
"""Places that are none, though some are called like one."""


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: ".".join(map(str, path)))
def test_elsewhere_words_that_tools_read_differently_are_refused(path: tuple[str | int, ...]) -> None:
    for word in ("Yes", "no", "On", "off", "007", "1:30"):
        with pytest.raises(ScenarioError) as caught:
            value(path, word)
        assert [d.code for d in caught.value.diagnostics] == ["S003"]
    assert value(path, "true") is True
    assert value(path, "5") == 5


def test_nothing_is_no_text() -> None:
    assert value(("say",), "") is None
    with pytest.raises(ScenarioError, match="S003"):
        value(("say",), "~")


def test_such_words_are_said_heard_and_gone_to(tmp_path: Path) -> None:
    episode = Folder(tmp_path)(
        """\
        grammar: {templates: [Yes, Say <noun>], nouns: [off, null, 1.50]}
        frames:
          talk:
            slots: {last: text}
            start: off
            states:
              off: {then: [{hears: Yes, say: No, goto: on}]}
              on: {then: [{hears: Say off, say: On, goto: true}]}
              true: {then: [{hears: Say 1.50, say: <last>, goto: null}]}
              null: {then: [{hears: Say null, say: 1.50}]}
        cast:
          ann: {name: No, frame: talk, with: {last: null}}
        outcome: [{success: ann.is(null) and agent.said("Say off")}, {failure: ann.is(true) and agent.did(done)}]
        """
    )
    heard = []
    for said in ("Yes", "Say off", "Say 1.50", "Say null"):
        episode.step(None, said)
        heard.append(episode.info["utterance"])
    assert heard == ["No: No", "No: On", "No: null", "No: 1.50"]
    assert episode.status("ann") == "null"
    assert episode.step(None, "Say off").terminated
