"""What a row of a table looks like: the view, and NPCs that stand in an object's cell."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.envs import ScenarioEnv, make
from socialai_dsl.library import prelude
from socialai_dsl.render import tiles
from socialai_dsl.render.tiles import draw_tile

CODES = {name: type_.code for name, type_ in prelude().types.items()}

LEAVING = """
scenario: leaving
horizon: 20
grammar: {templates: [Hello <noun>], nouns: [you]}
room: {size: 5}
objects:
  gate: {type: door, state: open, color: green, at: [4, 2]}
frames:
  go: {steps: [{do: go_to(gate)}, {state: there, do: stay, for: ever}]}
cast:
  ann: {kind: guest, color: yellow, at: [3, 2], facing: right, frame: go}
  agent: {at: [1, 1], facing: right}
outcome:
  - success: agent.did(done)
"""


@pytest.fixture
def leaving(tmp_path: Path) -> Iterator[ScenarioEnv]:
    file = tmp_path / "leaving.yaml"
    file.write_text(LEAVING)
    env = make(str(file), render_mode="rgb_array")
    env.reset(seed=0)
    yield env
    env.close()


def test_an_npc_in_a_doorway_is_drawn_in_it(leaving: ScenarioEnv) -> None:
    leaving.step(leaving.encode_action((None, None)))
    assert leaving.describe()["ann"]["at"] == leaving.describe()["gate"]["at"] == [4, 2]
    drawn = leaving.render()[64:96, 128:160]
    doorway, ann = (CODES["door"], 1, 0, 0), (tiles.NPC, 4, 0, 0)
    assert (drawn[4:-4, 4:-4] == draw_tile(ann, None, True, 32, below=doorway)[4:-4, 4:-4]).all()


def test_a_room_without_such_an_npc_is_drawn_as_seen(leaving: ScenarioEnv) -> None:
    drawn = leaving.render()
    assert drawn.shape == (160, 160, 3)
    door = draw_tile((CODES["door"], 1, 0, 0), None, True, 32)
    assert np.array_equal(drawn[64:96, 128:160][4:-4, 4:-4], door[4:-4, 4:-4])


def test_the_cast_has_labels_and_faces(leaving: ScenarioEnv) -> None:
    (ann,) = leaving.cast()
    assert ann.label == "ann"
    assert np.array_equal(ann.look, draw_tile((tiles.NPC, 4, 0, 1), None, False, 32))


def test_drawn_names_are_told_and_hidden_npcs_are_not_shown() -> None:
    env = make("talkitout")
    env.reset(seed=1)
    described = env.describe()
    assert [face.label for face in env.cast()] == [
        "wizard",
        f"honest: {described['honest']['name']}",
        f"liar: {described['liar']['name']}",
    ]
    hidden = make("talkitout+unsocial")
    hidden.reset(seed=1)
    assert hidden.cast() == []
