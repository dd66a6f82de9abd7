"""A room is drawn again, with keys of its own, until it is as required; what never is ends in an error, not a hang."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import RoomError, Task
from socialai_dsl.engine.state import ATTEMPTS, Key
from socialai_dsl.program import Body, Field, Op, Program, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import Assembly, FrameSpec, batch_of, constant, entity_register, part_of, temporary

OWN = Assembly(at=(None,)).own
SITE = draws.site("a")


def drawn(below: int, least: int, **room: object) -> Program:
    """A register is drawn below a number, the agent is put somewhere; required is that the register is large enough."""
    reset = [
        (Op.IF_UNPINNED, OWN, 0, 1),
        (Op.DRAW, OWN, constant(below), 0),
        (Op.B_FLOOR, 0),
        (Op.B_FREE, 0),
        (Op.PICK_CELL, temporary(0), 0, 1),
        (Op.PUT, constant(0), temporary(0)),
    ]
    require = [(Op.IF_LE, constant(least), OWN, 1), (Op.LOAD, Register.ACCEPTED, constant(1))]
    return Assembly(at=(None,), reset=reset, require=require, **room).program()  # type: ignore[arg-type]


def expected(index: int, below: int, least: int, episode: int = 0, site: int = SITE) -> tuple[int, int]:
    """How many rooms were not as required, and the number drawn in the one that was."""
    key = draws.episode_key(7, index, episode)
    for attempt in range(ATTEMPTS):
        number = draws.below(draws.draw(draws.attempt_key(key, attempt), site, 0, 0), below)
        if number >= least:
            return attempt, number
    raise AssertionError("no such room")


def test_rooms_are_drawn_with_keys_of_their_own_until_one_fits() -> None:
    batch = batch_of(drawn(1000, 750), 300)
    found = [tuple(row) for row in batch.state.registers[:, [Register.ATTEMPT, OWN]].tolist()]
    assert found == [expected(i, 1000, 750) for i in range(300)]
    assert max(attempt for attempt, _ in found) > 5
    assert (batch.state.registers[:, Register.ACCEPTED] == 1).all()
    assert batch.state.keys[:, Key.KEY].tolist() == [draws.episode_key(7, i, 0) for i in range(300)]


def test_the_first_attempt_draws_what_is_drawn_without_a_requirement() -> None:
    required = batch_of(drawn(1000, 0), 50)
    program = Assembly(
        at=(None,),
        reset=[
            (Op.DRAW, OWN, constant(1000), 0),
            (Op.B_FLOOR, 0),
            (Op.B_FREE, 0),
            (Op.PICK_CELL, temporary(0), 0, 1),
            (Op.PUT, constant(0), temporary(0)),
        ],
    ).program()
    free = batch_of(program, 50)
    registers = free.state.registers.copy()
    registers[:, Register.ACCEPTED] = 1
    np.testing.assert_array_equal(required.state.registers, registers)
    np.testing.assert_array_equal(required.state.image, free.state.image)


def test_draws_of_steps_do_not_depend_on_attempts() -> None:
    program = drawn(1000, 750, rules=[(Op.DRAW, OWN + 1, constant(30000), 0)])
    batch = batch_of(program, 40)
    batch.ports.actions[:] = (7, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    wanted = [draws.below(draws.draw(draws.episode_key(7, i, 0), SITE, 1, 0), 30000) for i in range(40)]
    assert batch.state.registers[:, OWN + 1].tolist() == wanted


def test_everything_of_a_refused_room_is_forgotten() -> None:
    """The board, the sets of taken cells and the registers are those of the last room alone."""
    batch = batch_of(drawn(1000, 750, lines=(("x", (2,), 1),)), 100)
    cells = batch.state.registers[:, [entity_register(0, Field.X), entity_register(0, Field.Y)]]
    for row in range(100):
        key = draws.attempt_key(
            draws.episode_key(7, row, 0), int(batch.state.registers[row, Register.ATTEMPT])
        )
        place = draws.below(draws.draw(key, draws.site("b"), 0, 3), 9)
        assert cells[row].tolist() == [1 + place % 3, 1 + place // 3]


def test_what_settles_at_reset_is_settled_before_the_question() -> None:
    room = Assembly(
        at=((1, 1), (2, 2)),
        objects=("door",),
        settle=[(Op.BECOME, constant(1), constant(0))],
        require=[
            (Op.IF_EQ, entity_register(1, Field.STATUS), constant(0), 1),
            (Op.LOAD, Register.ACCEPTED, constant(1)),
        ],
    )
    assert batch_of(room.program()).state.registers[0, Register.ATTEMPT] == 0


def refused(index: int, below: int, least: int) -> int:
    """How many of the rooms of an episode come before the first that fits, at most `ATTEMPTS`."""
    try:
        return expected(index, below, least)[0]
    except AssertionError:
        return ATTEMPTS


def test_the_last_attempt_counts() -> None:
    index = next(i for i in range(20000) if refused(i, 60, 59) == ATTEMPTS - 1)
    batch = Batch([part_of(drawn(60, 59))], [[0]], [0], 8)
    batch.state.keys[:, Key.SEED], batch.state.keys[:, Key.INDEX] = 7, index
    batch.reset()
    assert batch.state.registers[0, [Register.ATTEMPT, OWN]].tolist() == [ATTEMPTS - 1, 59]


NEVER = drawn(1000, 1000, horizon=2)


def test_a_room_that_never_fits_is_reported_and_left_sound() -> None:
    rows = 200
    batch = Batch(
        [part_of(replace(NEVER, name="picky")), part_of(drawn(9, 0))], [[0], [1]], [1] * 130 + [0] * 70, 8
    )
    batch.state.keys[:, Key.SEED] = 7
    batch.state.keys[:, Key.INDEX] = np.arange(rows)
    with pytest.raises(
        RuntimeError, match=r"picky: none of 64 rooms .* row 130 \(seed 7, index 130, episode 0\)"
    ):
        batch.reset()
    registers = batch.state.registers
    assert registers[:, Register.ATTEMPT].tolist() == [0] * 130 + [ATTEMPTS] * 70
    assert (registers[:, Register.ENDED] == 0).all()
    assert (registers[:, entity_register(0, Field.X)] >= 1).all(), "the last room is complete"
    assert batch.state.keys[:, Key.KEY].tolist() == [draws.episode_key(7, i, 0) for i in range(rows)]
    assert not batch.ports.refused.any()


@pytest.mark.parametrize("task", [Task.STEP_NEXT, Task.STEP_SAME])
def test_a_reset_within_a_step_reports_it_too(task: Task) -> None:
    parts = [part_of(NEVER), part_of(drawn(9, 0, horizon=9))]
    batch = Batch(parts, [[0], [1]], [1, 0], 8)
    batch.state.keys[:, Key.INDEX] = np.arange(2)
    with pytest.raises(RuntimeError, match="assembled: none of"):
        batch.reset()
    batch.ports.actions[:] = (7, 0, 0, 0)
    assert batch.step(task) == 0
    if task == Task.STEP_NEXT:
        assert batch.step(task) == 1
    with pytest.raises(RuntimeError, match=r"row 1 .*episode 1"):
        batch.step(task)
    assert batch.state.registers[:, Register.T].tolist() == [3 if task == Task.STEP_NEXT else 2, 0]
    assert batch.ports.truncated.tolist() == [False, task == Task.STEP_SAME]
    assert batch.step(task) == 0, "play goes on"


def test_pins_hold_in_every_attempt() -> None:
    program = drawn(1000, 750)
    batch = batch_of(program)
    for value, accepted in ((800, True), (10, False)):
        pins = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
        pins[1, OWN] = value
        batch.ports.layout[:] = 1
        if accepted:
            batch.reset(pins)
        else:
            with pytest.raises(RuntimeError, match="assembled"):
                batch.reset(pins)
        assert batch.state.registers[0, OWN] == value


def test_a_pool_keeps_its_member() -> None:
    """The rooms are drawn again, the program is not."""
    frame = FrameSpec(0, ([],))
    programs = [drawn(1000, 900), drawn(1000, 0, frames=(frame,)), drawn(1000, 100)]
    batch = Batch([part_of(program) for program in programs], [[0, 1, 2]], [0] * 200, 8)
    batch.state.keys[:, Key.SEED] = 7
    batch.state.keys[:, Key.INDEX] = np.arange(200)
    batch.reset()
    members = [
        draws.below(draws.draw(draws.episode_key(7, i, 0), draws.site("member"), 0, 0), 3) for i in range(200)
    ]
    assert batch.program_numbers().tolist() == members
    assert batch.state.registers[:, OWN].tolist() == [
        expected(i, 1000, (900, 0, 100)[member])[1] for i, member in enumerate(members)
    ]


def test_a_moment_of_an_episode_is_not_asked_for_its_room() -> None:
    """A layout with a time later than 0 is taken as it is: its room was accepted when the episode began."""
    batch = batch_of(drawn(1000, 750))
    pins = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
    pins[1, OWN] = 10
    batch.ports.layout[:] = 1
    pins[1, Register.T] = 3
    batch.reset(pins)
    assert batch.state.registers[0, [OWN, Register.T, Register.ATTEMPT]].tolist() == [10, 3, 0]
    pins[1, Register.T] = 0
    with pytest.raises(RuntimeError, match="assembled"):
        batch.reset(pins)


def test_prepared_calls_outlive_layouts_also_those_that_are_refused() -> None:
    """A single environment keeps the call of its step; a new table of pins takes nothing away from it."""
    batch = batch_of(drawn(10, 3), 1)
    step = batch.stepper(Task.STEP_ONLY)
    for number, fits in ((9, True), (1, False), (8, True), (0, False)):
        pins = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
        pins[1, OWN] = number
        batch.ports.layout[:] = 1
        batch.ports.chosen[:] = True
        if fits:
            batch.reset(pins)
        else:
            with pytest.raises(RoomError):
                batch.reset(pins)
        del pins
        assert batch.state.registers[0, OWN] == number
        batch.ports.actions[:] = (int(Body.NONE), 0, 0, 0)
        assert step() == 0
        assert batch.state.registers[0, Register.T] == 1
    batch.ports.layout[:] = 0
    batch.reset()
    assert batch.state.registers[0, OWN] >= 3
    assert step() == 0
