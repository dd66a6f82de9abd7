"""Draws of a reset by the keys of its episode, and pins before and after them."""

from __future__ import annotations

import numpy as np

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.state import Key
from socialai_dsl.program import Field, Op, Program, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import (
    Assembly,
    batch_of,
    constant,
    entity_register,
    temporary,
)


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
