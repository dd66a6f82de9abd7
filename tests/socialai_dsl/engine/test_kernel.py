"""What a batch does that no environment shows: rows that wait, actions that a program lacks, the size of its state."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Op, Program, Register
from tests.assembly import Assembly, FrameSpec, batch_of, constant, entity_register, part_of, temporary


def lively(horizon: int = 6) -> Program:
    """Two wandering NPCs that answer, a door, a deadly cell, everything placed by draws, several ways to end."""
    sites = tuple((1000 + i, i) for i in range(12))
    put: list[tuple[int, ...]] = []
    for entity in range(5):
        put += [
            (Op.IF_UNPINNED, entity_register(entity, Field.X), 0, 4),
            (Op.B_FLOOR, 0),
            (Op.B_FREE, 0),
            (Op.PICK_CELL, temporary(0), 0, entity),
            (Op.PUT, constant(entity), temporary(0)),
            (Op.DRAW, entity_register(entity, Field.COLOR), constant(6), 5),
            (Op.DRAW, entity_register(entity, Field.DIR), constant(4), 6),
        ]
    wander = [
        (Op.DRAW, temporary(1), constant(4), 7),
        (Op.IF_EQ, temporary(1), constant(3), 2),
        (Op.BODY, constant(7)),
        (Op.SKIP, 0, 0, 1),
        (Op.BODY, temporary(1)),
    ]
    answer = [(Op.DRAW, temporary(1), constant(3), 8), (Op.SAY, constant(1), temporary(1))]
    frames = (
        FrameSpec(
            1,
            (wander, [(Op.GO_NEXT_TO, constant(1), constant(0), 9)]),
            then=({2: [*answer, (Op.GOTO, 0, 1)]}, {-1: [(Op.COUNT, 0)]}),
        ),
        FrameSpec(
            2,
            ([(Op.GO_TO, constant(2), constant(3), 10)],),
            then=(
                {
                    -1: [
                        (Op.IF_CHANCE, 20000, 11, 2),
                        (Op.LOAD, temporary(1), constant(2)),
                        (Op.SAY, constant(2), temporary(1)),
                    ]
                },
            ),
        ),
    )
    lines = (("one", (2,), 1), ("two", (3, 4), 3), ("three", (5, 6, 7), 2))
    return Assembly(
        at=(None,) * 5,
        npcs=2,
        objects=("door", "lava"),
        deadly=True,
        reset=put,
        frames=frames,
        lines=lines,
        sites=sites,
        horizon=horizon,
        earshot=(0, 3),
        size=(6, 6),
        canvas=(7, 7),
        outcomes={
            (-1, Body.DONE): [
                (Op.IF_NEXT_TO, constant(0), constant(1), 2),
                (Op.END, 0, 100),
                (Op.SKIP, 0, 0, 1),
                (Op.END, 1, 0),
            ]
        },
    ).program()


def actions(rows: int, steps: int) -> NDArray[np.int64]:
    """Actions by index of the environment, so that they do not depend on the size of the batch."""
    found = np.stack(
        [np.random.default_rng(row).integers(0, (8, 2, 2, 3), (steps, 4)) for row in range(rows)], axis=1
    )
    return found.astype(np.int64)


def record(batch: Batch, played: NDArray[np.int64], task: Task) -> dict[str, NDArray[Any]]:
    """Everything that is shown, step by step."""
    shown: dict[str, list[NDArray[Any]]] = {}
    for step in played:
        batch.ports.actions[:] = step
        batch.step(task)
        seen = {name: getattr(batch.ports, name) for name in ("reward", "terminated", "truncated", "outcome")}
        seen |= {name: getattr(batch.state, name) for name in ("image", "tokens", "registers")}
        for name, array in seen.items():
            shown.setdefault(name, []).append(array.copy())
    return {name: np.stack(arrays) for name, arrays in shown.items()}


def test_ended_rows_wait_where_resets_are_the_callers() -> None:
    batch = batch_of(lively(horizon=2), 20)
    record(batch, actions(20, 2), Task.STEP_ONLY)
    before = batch.state.registers.copy()
    record(batch, actions(20, 3), Task.STEP_ONLY)
    np.testing.assert_array_equal(batch.state.registers, before)
    assert not batch.ports.terminated.any()


def test_actions_of_a_larger_space_that_a_program_lacks() -> None:
    program = Assembly(at=((2, 2),), lines=(("x", (2,), 1),)).program()
    # The batch's order: an action the program lacks, forward, none; a template it lacks, its second.
    part = replace(
        part_of(program),
        actions=[Body.NONE, Body.FORWARD, Body.NONE],
        templates=[-1, 1],
        slots=[[0, -1, 2]],
    )
    batch = Batch([part], [[0]], [0], 8)
    batch.reset()
    seen = []
    for action in ((0, 0, 0, 0), (1, 0, 0, 0), (2, 1, 0, 0), (2, 1, 1, 1), (2, 1, 1, 2)):
        batch.ports.actions[:] = action
        assert batch.step(Task.STEP_ONLY) == 0
        registers = batch.state.registers[0]
        seen.append(
            [
                int(registers[entity_register(0, Field.X)]),
                *registers[[Register.TEMPLATE, Register.NOUN, Register.CLASS]].tolist(),
            ]
        )
    assert seen == [[2, -1, -1, 0], [3, -1, -1, 0], [3, -1, -1, 0], [3, -1, -1, 0], [3, 1, 2, 4]]
    batch.ports.actions[:] = (3, 0, 0, 0)
    assert batch.step(Task.STEP_ONLY) == -1, "the batch's space counts, not the program's"


def test_state_is_small() -> None:
    state = batch_of(lively(), 2).state
    assert sum(array[0].nbytes for array in (state.registers, state.boards, state.keys)) < 1024
