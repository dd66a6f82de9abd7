"""What is pushed, what rolls and where it stops, what is put somewhere, and what lies in one cell with something."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.program import Body, Field, Flag, Op, Register
from tests.assembly import (
    CLOSED,
    GENERATOR,
    IDLE,
    MARBLE,
    OPEN,
    PLATFORM,
    PRESSED,
    ROLLING,
    STILL,
    Assembly,
    FrameSpec,
    Instruction,
    batch_of,
    constant,
    entity_register,
    step,
)

ROLLS = int(Flag.ROLLS)
FORWARD = (int(Body.FORWARD), 0, 0, 0)


def entity(batch: Batch, number: int, *fields: Field) -> list[int]:
    return [int(batch.state.registers[0, entity_register(number, name)]) for name in fields]


def code_at(batch: Batch, x: int, y: int, width: int = 9) -> int:
    return int(batch.state.boards[0, y * width + x] & 0xFF)


def corridor(at: tuple[tuple[int, int], ...], objects: tuple[str, ...], **more: object) -> Batch:
    """A room of 9 by 5 in which the agent looks to the right, everybody else where `at` says."""
    room = {"size": (9, 5), "canvas": (9, 5), "flags": ROLLS, **more}
    return batch_of(Assembly(at=at, objects=objects, **room).program())  # type: ignore[arg-type]


def test_a_push_changes_status_and_direction_and_the_mover_stays() -> None:
    batch = corridor(((2, 2), (3, 2)), ("generator",), facing=(0, 3))
    step(batch, FORWARD)
    assert entity(batch, 0, Field.X) == [2]
    assert entity(batch, 1, Field.X, Field.STATUS, Field.DIR) == [3, PRESSED, 0]
    assert batch.state.boards[0, 2 * 9 + 3] >> 16 & 0xFF == PRESSED


def test_what_reacts_to_nothing_is_neither_pushed_nor_toggled() -> None:
    blocked: list[Instruction] = [
        (Op.SET_FIELD, constant(1), Field.POKED, constant(1)),
        (Op.SET_FIELD, constant(2), Field.POKED, constant(1)),
    ]
    batch = corridor(((2, 2), (3, 2), (2, 1)), ("generator", "door"), reset=blocked)
    step(batch, FORWARD)
    assert entity(batch, 1, Field.STATUS) == [IDLE]
    step(batch, (int(Body.LEFT), 0, 0, 0))
    step(batch, (int(Body.TOGGLE), 0, 0, 0))
    assert entity(batch, 2, Field.STATUS) == [CLOSED]
    assert batch.state.registers[0, Register.POKED] == 2, "it was used all the same"


def test_walls_locked_things_and_npcs_are_not_pushed() -> None:
    batch = corridor(((7, 2),), ())
    step(batch, FORWARD)
    assert entity(batch, 0, Field.X) == [7]
    batch = corridor(((2, 2), (3, 2), (3, 2)), ("generator",), npcs=1)
    step(batch, FORWARD)
    assert entity(batch, 2, Field.STATUS) == [PRESSED], "the NPC stands behind what is pushed"


def test_an_npc_pushes_too() -> None:
    frame = FrameSpec(1, ([(Op.BODY, constant(Body.FORWARD))],))
    batch = corridor(((1, 1), (2, 2), (3, 2)), ("generator",), npcs=1, frames=(frame,), flags=0)
    step(batch)
    assert entity(batch, 1, Field.X, Field.LAST) == [2, Body.FORWARD]
    assert entity(batch, 2, Field.STATUS, Field.DIR) == [PRESSED, 0]


def test_a_marble_rolls_in_the_step_of_the_push_until_a_wall() -> None:
    batch = corridor(((2, 2), (3, 2)), ("marble",))
    seen = []
    for action in (FORWARD, *[(7, 0, 0, 0)] * 4):
        step(batch, action)
        seen.append(entity(batch, 1, Field.X, Field.STATUS))
    assert seen == [[4, ROLLING], [5, ROLLING], [6, ROLLING], [7, ROLLING], [7, STILL]]
    cells = batch.state.boards[0, :45].reshape(5, 9) & 0xFF
    assert np.argwhere(cells == MARBLE).tolist() == [[2, 7]]
    assert batch.state.registers[0, Register.CHANGED] == 0, "settled"


def test_what_an_npc_pushes_rolls_from_the_next_step_on() -> None:
    frame = FrameSpec(1, ([(Op.BODY, constant(Body.FORWARD))],))
    batch = corridor(((1, 1), (2, 2), (3, 2)), ("marble",), npcs=1, frames=(frame,))
    step(batch)
    assert entity(batch, 2, Field.X, Field.STATUS) == [3, ROLLING]
    step(batch)
    assert entity(batch, 2, Field.X) == [4]
    assert entity(batch, 1, Field.X) == [3], "it walks after it"


@pytest.mark.parametrize(
    ("things", "at", "more", "stops"),
    [
        (("marble", "door"), (5, 2), {}, 4),
        (("marble", "platform"), (5, 2), {}, 7),
        (("marble", "lava"), (5, 2), {"deadly": True}, 4),
        (("marble", "lava"), (5, 2), {}, 7),
    ],
)
def test_where_a_marble_stops(
    things: tuple[str, ...], at: tuple[int, int], more: dict[str, object], stops: int
) -> None:
    batch = corridor(((2, 2), (3, 2), at), things, **more)
    step(batch, FORWARD)
    for _ in range(6):
        step(batch)
    assert entity(batch, 1, Field.X, Field.STATUS) == [stops, STILL]


@pytest.mark.parametrize("flags", [ROLLS, ROLLS | int(Flag.NPCS_HIDDEN)])
def test_a_marble_stops_at_bodies(flags: int) -> None:
    batch = corridor(((2, 2), (5, 2), (3, 2)), ("marble",), npcs=1, flags=flags)
    step(batch, FORWARD)
    step(batch)
    assert entity(batch, 2, Field.X, Field.STATUS) == [4, STILL]


def test_what_rolls_pushes_what_only_it_may_push() -> None:
    batch = corridor(((2, 2), (3, 2), (5, 2)), ("marble", "generator"), pushed_by_rolling=(2,))
    step(batch, FORWARD)
    step(batch)
    assert entity(batch, 1, Field.X, Field.STATUS) == [4, STILL]
    assert entity(batch, 2, Field.STATUS) == [PRESSED]
    batch = corridor(((2, 2), (3, 2)), ("generator",), pushed_by_rolling=(1,))
    step(batch, FORWARD)
    assert entity(batch, 1, Field.STATUS) == [IDLE], "a body may not"


def test_marbles_pass_the_push_on_in_object_order() -> None:
    batch = corridor(((2, 2), (3, 2), (4, 2)), ("marble", "marble"))
    step(batch, FORWARD)
    assert [entity(batch, n, Field.X, Field.STATUS) for n in (1, 2)] == [[3, STILL], [5, ROLLING]]
    # The other way round the one that is pushed has had its turn already.
    batch = corridor(((2, 2), (4, 2), (3, 2)), ("marble", "marble"))
    step(batch, FORWARD)
    assert [entity(batch, n, Field.X, Field.STATUS) for n in (1, 2)] == [[4, ROLLING], [3, STILL]]
    step(batch)
    assert entity(batch, 1, Field.X) == [5]


def test_a_marble_that_is_gone_does_not_roll() -> None:
    rolling: list[Instruction] = [
        (Op.LOAD, entity_register(1, Field.STATUS), constant(ROLLING)),
        (Op.VANISH, constant(1)),
    ]
    batch = corridor(((2, 2), (3, 2)), ("marble",), reset=rolling)
    step(batch)
    assert entity(batch, 1, Field.X, Field.STATUS) == [3, ROLLING]


def test_the_last_object_lies_on_top_and_what_is_in_the_way_is_pushed() -> None:
    batch = corridor(((2, 2), (3, 2), (3, 2)), ("generator", "platform"))
    assert code_at(batch, 3, 2) == PLATFORM
    step(batch, FORWARD)
    assert entity(batch, 0, Field.X) == [2], "the generator is in the way"
    assert entity(batch, 1, Field.STATUS) == [PRESSED], "though it is covered"
    batch = corridor(((2, 2), (3, 2), (3, 2)), ("platform", "generator"))
    assert code_at(batch, 3, 2) == GENERATOR
    step(batch, FORWARD)
    assert entity(batch, 2, Field.STATUS) == [PRESSED]


def test_of_two_doors_in_one_cell_the_last_is_toggled() -> None:
    batch = corridor(((2, 2), (3, 2), (3, 2)), ("door", "door"))
    step(batch, (int(Body.TOGGLE), 0, 0, 0))
    assert [entity(batch, n, Field.STATUS) for n in (1, 2)] == [[CLOSED], [OPEN]]
    step(batch, FORWARD)
    assert entity(batch, 0, Field.X) == [2]


def test_a_content_takes_the_place_of_what_held_it() -> None:
    """What links do with an opened box: it vanishes, and what lay inside is put on its cell."""
    inside: list[Instruction] = [
        (Op.PLACE, constant(2), constant(1)),
        (Op.VANISH, constant(2)),
        (Op.SET_FIELD, constant(2), Field.INSIDE, constant(1)),
    ]
    release: list[Instruction] = [
        (Op.IF_EQ, entity_register(1, Field.STATUS), constant(OPEN), 2),
        (Op.VANISH, constant(1)),
        (Op.PLACE, constant(2), constant(1)),
    ]
    batch = corridor(((2, 2), (3, 2), None), ("door", "platform"), reset=inside, links=release)
    assert entity(batch, 2, Field.X, Field.Y, Field.GONE, Field.INSIDE) == [3, 2, 1, 1]
    step(batch, (int(Body.TOGGLE), 0, 0, 0))
    assert entity(batch, 1, Field.GONE) == [1]
    assert entity(batch, 2, Field.X, Field.Y, Field.GONE) == [3, 2, 0]
    assert code_at(batch, 3, 2) == PLATFORM


def test_placing_draws_both_cells_and_counts_as_a_change() -> None:
    own = Assembly(at=((2, 2), (3, 2))).own
    settled: list[Instruction] = [(Op.ADD, own, own, constant(1))]
    move: list[Instruction] = [(Op.IF_EQ, Register.T, constant(1), 1), (Op.PLACE, constant(1), 2048 + 0)]
    move[1] = (Op.PLACE, constant(1), constant(2048 + 32 * 1 + 5))
    batch = corridor(((2, 2), (3, 2)), ("generator",), rules=move, settle=settled)
    before = int(batch.state.registers[0, own])
    step(batch)
    assert entity(batch, 1, Field.X, Field.Y) == [5, 1]
    assert (code_at(batch, 3, 2), code_at(batch, 5, 1)) == (1, GENERATOR)
    step(batch)
    assert batch.state.registers[0, own] == before + 1


@pytest.mark.parametrize("cell", [2047, 2048 + 32 * 1 + 20, 2048 + 32 * 20 + 1])
def test_nothing_is_placed_off_the_canvas(cell: int) -> None:
    batch = corridor(((2, 2), (3, 2)), ("generator",), rules=[(Op.PLACE, constant(1), constant(cell))])
    step(batch)
    assert entity(batch, 1, Field.X, Field.Y) == [3, 2]


@pytest.mark.parametrize(
    ("target", "x"),
    [((5, 2), 5), ((2, 2), 3), ((4, 1), 3), ((6, 3), 3), ((8, 2), 3), ((3, 2), 3)],
    ids=["free", "agent", "generator", "other NPC", "wall", "its own"],
)
def test_an_npc_is_placed_only_where_it_can_stand(target: tuple[int, int], x: int) -> None:
    cell = 2048 + 32 * target[1] + target[0]
    batch = corridor(
        ((2, 2), (3, 2), (6, 3), (4, 1)),
        ("generator",),
        npcs=2,
        rules=[(Op.PLACE, constant(1), constant(cell))],
    )
    step(batch)
    assert entity(batch, 1, Field.X) == [x]


def test_who_vanished_comes_back_by_being_placed() -> None:
    rules: list[Instruction] = [
        (Op.IF_EQ, Register.T, constant(1), 2),
        (Op.VANISH, constant(1)),
        (Op.SKIP, 0, 0, 1),
        (Op.PLACE, constant(1), constant(2048 + 32 * 2 + 3)),
    ]
    batch = corridor(((2, 2), (3, 2)), (), npcs=1, rules=rules)
    step(batch)
    assert (entity(batch, 1, Field.GONE), code_at(batch, 3, 2)) == ([1], 1)
    step(batch)
    assert (entity(batch, 1, Field.GONE), code_at(batch, 3, 2)) == ([0], 11)


def test_the_world_is_settled_before_and_after_what_counts_by_itself() -> None:
    own = Assembly(at=((2, 2), (3, 2))).own

    def note(digit: int) -> list[Instruction]:
        return [(Op.MUL, own, own, constant(10)), (Op.ADD, own, own, constant(digit))]

    expire: list[Instruction] = [
        *note(2),
        (Op.IF_EQ, entity_register(1, Field.STATUS), constant(PRESSED), 1),
        (Op.BECOME, constant(1), constant(IDLE)),
    ]
    for flags in (0, int(Flag.PICTURE_BEFORE_NPCS)):
        batch = corridor(
            ((2, 2), (3, 2)),
            ("generator",),
            flags=flags,
            reset=[],
            links=note(1),
            settle=note(3),
            tick=expire,
        )
        batch.state.registers[0, own] = 0
        step(batch, FORWARD)
        assert batch.state.registers[0, own] == 13213
        assert entity(batch, 1, Field.STATUS) == [IDLE]
        image = batch.state.image.view(np.uint8).reshape(7, 7, 4)
        assert image[3, 5, 2] == (PRESSED if flags else IDLE)
