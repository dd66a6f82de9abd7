"""What is not in the room is nothing to turn to, to point at or to flee from."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.frontend import load
from tests.agreement import Pair

SCENARIO = """
scenario: absent
horizon: 8
earshot: room
grammar: {templates: [Hi <noun>], nouns: [you]}
room: {size: 7}
observe: {channels: [type, color, status, orientation, pointing, last_act]}
objects:
  toy: {type: ball, place: nowhere}
frames:
  act: {states: {acting: {do: ACTIVITY}}}
cast:
  agent: {place: column(1), facing: up}
  one: {frame: act, place: column(4), facing: up}
rules:
  - {when: t == 3, cause: [toy.put(agent)]}
  - {when: t == 6, cause: [toy.vanish]}
outcome: [{failure: agent.did(done)}]
"""
STAY = (7, 0, 0, 0)


@pytest.fixture
def pair(tmp_path, request):
    """The scenario with an activity, played by the engine and by the reference."""
    file = tmp_path / "absent.yaml"
    file.write_text(SCENARIO.replace("ACTIVITY", request.param))
    return Pair.of(load(file))


@pytest.mark.parametrize("pair", ["face(toy)", "point(toy)", "flee(toy)"], indirect=True)
def test_nothing_is_done_while_the_thing_is_not_there(pair):
    env = pair.env
    env.reset(seed=3)
    lasting = []
    for _ in range(7):
        env.step(STAY)
        one = env.describe()["one"]
        lasting.append((one["at"], one["facing"], one.get("pointing")))
    # The toy is put on the agent at the end of step 3 and vanishes at the end of step 6.
    assert lasting[0] == lasting[2] != lasting[3]
    assert lasting[5] == lasting[6]


@pytest.mark.parametrize("pair", ["face(toy)", "point(toy)", "flee(toy)", "follow(toy)"], indirect=True)
def test_the_reference_says_the_same(pair):
    for episode in range(10):
        pair.play(3, episode, np.random.default_rng(episode))
