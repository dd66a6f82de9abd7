"""A search finds what is hidden, without anything that is out of view."""

from __future__ import annotations

import numpy as np

import socialai_dsl as sd

LOST = """
scenario: lost
horizon: 200
grammar: {templates: [Hello <noun>], nouns: [you]}
room: {size: 9..12, occlusion: true}
objects:
  boxes: {type: box, count: 8}
  way_out: {type: door, state: open, place: wall(top)}
  ball: {type: ball, place: anywhere}
frames:
  seek: {steps: [{do: search(ball)}, {state: there, do: stay, for: ever}]}
cast:
  ann: {frame: seek}
  agent: {frame: seek}
require: [ann.can_reach(ball) and agent.can_reach(ball)]
outcome:
  - success: agent.is(there) and ann.is(there)
  - failure: agent.at(way_out)
"""


def test_both_find_what_is_hidden_behind_boxes(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "lost.yaml").write_text(LOST, encoding="utf-8")
    envs = sd.make_vec(str(tmp_path / "lost.yaml"), 300, autoreset_mode="Disabled")
    envs.reset(seed=0)
    running, found, soon = np.ones(300, bool), 0, 0
    for turn in range(200):
        *_, terminated, truncated, infos = envs.step(envs.scripted_actions())
        ended = running & (terminated | truncated)
        now = int(infos["success"][ended].sum()) if ended.any() else 0
        found, soon, running = found + now, soon + now * (turn < 40), running & ~ended
    assert found >= 297
    assert soon >= 240
