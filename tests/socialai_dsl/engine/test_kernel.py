"""Results depend on nothing but keys and actions: not on batch size, order, or how resets come about."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from socialai_dsl.engine.batch import Batch, LinkedProgram
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.program import Body, Field, Header, Op, Program, Register
from tests.assembly import Assembly, FrameSpec, batch_of, constant, entity_register, temporary


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


@pytest.mark.parametrize("task", [Task.STEP_NEXT, Task.STEP_SAME])
def test_batch_size_changes_nothing(task: Task) -> None:
    program = lively()
    steps = actions(4096, 25)
    whole = record(batch_of(program, 4096), steps, task)
    seven = record(batch_of(program, 7), steps[:, :7], task)
    one = record(batch_of(program, 1), steps[:, :1], task)
    for name, expected in whole.items():
        np.testing.assert_array_equal(seven[name], expected[:, :7], err_msg=name)
        np.testing.assert_array_equal(one[name], expected[:, :1], err_msg=name)
    assert len(np.unique(whole["outcome"])) == 5, "every way to end occurred, and none"


def test_every_end_is_counted_once() -> None:
    batch = batch_of(lively(), 512)
    record(batch, actions(512, 25), Task.STEP_NEXT)
    totals = batch.counters.tolist()
    assert totals[-1] == sum(totals[1:-1]), "every episode ended in one way"
    assert min(totals) > 0


def test_next_step_mode_is_a_row_reset_by_hand_one_step_later() -> None:
    program = lively()
    steps = actions(40, 40)
    automatic = record(batch_of(program, 40), steps, Task.STEP_NEXT)
    batch = batch_of(program, 40)
    for t, step in enumerate(steps):
        over = batch.state.registers[:, Register.ENDED] != 0
        batch.ports.actions[:] = step
        batch.step(Task.STEP_ONLY)
        if over.any():
            batch.state.keys[over, Key.EPISODE] += np.uint64(1)
            batch.ports.chosen[:] = over
            batch.reset()
        np.testing.assert_array_equal(batch.state.image, automatic["image"][t])
        np.testing.assert_array_equal(batch.state.tokens, automatic["tokens"][t])
        np.testing.assert_array_equal(batch.ports.reward, automatic["reward"][t])
        np.testing.assert_array_equal(batch.ports.outcome, automatic["outcome"][t])
        assert not automatic["terminated"][t, over].any()
        assert not automatic["truncated"][t, over].any()


def test_same_step_mode_keeps_the_last_observation() -> None:
    program = lively()
    steps = actions(40, 40)
    same, single = batch_of(program, 40), batch_of(program, 40)
    finals = 0
    for step in steps:
        for batch, task in ((same, Task.STEP_SAME), (single, Task.STEP_ONLY)):
            batch.ports.actions[:] = step
            batch.step(task)
        ended = single.state.registers[:, Register.ENDED] != 0
        finals += ended.sum()
        np.testing.assert_array_equal(same.ports.final_image[ended], single.state.image[ended])
        np.testing.assert_array_equal(same.ports.final_tokens[ended], single.state.tokens[ended])
        np.testing.assert_array_equal(same.ports.outcome, single.ports.outcome)
        single.state.keys[ended, Key.EPISODE] += np.uint64(1)
        single.ports.chosen[:] = ended
        single.reset()
        np.testing.assert_array_equal(same.state.image, single.state.image)
        np.testing.assert_array_equal(same.state.tokens, single.state.tokens)
    assert finals > 100


def test_ended_rows_wait_where_resets_are_the_callers() -> None:
    batch = batch_of(lively(horizon=2), 20)
    record(batch, actions(20, 2), Task.STEP_ONLY)
    before = batch.state.registers.copy()
    record(batch, actions(20, 3), Task.STEP_ONLY)
    np.testing.assert_array_equal(batch.state.registers, before)
    assert not batch.ports.terminated.any()


def mixed(programs: list[Program], pools: list[list[int]], pool_of_row: list[int]) -> Batch:
    parts = [
        LinkedProgram(
            program,
            range(4 * i, 4 * i + 4),
            [*range(7), Body.NONE],
            range(2),
            [range(3)],
            [[0, 1], [0, 1]],
            range(22),
        )
        for i, program in enumerate(programs)
    ]
    length = max(program.header(Header.TOKENS) for program in programs)
    batch = Batch(parts, pools, pool_of_row, length)
    batch.state.keys[:, Key.SEED] = 7
    batch.state.keys[:, Key.INDEX] = np.arange(len(pool_of_row))
    batch.reset()
    return batch


def test_programs_side_by_side_play_as_they_do_alone() -> None:
    programs = [lively(6), Assembly(at=((2, 2),), tokens=16, horizon=4).program(), lively(9)]
    steps = actions(30, 30)
    together = record(mixed(programs, [[0], [1], [2]], [i % 3 for i in range(30)]), steps, Task.STEP_NEXT)
    for number, program in enumerate(programs):
        rows = np.arange(30) % 3 == number
        alone = record(batch_of(program, 30), steps, Task.STEP_NEXT)
        for name in ("image", "reward", "terminated", "truncated"):
            np.testing.assert_array_equal(
                together[name][:, rows], alone[name][:, rows], err_msg=f"{number} {name}"
            )
        length = alone["tokens"].shape[2]
        np.testing.assert_array_equal(together["tokens"][:, rows, :length], alone["tokens"][:, rows])
        outcome = alone["outcome"][:, rows]
        np.testing.assert_array_equal(
            together["outcome"][:, rows], np.where(outcome >= 0, outcome + 4 * number, -1)
        )


def test_a_pool_draws_its_program_anew_in_every_episode() -> None:
    programs = [lively(6), Assembly(at=((2, 2),), tokens=16, horizon=4).program(), lively(9)]
    batch = mixed(programs, [[0, 1, 2]], [0] * 300)
    first = batch.program_numbers()
    assert np.bincount(first).min() > 60
    alone = [batch_of(program, 300) for program in programs]
    for number in range(3):
        rows = first == number
        np.testing.assert_array_equal(batch.state.image[rows], alone[number].state.image[rows])
    batch.state.keys[:, Key.EPISODE] += np.uint64(1)
    batch.reset()
    assert (batch.program_numbers() != first).mean() == pytest.approx(2 / 3, abs=0.12)


def test_actions_of_a_larger_space_that_a_program_lacks() -> None:
    program = Assembly(at=((2, 2),), lines=(("x", (2,), 1),)).program()
    # The batch's order: an action the program lacks, forward, none; a template it lacks, its second.
    part = LinkedProgram(
        program,
        range(4),
        [Body.NONE, Body.FORWARD, Body.NONE],
        [-1, 1],
        [[0, -1, 2]],
        [[0, 1], [0, 1]],
        range(22),
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
