"""What members take for true, and what is earned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from socialai_dsl.program import FrameColumn, Header, Op
from socialai_dsl.semantics.plans import BeliefPlan, CheckedScenario, Drawn, OutcomePlan
from socialai_dsl.semantics.terms import (
    CELL,
    DIRECTION,
    CellBeside,
    CellOf,
    Compare,
    Const,
    Quantification,
    Type,
    World,
)
from tests.socialai_dsl.compiler.workbench import (
    BOX,
    DOOR,
    cell,
    code,
    compiled,
    entity,
    number,
    sited,
    start,
    step,
    workbench,
    worth,
    x_of,
    y_of,
)

NOW = World(Type("int", 0, 20), "t")
COLUMN = Type("int", -1, 6)


# --- beliefs ---


def believing(when: Any, value: Any, type_: Type = COLUMN) -> CheckedScenario:
    checked = workbench()
    drawn = Drawn("guide.believes.it", type_, sited(value, "guide.believes.it"))
    belief = BeliefPlan("guide", "guide.believes.it", sited(value), None if when is None else sited(when))
    return replace(checked, setup=(*checked.setup, drawn), beliefs=(belief,))


def belief(env: Any) -> Any:
    return env.describe()["guide"]["believes"]["it"]


def test_a_belief_that_finds_nothing_stays() -> None:
    things = Type("entity", DOOR, BOX)
    late = Compare("<", number(1), NOW)
    which = Quantification(things, "first", "v", (Const(things, DOOR), Const(things, BOX)), late)
    checked = believing(None, which, things)
    start_value = Drawn("guide.believes.it", things, sited(Const(things, BOX), "guide.believes.it"))
    env = start(replace(checked, setup=(*checked.setup[:-1], start_value)))
    step(env)
    assert belief(env) == "box"
    step(env)
    assert belief(env) == "door"


def test_only_who_believes_perceives() -> None:
    def perceive(checked: CheckedScenario) -> int:
        program = compiled(checked)
        return int(program.words[program.header(Header.FRAME_AT) + FrameColumn.PERCEIVE])

    assert perceive(workbench()) == 0
    assert perceive(believing(None, number(1))) > 0
    assert "LOAD" in code(compiled(believing(None, number(1))), "guide.believes")


# --- cells beside ---


@pytest.mark.parametrize(("way", "x", "y"), [(0, 4, 3), (1, 3, 4), (2, 2, 3), (3, 3, 2)])
def test_the_cell_beside_a_thing(way: int, x: int, y: int) -> None:
    beside = CellBeside(CELL, entity(BOX), Const(DIRECTION, way))
    assert (worth(x_of(beside)), worth(y_of(beside))) == (x, y)


def test_the_cell_beside_a_cell() -> None:
    beside = CellBeside(CELL, CellBeside(CELL, cell(2, 2), Const(DIRECTION, 0)), Const(DIRECTION, 1))
    assert worth(Compare("==", beside, cell(3, 3)))


def test_beside_the_edge_there_is_no_cell() -> None:
    beside = CellBeside(CELL, cell(6, 2), Const(DIRECTION, 0))
    assert worth(Compare("==", beside, CellOf(CELL, entity(BOX)))) is False
    assert worth(beside) == CELL.low - 1


# --- rewards ---


def earned(checked: CheckedScenario, steps: int = 1) -> list[float]:
    env = start(checked)
    return [float(env.step(_still(env))[1]) for _ in range(steps)]


def _still(env: Any) -> Any:
    return np.array([len(env.program.actions), 0, 0, 0])


def ending(graded: Any, success: bool = True) -> CheckedScenario:
    over = sited(Compare("<=", number(2), NOW))
    plan = OutcomePlan("end", success, 100, over, None if graded is None else sited(graded))
    return replace(workbench(), outcomes=(plan,), slope=0)


def test_a_graded_failure_earns_nothing() -> None:
    assert earned(ending(number(50), success=False), 2) == [0.0, 0.0]
    assert Op.END_GRADED not in {row[0] for row in compiled(ending(number(50), success=False)).code.tolist()}


@pytest.mark.parametrize("channels", [4, 6])
def test_channels(channels: int) -> None:
    assert compiled(replace(workbench(), channels=channels)).header(Header.CHANNELS) == channels
