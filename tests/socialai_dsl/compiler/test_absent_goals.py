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


FULL = """
scenario: full
horizon: 8
grammar: {templates: [Hi <noun>], nouns: [you]}
room: {size: 5}
objects:
  balls: {type: ball, count: 8, color: red}
frames:
  act: {states: {acting: {BEHAVIOUR}}}
cast:
  agent: {facing: up, place: column(1)}
  one: {frame: act, facing: up}
  two: {frame: act, facing: up}
outcome: [{failure: agent.did(done)}]
"""
"""One and two find no free cell: nine cells are there, and the balls and the agent come first."""


@pytest.mark.parametrize(
    "behaviour",
    [
        "do: face(two)",
        "do: point(two)",
        "do: flee(two)",
        "do: use(nearest(b in balls to two))",
        "do: face(nearest(b in balls to two))",
        "first: [{when: nearest(b in balls to two).color == red, do: left}], do: right",
        "first: [{when: two.x < nearest(b in balls to agent).x, do: left}], do: right",
    ],
)
@pytest.mark.parametrize("balls", [6, 7, 8])
def test_so_it_is_if_there_was_no_free_cell(behaviour, balls, tmp_path):
    file = tmp_path / "full.yaml"
    file.write_text(FULL.replace("BEHAVIOUR", behaviour).replace("count: 8", f"count: {balls}"))
    pair = Pair.of(load(file))
    for episode in range(6):
        pair.play(3, episode, np.random.default_rng(episode))
    missing = sum(member.gone for member in pair.reference.world.cast.values())
    assert missing == balls - 6


@pytest.mark.parametrize(
    "behaviour",
    ["do: face(two)", "do: flee(two)", "do: face(nearest(b in balls to two))", "do: go_to(two)"],
)
def test_so_it_is_if_a_layout_leaves_it_out(behaviour, tmp_path):
    file = tmp_path / "left_out.yaml"
    file.write_text(FULL.replace("BEHAVIOUR", behaviour).replace("count: 8", "count: 2"))
    pair, layout = Pair.of(load(file)), {"two": {"gone": True}}
    for seed in range(6):
        pair.env.reset(seed=seed, options={"layout": layout})
        before = pair.env.describe()["one"]
        for _ in range(3):
            pair.env.step((7, 0, 0, 0))
        after = pair.env.describe()["one"]
        assert (after["at"], after["facing"]) == (before["at"], before["facing"]), (
            "there is nothing to be done"
        )
