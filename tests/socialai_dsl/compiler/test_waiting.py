"""Rules of the world that wait for an object fire when they would if they were asked in every step."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.compiler import compile_probed, compile_scenario
from socialai_dsl.frontend import load
from socialai_dsl.program import Program
from tests.agreement import Pair
from tests.tiny import Folder

BOXES = """
objects:
  near: {type: box, at: [3, 1]}
  far: {type: box, at: [3, 5]}
  lamp: {type: switch, at: [5, 5]}
state: {seen: {start: 0, range: 0..9}}
cast: {agent: {at: [2, 1], facing: right}}
"""
AT_ONCE = "rules: [{when: any(b in near | far where b.opened), cause: [lamp.vanish]}]"
AGAIN = "rules: [{when: any(b in near | far where b.opened), set: {seen: seen + 1}}]"
BY_ANOTHER = """
rules:
  - {when: t == 2, cause: [near.reveal, far.reveal]}
  - {when: any(b in near | far where b.opened), set: {seen: seen + 1}}
"""
ONCE = "rules: [{when: any(b in near | far where b.opened), once: true, set: {seen: seen + 1}}]"
NEW_GROUND = """
rules:
  - when: not lamp.gone
    cause: [lamp.put(first(b in near | far where b.opened))]
    set: {seen: seen + 1}
"""
BY_TIME = "rules: [{when: any(b in near | far where b.opened) and t > 3, set: {seen: seen + 1}}]"
BY_CHANCE = "rules: [{when: any(b in near | far where b.opened), chance: 0.4, set: {seen: seen + 1}}]"


def pair(folder: Path, rules: str) -> Pair:
    """The scenario on both sides."""
    return Pair.of(load(str(Folder(folder).write("tiny", BOXES + rules))), number_words=False)


def gates(program: Program) -> int:
    """How many runs of rules wait."""
    return sum(name.path.startswith("world.due[") for name in program.registers)


@pytest.mark.parametrize(
    ("rules", "waiting", "seen"),
    [
        pytest.param(AT_ONCE, 1, 0, id="in the step of the change"),
        pytest.param(AGAIN, 1, 5, id="again while they fire"),
        pytest.param(BY_ANOTHER, 1, 5, id="after another rule of the same step"),
        pytest.param(ONCE, 1, 1, id="once"),
        pytest.param(NEW_GROUND, 1, 5, id="when a value is found"),
        pytest.param(BY_TIME, 0, 3, id="not what time decides"),
        pytest.param(BY_CHANCE, 0, None, id="not what chance decides"),
    ],
)
def test_rules_that_wait_fire_as_if_they_did_not(
    tmp_path: Path, rules: str, waiting: int, seen: int | None
) -> None:
    both = pair(tmp_path, rules)
    assert gates(both.env.program) == waiting
    both.reset(seed=0)
    toggle = tuple(map(int, both.env.encode_action(("toggle", None))))
    still = tuple(map(int, both.env.encode_action((None, None))))
    both.step(still)  # type: ignore[arg-type]
    for action in (toggle, still, still, still, still):
        both.step(action)  # type: ignore[arg-type]
    if seen is not None:
        assert both.env.describe()["state"]["seen"] == seen


def test_what_costs_little_to_ask_does_not_wait(tmp_path: Path) -> None:
    assert gates(pair(tmp_path, "rules: [{when: near.opened, set: {seen: seen + 1}}]").env.program) == 0


def test_a_step_is_explained_whether_rules_wait_or_not(tmp_path: Path) -> None:
    env = pair(tmp_path, AGAIN).env
    env.reset(seed=0)
    for act in (None, None, "toggle", None, None):
        env.step(env.encode_action((act, None)))
        env.explain()  # which plays the step again, and fails if it went another way


def test_a_program_that_says_why_rules_do_not_fire_asks_them_all(tmp_path: Path) -> None:
    path = str(Folder(tmp_path).write("tiny", BOXES + AGAIN))
    checked = load(path).checked
    plain, probed = compile_scenario(checked), compile_probed(checked).program
    assert [n.path for n in plain.registers if n.path.startswith("world.due")] == ["world.due[0]"]
    due = next(n.register for n in plain.registers if n.path == "world.due[0]")
    read = [sum(due in row[2:] for row in program.code.tolist()) for program in (plain, probed)]
    assert read == [1, 0]
