"""How an episode begins, drawn or from pins."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.program import Body, Field, Header, Op, Program, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import (
    LOCKED,
    Assembly,
    FrameSpec,
    batch_of,
    constant,
    entity_register,
    temporary,
)

SILENT = (7, 0, 0, 0)


def pinned(program: Program, pins: dict[int, int], batch: Batch | None = None) -> Batch:
    """A batch of one, reset with pinned registers."""
    batch = batch or batch_of(program)
    table = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
    for register, value in pins.items():
        table[1, register] = value
    batch.ports.layout[:] = 1
    batch.reset(table)
    batch.ports.layout[:] = 0
    return batch


def test_a_fresh_row() -> None:
    room = Assembly(at=((2, 2), (1, 1)), npcs=1)
    registers = batch_of(room.program()).state.registers[0]
    expected = {
        Register.T: 0,
        Register.WIDTH: 5,
        Register.HEIGHT: 5,
        Register.ROOM: 0,
        Register.ACTION: Body.NONE,
        Register.CLASS: 0,
        Register.TEMPLATE: -1,
        Register.NOUN: -1,
        Register.OUTCOME: -1,
        Register.HEARD: 0,
        Register.LOGGED: 0,
        Register.TOKENS: 0,
        Register.ENDED: 0,
        Register.POKED: -1,
        Register.SAID_LINE: 0,
    }
    assert {name: int(registers[name]) for name in expected} == expected
    assert registers[entity_register(1, Field.LAST)] == Body.NONE


def test_a_reset_forgets_everything() -> None:
    lines = (("x", (2, 3), 1),)
    frame = FrameSpec(
        1,
        ([(Op.BODY, constant(Body.RIGHT))], []),
        then=({-1: [(Op.SAY, constant(1), constant(0)), (Op.GOTO, 0, 1)]},),
    )
    batch = batch_of(Assembly(at=((2, 2), (1, 2)), npcs=1, frames=(frame,), lines=lines, horizon=3).program())
    before = [
        array.copy()
        for array in (batch.state.registers, batch.state.boards, batch.state.tokens, batch.state.image)
    ]
    for _ in range(3):
        batch.ports.actions[:] = (5, 1, 0, 1)
        batch.step(Task.STEP_ONLY)
    assert batch.state.registers[0, Register.ENDED]
    batch.reset()
    after = (batch.state.registers, batch.state.boards, batch.state.tokens, batch.state.image)
    for was, now in zip(before, after, strict=True):
        np.testing.assert_array_equal(was, now)


def test_only_chosen_rows_are_reset() -> None:
    batch = batch_of(Assembly().program(), 3)
    batch.ports.actions[:] = SILENT
    batch.step(Task.STEP_ONLY)
    batch.ports.chosen[:] = (False, True, False)
    batch.reset()
    assert batch.state.registers[:, Register.T].tolist() == [1, 0, 1]


def test_keys_name_episodes() -> None:
    reset = [(Op.DRAW, Assembly().own, constant(30000), 1)]
    batch = batch_of(Assembly(reset=reset).program(), 5)
    batch.state.keys[:, Key.SEED] = (1, 1, 2, draws.MAX_SEED, draws.TEST_DOMAIN)
    batch.state.keys[:, Key.INDEX] = (0, 5, 0, 1, 0)
    batch.state.keys[:, Key.EPISODE] = (0, 0, 3, 1, 499)
    batch.reset()
    expected = [
        draws.below(draws.draw(draws.episode_key(*key), draws.site("b"), 0, 3), 30000)
        for key in ((1, 0, 0), (1, 5, 0), (2, 0, 3), (draws.MAX_SEED, 1, 1), (draws.TEST_DOMAIN, 0, 499))
    ]
    assert batch.state.registers[:, Assembly().own].tolist() == expected


def test_pins_come_before_draws_and_after_them() -> None:
    own = Assembly(at=((2, 2), (1, 1)), npcs=1).own
    reset = [
        # A draw that a pin replaces, a value computed of it, and one that a pin overrides although code writes it.
        (Op.IF_UNPINNED, own, 0, 1),
        (Op.LOAD, own, constant(1)),
        (Op.ADD, own + 1, own, constant(10)),
        (Op.LOAD, own + 2, constant(5)),
        (Op.DRAW, own + 3, constant(30000), 0),
    ]
    program = Assembly(at=((2, 2), (1, 1)), npcs=1, reset=reset).program()
    drawn = batch_of(program).state.registers[0, own : own + 4].tolist()
    assert drawn[:3] == [1, 11, 5]
    batch = pinned(program, {own: 7, own + 2: 9, Register.T: 4})
    assert batch.state.registers[0, own : own + 3].tolist() == [7, 17, 9]
    assert batch.state.registers[0, own + 3] == drawn[3], "draws of the reset belong to step 0, whatever t is"
    assert batch.state.registers[0, Register.T] == 4
    batch.reset()
    assert batch.state.registers[0, own : own + 4].tolist() == drawn, "pins last one reset"


def test_pinned_cells_are_taken() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.B_FREE, 0),
        (Op.PICK_CELL, temporary(0), 0, 0),
        (Op.PUT, constant(0), temporary(0)),
    ]
    # A room of three cells of which two are pinned to be taken.
    room = Assembly(at=(None, None, None), npcs=2, size=(5, 3), canvas=(5, 3), reset=reset)
    for seed in range(20):
        batch = batch_of(room.program(), seed=seed)
        pins = {
            entity_register(1, Field.X): 1,
            entity_register(1, Field.Y): 1,
            entity_register(2, Field.X): 3,
        }
        pins[entity_register(2, Field.Y)] = 1
        pinned(room.program(), pins, batch)
        assert batch.state.registers[
            0, [entity_register(0, Field.X), entity_register(0, Field.Y)]
        ].tolist() == [2, 1]


def test_a_pinned_absence_and_a_pinned_status_are_drawn() -> None:
    room = Assembly(at=((1, 2), (0, 2), (2, 2)), objects=("door", "door"))
    pins = {
        entity_register(2, Field.X): -1,
        entity_register(2, Field.Y): -1,
        entity_register(2, Field.GONE): 1,
    }
    pins[entity_register(1, Field.STATUS)] = LOCKED
    batch = pinned(room.program(), pins)
    cells = batch.state.boards[0, :42].reshape(7, 6)
    assert (cells[2, 0] & 0xFF, cells[2, 0] >> 16 & 0xFF) == (4, LOCKED)
    assert cells[2, 2] == 1
    assert batch.state.boards[0, 42 + 1 + 2] & 0b100 == 0, "nothing solid where nothing is"


def test_a_pinned_log_is_heard_again() -> None:
    lines = (("x", (2, 3), 1), ("y", (4,), 1))
    frame = FrameSpec(1, ([],), then=({-1: [(Op.SAY, constant(1), Register.NOUN)]},))
    room = Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(frame,), lines=lines)
    batch = batch_of(room.program())
    for noun in (1, 0, 1):
        batch.ports.actions[:] = (7, 1, 0, noun)
        batch.step(Task.STEP_ONLY)
    log = room.program().header(Header.LOG)
    heard = {log: 1, log + 1: 0, log + 2: 1, Register.LOGGED: 3}
    again = pinned(room.program(), heard)
    np.testing.assert_array_equal(again.state.tokens, batch.state.tokens)
    assert again.state.keys[0, Key.DIGEST] == batch.state.keys[0, Key.DIGEST]
    assert again.state.registers[0, Register.TOKENS] == 4


@pytest.mark.parametrize("pinned_width", [None, 4])
def test_width_and_height_may_be_pinned(pinned_width: int | None) -> None:
    own = Assembly().own
    room = Assembly(reset=[(Op.LOAD, own, Register.WIDTH)])
    program = room.program()
    batch = batch_of(program) if pinned_width is None else pinned(program, {Register.WIDTH: pinned_width})
    # The assembly's own code makes a room of 5; a pin is written again over it.
    assert batch.state.registers[0, [own, Register.WIDTH]].tolist() == [5, pinned_width or 5]
