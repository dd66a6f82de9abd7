"""A search looks around, walks, and turns where it goes no further; it needs nothing that is out of view."""

from __future__ import annotations

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Op, Register
from tests.assembly import HIDDEN, Assembly, batch_of, constant

LEFT, RIGHT, FORWARD = Body.LEFT, Body.RIGHT, Body.FORWARD


def choice(turn: int, **room: object) -> int:
    """The body action of the first NPC in a turn of its search, in a room whose floor is 3 x 3."""
    block = [(Op.EXPLORE, constant(room.pop("mover", 1)), constant(turn), 0)]  # type: ignore[arg-type]
    batch = batch_of(Assembly(rules=block, **room).program())  # type: ignore[arg-type]
    batch.ports.actions[:] = (7, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    return int(batch.state.registers[0, Register.LAST_TURN])


@pytest.mark.parametrize(
    ("turn", "at", "facing", "expected"),
    [
        *((turn, (1, 2), 0, LEFT) for turn in (0, 1, 2, 16, 18, 34)),
        (3, (1, 2), 0, LEFT),  # two free cells ahead are too few in the first round
        (19, (1, 2), 0, FORWARD),
        (19, (3, 2), 0, RIGHT),  # both sides are free
        (35, (3, 2), 0, LEFT),
        (35, (3, 1), 0, RIGHT),  # only that side is free
        (19, (3, 3), 0, LEFT),
        (19, (2, 1), 1, RIGHT),  # the agent is in the way
    ],
)
def test_turns_and_steps_of_an_npc(turn: int, at: tuple[int, int], facing: int, expected: Body) -> None:
    agent = (2, 2) if at == (2, 1) else (2, 1)
    assert choice(turn, at=(agent, at), npcs=1, facing=(0, facing)) == expected


def test_the_agent_walks_through_npcs_that_it_does_not_see() -> None:
    room = {"at": ((1, 2), (2, 2)), "npcs": 1, "facing": (0, 0), "mover": 0}
    assert choice(19, **room) != FORWARD
    assert choice(19, **room, flags=HIDDEN) == FORWARD


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
