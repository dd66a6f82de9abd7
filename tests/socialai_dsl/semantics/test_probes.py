"""Entries of `probes`: what they mean, and that no program is another for them."""

from __future__ import annotations

from typing import Any

import pytest

from socialai_dsl.compilation import compile_asking, compile_scenario

DOOR = {"ask": "Which door?", "answer": "exit.color"}


def codes(result: Any) -> list[str]:
    return [diagnostic.code for diagnostic in result.diagnostics]


def test_programs_do_not_contain_what_is_asked(meaning):
    plain = meaning()
    probed = meaning(
        probes={
            "said": {**DOOR, "when": 'agent.said("Where is sesame") and prev(agent.at(exit))'},
            "drawn": {**DOOR, "ask": "Which of <W> doors?"},
        }
    )
    assert probed.probes[0].remembered, "what the step before was like is asked by the probe alone"
    assert not probed.remembered
    assert compile_scenario(probed).sha256 == compile_scenario(plain).sha256
    assert compile_scenario(probed).registers == compile_scenario(plain).registers
    asking = compile_asking(probed)
    assert [notes.name for notes in asking.probes] == ["said", "drawn"]
    assert asking.program.sha256 != compile_scenario(plain).sha256


@pytest.mark.parametrize(
    ("answer", "answers"),
    [
        ("exit.color", ["red", "green", "blue", "purple", "yellow", "grey"]),
        ("agent.at(exit)", ["yes", "no"]),
        ("not agent.at(exit)", ["yes", "no"]),
        ("pair.x // 4", ["0", "1"]),
        ("agent.facing", ["right", "down", "left", "up"]),
        ("guide.name", ["John", "Jack"]),
    ],
)
def test_answers_follow_from_what_is_asked(meaning, answer, answers):
    checked = meaning(
        objects={"pair": {"type": "ball", "place": "anywhere"}},
        cast={"guide": {"name": "pick(John | Jack)"}},
        probes={"asked": {"ask": "What?", "answer": answer}},
    )
    found = ["".join(map(str, text)) for text in checked.probes[0].answers]
    assert [word for word in found if word != "-1"] == answers


def test_words_that_yaml_reads_otherwise_are_texts(meaning):
    checked = meaning(
        probes={"asked": {"ask": True, "answer": "agent.at(exit)", "answers": ["yes", "no", 5]}}
    )
    assert checked.probes[0].ask == ("true",)
    assert checked.probes[0].answers == (("yes",), ("no",), ("5",))


def test_every_part_with_a_mistake_is_reported(examine):
    result = examine(
        probes={
            "asked": {
                "when": "exit.color",
                "ask": "Of <nobody>?",
                "answer": "exit.colour",
                "answers": ["a", "b"],
            }
        }
    )
    assert sorted(codes(result)) == ["S201", "S204", "S205"]


def test_a_draw_that_only_a_probe_uses_is_used(examine):
    assert codes(examine(let={"other": "pick(doors)"})) == ["W317"]
    assert (
        codes(examine(let={"other": "pick(doors)"}, probes={"asked": {**DOOR, "answer": "other.color"}}))
        == []
    )


def test_how_much_can_be_asked_is_bounded(examine):
    asked = {"ask": "<W><W><W><W><W><W><W><W><W><W>" * 8, "answer": "exit.color"}
    assert codes(examine(probes={f"q{k}": asked for k in range(12)})) == []
    assert codes(examine(probes={f"q{k}": asked for k in range(13)})) == ["S106"]
    assert codes(examine(probes={f"q{k}": DOOR for k in range(64)})) == []
    assert codes(examine(probes={f"q{k}": DOOR for k in range(65)})) == ["S106"]
