"""Rows, columns and what is near a thing are filled at once, with the cells that asking for each one finds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import socialai_dsl

SCENARIO = """
scenario: shapes
horizon: 5
actions: [left, right, forward]
grammar: {templates: [Go <noun>], nouns: [away]}
room: {size: 8}
objects:
  door: {type: door, color: red, place: wall(top)}
  statue: {type: ball, color: red, place: anywhere}
  box: {type: box, color: red, place: "anywhere where %s"}
let: {number: pick(1 | 2)}
cast: {agent: {color: red, place: anywhere}}
outcome: [{success: agent.at(door)}]
"""

PLACES: dict[str, Callable[[list[int], list[int]], bool]] = {
    "here.x < 3": lambda box, _: box[0] < 3,
    "not here.y > 2": lambda box, _: box[1] <= 2,
    "here.x != 3 and here.y != statue.y": lambda box, statue: box[0] != 3 and box[1] != statue[1],
    "here.in_line(statue)": lambda box, statue: box[0] == statue[0] or box[1] == statue[1],
    "not (here.in_line(statue) or here.x == 1)": lambda box, statue: (
        box[0] not in (1, statue[0]) and box[1] != statue[1]
    ),
    "statue.x < 4 or here.y == 1": lambda box, statue: statue[0] < 4 or box[1] == 1,
}


@pytest.mark.parametrize("where", PLACES)
def test_places_are_shapes(where: str, tmp_path: Path) -> None:
    path = tmp_path / "shapes.yaml"
    path.write_text(SCENARIO % where)
    program = socialai_dsl.compile(socialai_dsl.load(path))
    assert isinstance(program, socialai_dsl.Program), program
    assert "EACH_CELL" not in program.listing()
    env = socialai_dsl.make(path)
    env.reset(seed=3)
    boxes = set()
    for _ in range(60):
        env.reset()
        state = env.describe()
        boxes.add(tuple(state["box"]["at"]))
        assert PLACES[where](state["box"]["at"], state["statue"]["at"]), state
    assert len(boxes) > 5


def test_what_is_the_same_for_all_cells_is_asked_once(tmp_path: Path) -> None:
    path = tmp_path / "shapes.yaml"
    path.write_text(SCENARIO % "number == 2")
    program = socialai_dsl.compile(socialai_dsl.load(path))
    assert isinstance(program, socialai_dsl.Program), program
    assert "EACH_CELL" not in program.listing()
    env = socialai_dsl.make(path)
    seen = set()
    for _ in range(30):
        env.reset()
        state = env.describe()
        seen.add((state["let"]["number"], state["box"]["at"] is not None))
    assert seen == {(1, False), (2, True)}
