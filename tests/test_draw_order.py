"""Picks are numbered in source order, whatever order their parts are resolved or computed in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.frontend import load
from tests.agreement import Pair

SCENARIO = """
scenario: picks
horizon: 12
grammar: {{templates: [Say <noun>], nouns: [red, blue]}}
room: {{size: 7}}
objects:
  boxes: {{type: box, count: 3, place: anywhere, color: random}}
  coins: {{type: ball, count: 4, place: anywhere, color: random}}
cast:
  ann: {{place: anywhere}}
  agent: {{place: anywhere}}
state: {{found: {{start: 0, range: 0..1}}}}
rules:
  - {{when: found == 1, set: {{found: 0}}}}
  - {{when: "{condition}", set: {{found: 1}}}}
outcome: [{{success: t == 12}}]
"""

CONDITIONS = (
    "agent.would_see(pick(boxes), agent.dir_to(pick(coins)))",
    "agent.would_see(boxes, agent.dir_to(pick(coins)))",
    "ann.joint_attention(pick(agent | ann), pick(coins))",
    "agent.distance(pick(coins)) < ann.distance(pick(boxes))",
    "agent.distance(pick(coins)) > ann.distance(pick(boxes))",
    "pick(coins).color in pick(boxes).color | pick(coins).color",
    "red in pick(boxes).color | pick(coins).color",
    "red == pick(boxes).color or pick(coins).color == red",
    "pick(1..pick(2..5)) < pick(1..5)",
    "pick(n in 1..pick(2..5) where n > 1) in 2..pick(2..4)",
    "pick(b in boxes where b.color == pick(red | blue)).x < pick(1..5)",
    "min(pick(1..4), pick(1..6)) == pick(1..3) - pick(0..2)",
    "nearest(b in boxes where b.x < pick(2..5) to pick(coins)) == pick(boxes)",
    "not (pick(boxes).in_line(pick(coins)) and pick(boxes).x < pick(coins).x)",
)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_picks_are_numbered_as_written(tmp_path: Path, condition: str) -> None:
    path = tmp_path / "picks.yaml"
    path.write_text(SCENARIO.format(condition=condition), encoding="utf-8")
    pair = Pair.of(load(str(path)))
    rng = np.random.default_rng(0)
    found = set()
    for episode in range(12):
        pair.reset(0, episode)
        while not pair.step(pair._action(rng)):
            found.add(pair.env.describe()["state"]["found"])
    assert found == {0, 1}, "the condition never changed, so this shows nothing"
