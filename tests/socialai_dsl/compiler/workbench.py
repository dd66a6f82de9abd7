"""A small resolved scenario for tests of the compiler, and ways to ask what a term is worth in it.

The room is 7 by 7. The agent stands at (2, 3) and looks right; guide, who plays a frame, at (4, 3) looks left; the idle
statue at (4, 5) looks up. A closed door lies in the wall at (6, 2), a box at (3, 3) between agent and guide, two idle
switches in the wall at (1, 0) and (2, 0).
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.frontend import load
from socialai_dsl.program import CELL, Program
from socialai_dsl.semantics.plans import Activity, CheckedScenario, Drawn, RulePlan, StatePlan
from socialai_dsl.semantics.terms import (
    BOOL,
    Const,
    FieldOf,
    Quantification,
    Read,
    SitedTerm,
    Term,
    Type,
    Variable,
)
from socialai_dsl.semantics.terms import CELL as ANY_CELL
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import ACTIONS

SOURCE = """
scenario: workbench
horizon: 20
earshot: room
actions: [left, right, forward, toggle]
grammar: {templates: [Go <noun>, Look <noun>], nouns: [up, down]}
room: {size: 7}
objects:
  door: {type: door, at: [6, 2], color: red}
  box: {type: ball, at: [3, 3], color: blue}
  switches: {type: switch, at: [[1, 0], [2, 0]], color: green}
let:
  die: pick(0 | 1 | 2 | 3)
  lucky: pick(box | door)
cast:
  guide: {at: [4, 3], facing: left, color: red, frame: idle}
  statue: {at: [4, 5], facing: up, color: red}
  agent: {at: [2, 3], facing: right, color: red}
frames:
  idle: {states: {waiting: {do: stay}}}
outcome:
  - success: agent.at(door)
"""

AGENT, GUIDE, STATUE, DOOR, BOX, SWITCH, OTHER_SWITCH = range(7)
SPAN = Span("workbench.yaml", 1, 1)
ENTITY = Type("entity", 0, 6)
NUMBER = Type("int", -100, 3000)
DIE = Read(Type("int", 0, 3), "let.die")


@cache
def workbench() -> CheckedScenario:
    """The resolved scenario."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "workbench.yaml"
        file.write_text(SOURCE, encoding="utf-8")
        return load(str(file)).checked


def entity(number: int) -> Const:
    """The term of an entity."""
    return Const(ENTITY, number)


def number(value: int) -> Const:
    """The term of a number."""
    return Const(NUMBER, value)


def cell(x: int, y: int) -> Const:
    """The term of a cell."""
    return Const(ANY_CELL, CELL + 32 * y + x)


def x_of(term: Term) -> FieldOf:
    """The term of a column."""
    return FieldOf(Type("int", -1, 31), term, "x")


def y_of(term: Term) -> FieldOf:
    """The term of a line."""
    return FieldOf(Type("int", -1, 31), term, "y")


HERE = Variable(ANY_CELL, "c")


def cells(op: Any, condition: Term | None, type_: Type = ANY_CELL, to: Term | None = None) -> Quantification:
    """A quantifier over cells, each of which is HERE."""
    return Quantification(type_, op, "c", (), condition, to, cells=True)


def sited(term: Term, site: str = "let.answer") -> SitedTerm:
    """A term with a place in the source."""
    return SitedTerm(term, site, SPAN)


def with_let(checked: CheckedScenario, path: str, term: Term, type_: Type | None = None) -> CheckedScenario:
    """The scenario with one more value that is computed at the end of the reset."""
    drawn = Drawn(path, type_ or term.type, sited(term, path))
    return replace(checked, setup=(*checked.setup, drawn))


def with_guide(checked: CheckedScenario, *states: StatePlan) -> CheckedScenario:
    """The scenario with other states in the guide's frame."""
    (frame,) = checked.frames
    return replace(checked, frames=(replace(frame, start=states[0].name, states=states),))


def state(name: str, activity: Activity, *then: RulePlan, first: tuple[RulePlan, ...] = ()) -> StatePlan:
    """A state of a frame."""
    return StatePlan(name, first, activity, then, SPAN)


def activity(name: Any, *args: Term) -> Activity:
    """An activity of the guide."""
    return Activity(name, args, "guide/activity", SPAN)


_latest: list[tuple[CheckedScenario, Program]] = []


def compiled(checked: CheckedScenario) -> Program:
    """The proven program; that of the latest scenario is kept, since tests play one with many seeds."""
    if not _latest or _latest[0][0] is not checked:
        _latest[:] = [(checked, compile_scenario(checked))]
    return _latest[0][1]


def start(checked: CheckedScenario, layout: Mapping[str, Any] | None = None, seed: int = 0) -> ScenarioEnv:
    """An environment at the start of an episode."""
    env = ScenarioEnv(compiled(checked))
    env.reset(seed=seed, options={"layout": dict(layout or {})})
    return env


def step(env: ScenarioEnv, word: str = "none", pair: int | None = None) -> dict[str, Any]:
    """One step with a body action and, if given, the utterance of a pair; the info."""
    actions = [ACTIONS.index(action) for action in env.program.actions]
    body = len(actions) if word == "none" else env.program.actions.index(word)
    template, noun = divmod(pair or 0, len(env.program.nouns))
    action = np.array([body, int(pair is not None), template, noun])
    return env.step(action)[4]


def worth(term: Term, layout: Mapping[str, Any] | None = None, checked: CheckedScenario | None = None) -> Any:
    """What a term is worth at the end of a reset; of what is no truth, number or word its register."""
    (answer,) = worths(term, range(1), layout, checked)
    return answer


def worths(
    term: Term,
    seeds: range,
    layout: Mapping[str, Any] | None = None,
    checked: CheckedScenario | None = None,
) -> list[Any]:
    """What a term is worth at the end of the reset of each seed."""
    type_ = BOOL if term.type.kind == "bool" else NUMBER
    env = ScenarioEnv(compiled(with_let(checked or workbench(), "let.answer", term, type_)))
    answers = []
    for seed in seeds:
        env.reset(seed=seed, options={"layout": dict(layout or {})})
        answers.append(env.describe()["let"]["answer"])
    return answers


def code(program: Program, label: str) -> list[str]:
    """The names of the instructions that start at a label."""
    return [line.split()[1] for line in listed(program, label)]


def listed(program: Program, label: str) -> list[str]:
    """The lines of the listing under a label."""
    lines = program.listing().splitlines()
    start = lines.index(f"{label}:") + 1
    return lines[start : lines.index("", start)]
