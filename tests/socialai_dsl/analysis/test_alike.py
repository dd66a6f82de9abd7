"""Draws that are balanced against each other: what no single draw tells, several together do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import socialai_dsl
from socialai_dsl.analysis.alike import divided, many_rooms, perceived_so_far
from socialai_dsl.analysis.check import check_scenario
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.reports import Verdict

ROOMS = 30

# With another side the picture differs, and with another colour; with both it is the same, and the answer is another.
BALANCED = """
scenario: balanced
about: One of two boxes is right; its side and its colour are drawn apart.
horizon: 20
earshot: room
actions: [left, right, forward]
grammar: {templates: [Where is <noun>], nouns: [it]}
room: {size: 7}
objects:
  good: {type: box, color: shade, at: ["1 if side == 0 else 5", 1]}
  bad: {type: box, color: other, at: ["5 if side == 0 else 1", 1]}
let: {side: pick(0 | 1), shade: pick(red | blue), moment: pick(4 | 5)}
define: {other: blue if shade == red else red}
frames:
  teach: {states: {quiet: {then: [{when: t >= moment, say: TOLD, goto: over}]}, over: {}}}
  solve: {steps: [WAIT, {do: go_next_to(good)}]}
cast:
  tess: {name: Tess, at: [3, 5], facing: up, frame: teach}
  agent: {at: [3, 3], facing: up, frame: solve}
outcome:
  - {success: agent.next_to(good)}
  - {failure: agent.next_to(bad)}
check:
  - {script: perceives}
  - {knowable: true}
"""


def reports(tmp_path: Path, told: str, waits: str) -> dict[str, socialai_dsl.analysis.reports.Report]:
    """What is found of each claim."""
    path = tmp_path / "balanced.yaml"
    path.write_text(BALANCED.replace("TOLD", told).replace("WAIT, ", waits))
    loaded = socialai_dsl.load(str(path))
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    report = check_scenario(loaded, str(path), Effort(ROOMS))
    return {plan.text: found for plan, found in report.tried}


def test_what_nobody_tells_is_not_known_though_every_draw_alone_shows(tmp_path: Path) -> None:
    found = reports(tmp_path, "Well", '{do: stay, until: heard("Well")}, ')
    assert found["knowable: true"].verdict is Verdict.FAILS
    assert "a combination of draws stays hidden" in found["knowable: true"].said
    assert found["script: perceives"].verdict is Verdict.FAILS
    assert "look and sound alike till step" in found["script: perceives"].said


def test_what_is_told_is_known_and_the_script_that_listens_perceives_it(tmp_path: Path) -> None:
    found = reports(tmp_path, "The <shade> one", '{do: stay, until: heard("The <shade> one")}, ')
    assert {text: one.verdict for text, one in found.items()} == dict.fromkeys(found, Verdict.HOLDS)
    assert f"{ROOMS} of them look to the end like rooms" not in found["knowable: true"].said


def test_a_script_that_does_not_wait_for_the_word_is_found_out(tmp_path: Path) -> None:
    found = reports(tmp_path, "The <shade> one", "")
    assert found["script: perceives"].verdict is Verdict.FAILS
    assert found["knowable: true"].verdict is Verdict.HOLDS  # one can wait for the word


@pytest.mark.parametrize("name", ["talkitout+oracle", "novel/sally_anne+oracle"])
def test_rooms_are_the_same_to_perception_exactly_if_their_observations_are(name: str) -> None:
    table = many_rooms(socialai_dsl.compile(socialai_dsl.load(name)), 64, 3).table
    table.batch.ports.actions[:] = table.scripted_actions()
    numbers = perceived_so_far(table)
    state = table.state
    seen = [
        b"".join(part[row].tobytes() for part in (state.image, state.extra, state.tokens))
        for row in range(64)
    ]
    for row in range(64):
        same = np.array([one == seen[row] for one in seen])
        assert ((numbers[:64] == numbers[row]) == same).all()


def test_divisions_name_rooms_of_which_each_acts_otherwise_after_the_same_past(tmp_path: Path) -> None:
    path = tmp_path / "balanced.yaml"
    path.write_text(BALANCED.replace("TOLD", "Well").replace("WAIT, ", ""))
    program = socialai_dsl.compile(socialai_dsl.load(str(path)))
    groups, divisions = divided(program, ROOMS, 0)
    assert groups >= 2
    for one in divisions:
        pasts, acts = zip(*(_past(program, room, one.step) for room in one.rooms), strict=True)
        assert pasts[0] == pasts[1]
        assert acts[0] != acts[1]


def _past(program: socialai_dsl.Program, room: int, step: int) -> tuple[list[bytes], tuple[int, ...]]:
    """All observations of a room until its script chooses in a step, and what it chooses."""
    env = socialai_dsl.make_vec(program, num_envs=1)
    seen = env.reset(seed=0, options={"index": room})[0]
    past = [seen["image"].tobytes() + seen["tokens"].tobytes()]
    for _ in range(step - 1):
        seen = env.step(env.scripted_actions())[0]
        past.append(seen["image"].tobytes() + seen["tokens"].tobytes())
    act = env.scripted_actions()[0]
    return past, tuple(act[: 4 if act[1] else 1].tolist())
