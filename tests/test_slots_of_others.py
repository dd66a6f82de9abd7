"""Slots that no template has: others fill them, and the agent can say nothing of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.frontend import check
from socialai_dsl.llm.actions import ActionLanguage
from socialai_dsl.program import Program
from tests.agreement import agree

OFFERS = """\
scenario: offers
room: {size: 5}
earshot: room
grammar: {templates: [Hello], slots: {num: 0..6, hue: colors}}
let: {paint: pick(red | blue)}
frames:
  sell: {states: {s: {then: [{say: "Pay <t> for <paint>"}]}}}
  buy:
    let: {sum: {start: 0, range: 0..99}, last: {start: none}, seen: 0}
    states:
      s:
        then:
          - hears: Pay <num> for <hue>
            when: num % 2 == 1 and hue == paint
            set: {sum: sum + num, last: num, seen: 1}
            say: So <num + 1> for <hue>
          - {hears: any, set: {seen: 2}}
cast:
  sam: {frame: sell}
  bea: {frame: buy}
  agent: {}
outcome:
  - success: bea.sum > 50
"""


@pytest.fixture
def path(tmp_path: Path) -> str:
    (tmp_path / "offers.yaml").write_text(OFFERS, encoding="utf-8")
    return str(tmp_path / "offers.yaml")


def test_a_number_is_heard_and_computed_with(path: str) -> None:
    env = sd.make(path)
    env.reset(seed=0)
    said, sums, seen = [], [], []
    for _ in range(9):
        env.step(np.array([3, 0, 0, 0, 0]))
        state = env.unwrapped.describe()
        said.append(state["heard"][-1])
        sums.append(state["let"]["bea.sum"])
        seen.append(state["let"]["bea.seen"])
    # Steps 1 to 9: of 7 and more there is no word in the slot, and an even number is another rule's.
    assert sums == [1, 1, 4, 4, 9, 9, 9, 9, 9]
    assert seen == [1, 2, 1, 2, 1, 2, 2, 2, 2]
    paint = env.unwrapped.describe()["let"]["paint"]
    assert said[4] == f"Bea: So 6 for {paint}"


def test_the_reference_hears_the_same(path: str) -> None:
    assert agree(path, episodes=2) > 10


def test_the_agent_cannot_say_it(path: str) -> None:
    program = sd.compile(sd.load(path))
    assert isinstance(program, Program)
    assert [program.sentences.text(*one) for one in program.sentences.each()] == ["Hello"]
    assert "<num>" not in ActionLanguage(program).instructions("text")
    env = sd.make(path)
    env.reset(seed=0)
    env.step(np.array([3, 1, 0, 5, 2]))
    assert env.unwrapped.describe()["last"]["said"] == "Hello"


def test_a_slot_that_nobody_hears_is_a_mistake(path: str) -> None:
    Path(path).write_text(OFFERS.replace("num: 0..6", "num: 0..6, m: 1..2"), encoding="utf-8")
    (found,) = check(path).diagnostics
    assert (found.code, found.message) == ("S104", "no template has `<m>`")


def test_what_nobody_says_cannot_be_heard(path: str) -> None:
    Path(path).write_text(OFFERS.replace('say: "Pay <t> for <paint>"', "say: No"), encoding="utf-8")
    assert "S401" in {found.code for found in check(path).diagnostics}


@pytest.mark.parametrize(
    ("grammar", "code"),
    [
        ("{templates: [Hello], slots: {num: [1, 2], hue: [red, blue]}}", None),
        ("{templates: [Hello], slots: {num: [1, 2], other: [a]}}", "S104"),
        ("{templates: [Hello, 'Hello <a>', 'Hello <b>'], slots: {a: [1, 2], b: [2, 3]}}", "S213"),
    ],
)
def test_the_written_grammar_of_a_suite_is_judged_as_a_scenario_s(
    path: str, grammar: str, code: str | None
) -> None:
    suite = Path(path).with_name("suite.yaml")
    suite.write_text(f"suite: suite\nmembers: [offers.yaml]\ngrammar: {grammar}\n", encoding="utf-8")
    assert [found.code for found in check(suite).diagnostics] == ([code] if code else [])
    if code is None:
        envs = sd.make_vec(suite, 4)
        envs.reset(seed=0)
        for _ in range(6):
            envs.step(envs.action_space.sample())


def test_too_many_sentences_of_a_suite(path: str) -> None:
    words = ", ".join(f"w{k}" for k in range(150))
    grammar = f"{{templates: [Hello, <a> <b>], slots: {{a: [{words}], b: [{words}]}}}}"
    text = f"suite: suite\nmembers: [offers.yaml]\ngrammar: {grammar}\n"
    suite = Path(path).with_name("suite.yaml")
    suite.write_text(text, encoding="utf-8")
    (found,) = check(suite).diagnostics
    assert (found.code, "at most 16,384" in found.message) == ("S106", True)
