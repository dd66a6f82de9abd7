"""Whether a script peeks, where some rooms cannot be drawn as the scenario requires them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import socialai_dsl as sd
from socialai_dsl.analysis.perceiving import PerceptionResult, perceived
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs.table import Table

# The script opens the right door though nobody tells which it is.
PEEKING = """
scenario: peeking
horizon: 5
actions: [left, right, forward]
grammar: {templates: [Open <noun>], nouns: [0, 1]}
room: {size: 5}
objects:
  doors: {type: door, count: 2, color: red, at: [[0, 2], [4, 2]]}
let: {exit: pick(doors), luck: pick(0..99), more: pick(0..99)}
require: [REQUIRED]
frames:
  oracle: {steps: [{say: Open <exit.index>}]}
cast: {agent: {at: [1, 1], facing: down, frame: oracle}}
outcome: [{success: agent.said("Open <exit.index>")}]
"""
ROOMS = 12


def _of(folder: Path, required: str) -> tuple[sd.LoadedScenario, PerceptionResult]:
    path = folder / "peeking.yaml"
    path.write_text(PEEKING.replace("REQUIRED", required), encoding="utf-8")
    loaded = sd.load(path)
    assert isinstance(loaded, sd.LoadedScenario)
    return loaded, perceived(loaded, ROOMS, 0)


def _can_be_drawn(loaded: sd.LoadedScenario, room: int) -> bool:
    table = Table([sd.compile(loaded)], 1, 1)
    try:
        table.reset(0, {"index": np.array([room])})
    except RoomError:
        return False
    return True


def test_a_room_that_cannot_be_drawn_is_passed_over_and_the_others_keep_their_numbers(tmp_path: Path) -> None:
    loaded, found = _of(tmp_path, "luck == 0")
    there = [room for room in range(ROOMS) if _can_be_drawn(loaded, room)]
    assert 0 < len(there) < ROOMS, "otherwise nothing would be tried"
    assert {peek.index for peek in found.peeks} == set(there)


def test_where_no_room_can_be_drawn_there_are_no_pairs(tmp_path: Path) -> None:
    _, found = _of(tmp_path, "luck == 0 and more == 0")
    assert found == PerceptionResult(0, ())
