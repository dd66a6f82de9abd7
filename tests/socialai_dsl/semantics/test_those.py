"""`those(...)` in keys of registers and before effects."""

from __future__ import annotations

from pathlib import Path

from tests.tiny import Folder


def test_a_noun_of_several_words_is_a_value_for_those(tmp_path: Path) -> None:
    run = Folder(tmp_path)("""
        grammar: {templates: [Say <noun>], nouns: [the exit, sesame]}
        objects: {balls: {type: ball, count: 3}}
        state: {word: {for: balls, start: none}}
        rules: [{when: t == 1, set: {word(those(b in balls where b.index > 0)): the exit}}]
    """).step()
    assert run.state["state"]["word"] == {"balls[0]": "none", "balls[1]": "the exit", "balls[2]": "the exit"}
