"""What an agent can get without the others: chance where nothing else tells, everything where something leaks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.analysis.alone import Alone, success_alone
from socialai_dsl.analysis.depth import depth
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.properties import Trial
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.compilation import compile_loaded

# One of three doors is right, and Ada would say which. What it looks like is up to the test.
DOORS = """
scenario: doors
horizon: 30
earshot: room
actions: [left, right, forward]
grammar: {templates: [Where is <noun>, Open <noun>], nouns: [it, 0, 1, 2]}
room: {size: 6}
let: {exit: pick(doors)}
objects:
  doors: {type: door, count: 3, color: COLOR, place: each_wall(1)}
frames:
  tell:
    states:
      waiting: {then: [{hears: Where is it, say: Number <exit.index>, goto: content}]}
      content: {}
cast:
  ada: {name: Ada, place: anywhere, facing: down, color: red, frame: tell}
  agent: {place: anywhere}
outcome:
  - {success: agent.said("Open <exit.index>")}
  - failure: agent.spoke and not agent.said("Where is it")
"""


def alone_in(folder: Path, text: str, rooms: int = 24) -> Alone:
    file = folder / "doors.yaml"
    file.write_text(text)
    return alone(str(file), rooms)


def alone(name: str, rooms: int) -> Alone:
    loaded = socialai_dsl.load(name)
    assert isinstance(loaded, LoadedScenario)
    hidden = replace(loaded, checked=replace(loaded.checked, npcs_hidden=True))
    return success_alone(compile_loaded(hidden), Effort(rooms, 0, 20_000))


@pytest.fixture
def doors() -> str:
    return DOORS.replace("count: 3", "count: 4").replace("nouns: [it, 0, 1, 2]", "nouns: [it, 0, 1, 2, 3]")


def test_a_hidden_draw_leaves_a_guess(tmp_path: Path, doors: str) -> None:
    found = alone_in(tmp_path, doors.replace("COLOR", "distinct"), rooms=64)
    assert found.undecided == 0
    assert found.success == pytest.approx(0.25, abs=0.02)
    assert 0 < found.error < 0.01


def test_a_draw_that_shows_is_known(tmp_path: Path, doors: str) -> None:
    """A number beside the door tells where the right one is: it stands where nobody else may."""
    leak = doors.replace("COLOR", "distinct").replace(
        "frames:\n", "  sign: {type: switch, place: next_to(exit)}\nframes:\n", 1
    )
    found = alone_in(tmp_path, leak)
    assert (found.success, found.undecided) == (1.0, 0)


def test_what_nobody_can_do_is_never_solved(tmp_path: Path, doors: str) -> None:
    found = alone_in(
        tmp_path,
        doors.replace("COLOR", "red").replace(
            'exit.index>")}', 'exit.index>") and ada.is(content) and t == 1 and agent.did(done)}'
        ),
        4,
    )
    assert (found.success, found.undecided) == (0.0, 0)


@pytest.mark.thorough("searches many rooms")
def test_talkitout_leaves_a_guess_among_four_doors() -> None:
    assert alone("talkitout", 64).success == pytest.approx(0.25, abs=0.02)


@pytest.mark.thorough("searches many rooms")
def test_the_depth_of_a_scenario(tmp_path: Path) -> None:
    loaded = socialai_dsl.load("talkitout")
    scripted = socialai_dsl.load("talkitout+oracle")
    assert isinstance(loaded, LoadedScenario)
    assert isinstance(scripted, LoadedScenario)
    effort = Effort(rooms=8, states=20_000)
    found = depth(Trial(loaded, effort, scripted), effort)
    assert len(found.steps) + len(found.unsolvable) + len(found.undecided) == 8
    assert found.unsolved == found.unsolvable  # the oracle solves what can be solved
    assert found.steps == tuple(sorted(found.steps))
    assert found.alone is not None
    assert found.alone.rooms == 8


def test_where_there_is_no_npc_nobody_is_missed(tmp_path: Path) -> None:
    loaded = socialai_dsl.load("showme_no_social")
    assert isinstance(loaded, LoadedScenario)
    effort = Effort(rooms=1, states=1_000)
    assert depth(Trial(loaded, effort), effort).alone is None
