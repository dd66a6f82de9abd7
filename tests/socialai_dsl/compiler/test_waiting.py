"""Rules and what is remembered wait for an object, and that makes no difference to what happens."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.compiler import compile_probed, compile_scenario
from socialai_dsl.frontend import load
from socialai_dsl.program import Header, Program
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


SHORT = "{when: near.opened, set: {seen: seen + 1}}"
LONG = "{when: any(b in near | far where b.opened), set: {seen: seen + 1}}"
TIMELY = "{when: t == 3, set: {seen: seen + 1}}"


@pytest.mark.parametrize(
    ("rules", "waiting", "all_wait"),
    [
        pytest.param([SHORT], 1, True, id="nothing else"),
        pytest.param([SHORT, LONG], 1, True, id="all of them"),
        pytest.param([SHORT, TIMELY], 0, False, id="not what costs little beside others"),
        pytest.param([LONG, TIMELY, LONG], 2, False, id="run by run"),
    ],
)
def test_rules_are_not_looked_at_if_all_of_them_wait(
    tmp_path: Path, rules: list[str], waiting: int, all_wait: bool
) -> None:
    program = pair(tmp_path, f"rules: [{', '.join(rules)}]").env.program
    assert gates(program) == waiting
    assert (program.header(Header.RULES_DUE) != 0) is all_wait


LATE = "{when: t == 4, cause: [far.reveal]}"
"""A box that is opened at the end of a step, after which other statuses are computed."""


@pytest.mark.parametrize(
    ("noted", "waits", "changes"),
    [
        pytest.param("near.opened", True, 1, id="a status"),
        pytest.param("far.opened", True, 1, id="a status changed by a rule"),
        pytest.param(
            "gate.locked", True, 0, id="a status computed at the end of a step, before the next begins"
        ),
        pytest.param("count(b in near | far where b.opened)", True, 2, id="a number"),
        pytest.param("agent.facing", False, 1, id="not what the agent decides"),
        pytest.param("near.opened and t > 2", False, 1, id="not what time decides"),
    ],
)
def test_what_is_remembered_is_the_same_whether_it_waits_or_not(
    tmp_path: Path, noted: str, waits: bool, changes: int
) -> None:
    again = f"{{when: prev({noted}) != ({noted}), set: {{seen: seen + 1}}}}"
    gate = "gate: {type: door, at: [6, 3], locked: far.opened}"
    boxes = BOXES.replace("objects:", f"objects:\n  {gate}")
    path = Folder(tmp_path).write("tiny", f"{boxes}rules: [{LATE}, {again}]")
    both = Pair.of(load(str(path)), number_words=False)
    assert (both.env.program.header(Header.BEFORE_DUE) != 0) is waits
    both.reset(seed=0)
    for word in (None, "toggle", None, None, None, "left", None, None):
        both.step(tuple(map(int, both.env.encode_action((word, None)))))  # type: ignore[arg-type]
    assert both.env.describe()["state"]["seen"] == changes


def test_a_step_is_explained_whether_rules_wait_or_not(tmp_path: Path) -> None:
    env = pair(tmp_path, AGAIN).env
    env.reset(seed=0)
    for act in (None, None, "toggle", None, None):
        env.step(env.encode_action((act, None)))
        env.explain()  # which plays the step again, and fails if it went another way


@pytest.mark.parametrize("among_others", [False, True])
def test_a_program_that_says_why_rules_do_not_fire_asks_them_all(tmp_path: Path, among_others: bool) -> None:
    rules = [LONG, TIMELY] if among_others else [LONG]
    path = str(Folder(tmp_path).write("tiny", f"{BOXES}rules: [{', '.join(rules)}]"))
    checked = load(path).checked
    plain, probed = compile_scenario(checked), compile_probed(checked).program
    assert [n.path for n in plain.registers if n.path.startswith("world.due")] == ["world.due[0]"]
    due = next(n.register for n in plain.registers if n.path == "world.due[0]")
    read = [sum(due in row[2:] for row in program.code.tolist()) for program in (plain, probed)]
    assert read == ([1, 0] if among_others else [0, 0])
    assert [program.header(Header.RULES_DUE) for program in (plain, probed)] == [
        0 if among_others else due,
        0,
    ]
