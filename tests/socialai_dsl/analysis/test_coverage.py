"""What of a scenario never happens: found by chance, by the script, or by searching; and left out what is left out."""

from __future__ import annotations

from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.analysis.coverage import Coverage, coverage
from socialai_dsl.analysis.effort import Effort

# Only who says all three words, one after another and nothing else, is let in.
SECRETIVE = """
scenario: secretive
horizon: 40
actions: [left, right]
earshot: room
grammar: {templates: [Say <noun>], nouns: [one, two, three, four, five, six, seven, eight, nine, ten]}
room: {size: 4}
frames:
  ask:
    states:
      first: {then: [{hears: Say seven, goto: second}]}
      second: {then: [{hears: Say two, goto: third}, {when: agent.spoke, goto: first}]}
      third: {then: [{hears: Say nine, goto: fourth}, {when: agent.spoke, goto: first}]}
      fourth: {then: [{hears: Say four, goto: open}, {when: agent.spoke, goto: first}]}
      open: {then: [{when: t > 60, goto: never}]}
      never: {}
  idle:
    steps: [{do: stay, for: 0}, {do: stay, for: 2}, {do: left, for: ever}]
cast:
  ada: {at: [1, 1], frame: ask}
  bob: {at: [2, 1], frame: idle}
  agent: {at: [1, 2]}
outcome: [{success: ada.is(open), id: in}, {failure: t > 39}]
"""


@pytest.fixture
def covered(tmp_path: Path) -> Coverage:
    file = tmp_path / "secretive.yaml"
    file.write_text(SECRETIVE)
    loaded = socialai_dsl.load(file)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    return coverage(loaded, Effort(2))


def test_a_search_finds_what_chance_does_not(covered: Coverage) -> None:
    """All but what follows once the episode has ended."""
    missing = [(part.kind, part.address) for part in covered.missing]
    assert missing == [("rule", "ada.ask.open.then[0]"), ("state", "ada.ask.never")]


def test_what_is_left_out_is_no_part(covered: Coverage) -> None:
    states, rules, steps, outcomes = 6, 8, 2, 2
    assert covered.parts == states + rules + steps + outcomes
