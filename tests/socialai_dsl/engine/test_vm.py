"""Every instruction does what its line in `program.Op` says."""

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.program import CELL, Field, Op, Register
from tests.assembly import (
    CLOSED,
    LOCKED,
    Assembly,
    Instruction,
    batch_of,
    constant,
    entity_register,
    holds,
    result_of,
    step,
    temporary,
)

RESULT = Assembly().own  # entities: the agent alone


@pytest.mark.parametrize(
    ("op", "left", "right", "expected"),
    [
        (Op.ADD, 3, -5, -2),
        (Op.SUB, 3, -5, 8),
        (Op.MUL, -3, 5, -15),
        (Op.DIV, -7, 2, -4),
        (Op.DIV, 7, 0, 0),
        (Op.MOD, -7, 3, 2),
        (Op.MOD, 7, -3, -2),
        (Op.MOD, 7, 0, 0),
        (Op.MIN, -3, 5, -3),
        (Op.MAX, -3, 5, 5),
    ],
)
def test_arithmetic(op: Op, left: int, right: int, expected: int) -> None:
    assert result_of([(op, RESULT, constant(left), constant(right))]) == expected


def test_operands_are_constants_temporaries_and_registers() -> None:
    block = [
        (Op.LOAD, temporary(5), constant(77)),
        (Op.LOAD, RESULT + 1, temporary(5)),
        (Op.ADD, RESULT, RESULT + 1, Register.T),
    ]
    assert result_of(block) == 78


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ([(Op.ABS, RESULT, constant(-9))], 9),
        ([(Op.LOAD, RESULT, constant(8)), (Op.SET_BIT, RESULT, constant(1))], 10),
        ([(Op.COUNT_BITS, RESULT, constant(0b101101))], 4),
        ([(Op.LOWEST_BIT, RESULT, constant(0b101000))], 3),
        ([(Op.LOWEST_BIT, RESULT, constant(0))], 0),
        ([(Op.PICK_BIT, RESULT, constant(0), 0)], 0),
        ([(Op.FIELD, RESULT, constant(0), Field.X)], 2),
    ],
)
def test_values(block: list[Instruction], expected: int) -> None:
    assert result_of(block) == expected


def test_registers_of_a_row_are_found_by_adding() -> None:
    block = [
        (Op.STORE_AT, constant(41), RESULT, constant(2)),
        (Op.LOAD, temporary(1), constant(1)),
        (Op.STORE_AT, constant(7), RESULT, temporary(1)),
        (Op.READ_AT, temporary(0), RESULT + 1, constant(1)),
        (Op.READ_AT, RESULT, RESULT, temporary(1)),
        (Op.ADD, RESULT, RESULT, temporary(0)),
    ]
    assert result_of(block) == 48


def test_picked_bits_are_the_drawn_ones() -> None:
    bits = draws.draw(draws.episode_key(7, 0, 0), draws.site("b"), 1, 3)
    members = [1, 2, 5, 9, 14]
    word = sum(1 << bit for bit in members)
    assert result_of([(Op.PICK_BIT, RESULT, constant(word), 1)]) == members[draws.below(bits, 5)]


@pytest.mark.parametrize(
    ("test", "expected"),
    [
        ((Op.IF_EQ, constant(4), constant(4)), True),
        ((Op.IF_EQ, constant(4), constant(5)), False),
        ((Op.IF_NE, constant(4), constant(5)), True),
        ((Op.IF_NE, constant(4), constant(4)), False),
        ((Op.IF_LT, constant(-4), constant(4)), True),
        ((Op.IF_LT, constant(4), constant(4)), False),
        ((Op.IF_LE, constant(4), constant(4)), True),
        ((Op.IF_LE, constant(5), constant(4)), False),
        ((Op.IF_BIT, constant(0b100), constant(2)), True),
        ((Op.IF_BIT, constant(0b100), constant(1)), False),
        ((Op.IF_BIT, constant(0b100), constant(-1)), False),
        ((Op.IF_CHANCE, 65536, 0), True),
        ((Op.IF_CHANCE, 0, 0), False),
        ((Op.IF_UNPINNED, Register.WIDTH, 0), True),
    ],
)
def test_comparisons(test: Instruction, expected: bool) -> None:
    assert holds((*test, 2)) == expected


def test_chance_is_drawn_at_its_site_in_its_step() -> None:
    program = Assembly(rules=[(Op.IF_CHANCE, 20000, 1, 1), (Op.LOAD, RESULT, Register.T)]).program()
    batch = batch_of(program, 400)
    step(batch)
    expected = [
        draws.holds_with_chance(draws.draw(draws.episode_key(7, i, 0), draws.site("b"), 1, 3), 20000 / 65536)
        for i in range(400)
    ]
    assert batch.state.registers[:, RESULT].astype(bool).tolist() == expected


# Entity 0 is the agent, 1 an NPC, 2 a door in the left wall or, off the wall, one that faces right.
@pytest.mark.parametrize(
    ("op", "agent", "npc", "expected"),
    [
        (Op.IF_NEXT_TO, (2, 2, 0), (2, 3, 0), True),
        (Op.IF_NEXT_TO, (2, 2, 0), (3, 3, 0), False),
        (Op.IF_SAME_CELL, (2, 2, 0), (2, 2, 0), True),
        (Op.IF_SAME_CELL, (2, 2, 0), (2, 3, 0), False),
        (Op.IF_FACES, (2, 2, 0), (3, 2, 0), True),
        (Op.IF_FACES, (2, 2, 1), (3, 2, 0), False),
        (Op.IF_FACES, (2, 2, 3), (2, 1, 0), True),
        (Op.IF_IN_FRONT_OF, (2, 2, 0), (1, 2, 0), True),
        (Op.IF_IN_FRONT_OF, (2, 2, 0), (1, 2, 1), False),
        (Op.IF_EYE_CONTACT, (1, 2, 0), (3, 2, 2), True),
        (Op.IF_EYE_CONTACT, (1, 2, 0), (3, 2, 0), False),
        (Op.IF_EYE_CONTACT, (1, 1, 0), (3, 2, 2), False),
        (Op.IF_EYE_CONTACT, (2, 1, 1), (2, 3, 3), True),
        (Op.IF_EYE_CONTACT, (2, 2, 1), (2, 2, 1), False),
        (Op.IF_FACES_TOWARD, (1, 1, 0), (3, 2, 0), True),
        (Op.IF_FACES_TOWARD, (1, 1, 1), (3, 2, 0), False),
        (Op.IF_FACES_TOWARD, (1, 1, 0), (3, 3, 0), True),
        (Op.IF_IN_LINE, (1, 3, 0), (3, 3, 0), True),
        (Op.IF_IN_LINE, (1, 2, 0), (3, 3, 0), False),
        (Op.IF_REACHES, (1, 1, 0), (3, 3, 0), True),
    ],
)
def test_entities(op: Op, agent: tuple[int, int, int], npc: tuple[int, int, int], expected: bool) -> None:
    room = {"at": (agent[:2], npc[:2]), "facing": (agent[2], npc[2]), "npcs": 1}
    assert holds((op, constant(0), constant(1), 2), **room) == expected
    gone = {**room, "reset": [(Op.VANISH, constant(1))]}
    assert not holds((op, constant(0), constant(1), 2), **gone), "nothing holds of who is not in the room"


@pytest.mark.parametrize(
    ("door", "agent", "expected"),
    [
        ((0, 2), (1, 2), True),
        ((0, 2), (1, 1), False),
        ((2, 0), (2, 1), True),
        ((4, 3), (3, 3), True),
        ((1, 4), (1, 3), True),
    ],
)
def test_the_front_of_a_thing_in_a_wall_is_in_the_room(
    door: tuple[int, int], agent: tuple[int, int], expected: bool
) -> None:
    room = {"at": (agent, door), "objects": ("door",), "facing": (0, 3)}
    assert holds((Op.IF_IN_FRONT_OF, constant(0), constant(1), 2), **room) == expected


def test_walls_and_bodies_block_the_way() -> None:
    # The agent in a corner, an NPC on each of its two neighbours.
    room = {"at": ((1, 1), (2, 1), (1, 2), (3, 3)), "npcs": 3}
    assert not holds((Op.IF_REACHES, constant(0), constant(3), 2), **room)
    assert holds((Op.IF_REACHES, constant(0), constant(2), 2), **room), "next to it already"


@pytest.mark.parametrize(
    ("to", "direction"),
    [((3, 2), 0), ((2, 3), 1), ((1, 2), 2), ((2, 1), 3), ((3, 3), 0), ((3, 1), 3), ((1, 1), 2), ((1, 3), 1)],
)
def test_quadrant_and_distance(to: tuple[int, int], direction: int) -> None:
    room = {"at": ((2, 2), to), "npcs": 1}
    own = Assembly(at=((2, 2), to), npcs=1).own
    assert result_of([(Op.QUADRANT, own, constant(0), constant(1))], own, **room) == direction
    away = abs(to[0] - 2) + abs(to[1] - 2)
    assert result_of([(Op.DISTANCE, own, constant(0), constant(1))], own, **room) == away


@pytest.mark.parametrize(
    ("to", "nearest"),
    [
        (constant(0), 2),
        (constant(1), 1),
        (constant(3), 3),
        (constant(CELL + 32 * 1 + 4), 1),
        (constant(CELL - 1), -1),
    ],
    ids=["a tie", "itself", "the last", "a cell", "no cell"],
)
def test_the_nearest_of_some_entities(to: int, nearest: int) -> None:
    """Of entities 1 to 3; 0 is as far from 2 as from 3, and entity 4, the nearest to it, is not among them."""
    room = {"at": ((3, 3), (5, 1), (3, 5), (1, 3), (3, 4)), "npcs": 4}
    own = Assembly(**room).own
    assert result_of([(Op.NEAREST, own, to, 1 << 8 | 3)], own, **room) == nearest


def test_what_has_left_the_room_is_not_the_nearest() -> None:
    room = {"at": ((3, 3), (5, 1), (3, 5), (1, 3)), "npcs": 3}
    own = Assembly(**room).own
    nearest = (Op.NEAREST, own, constant(0), 1 << 8 | 3)
    left = [(Op.VANISH, constant(2)), (Op.VANISH, constant(3)), (Op.VANISH, constant(1))]
    assert [result_of([*left[:gone], nearest], own, **room) for gone in range(4)] == [2, 3, 1, -1]
    assert result_of([(Op.VANISH, constant(0)), nearest], own, **room) == -1


def test_effects_on_a_thing_are_seen_at_once() -> None:
    room = {"at": ((1, 2), (0, 2)), "objects": ("door",), "facing": (2,)}
    shut = batch_of(Assembly(**room).program())
    locked = batch_of(Assembly(rules=[(Op.BECOME, constant(1), constant(LOCKED))], **room).program())
    gone = batch_of(Assembly(rules=[(Op.VANISH, constant(1))], **room).program())
    red = batch_of(Assembly(rules=[(Op.SET_FIELD, constant(1), Field.COLOR, constant(3))], **room).program())
    looks = []
    for batch in (shut, locked, gone, red):
        step(batch)
        looks.append(batch.state.image.view(np.uint8).reshape(7, 7, 4)[3, 5].tolist())
    assert looks == [[4, 0, CLOSED, 0], [4, 0, LOCKED, 0], [2, 5, 0, 0], [4, 3, CLOSED, 0]]


def test_count_and_end() -> None:
    rules = [
        (Op.COUNT, 0),
        (Op.IF_EQ, Register.T, constant(3), 1),
        (Op.END, 1, 50),
    ]
    batch = batch_of(Assembly(rules=rules, horizon=10).program())
    for _ in range(3):
        step(batch)
    assert batch.ports.terminated[0]
    assert batch.ports.outcome[0] == 1
    assert batch.ports.reward[0] == pytest.approx(0.5 * (1 - 0.9 * 3 / 10))
    assert batch.counters.tolist() == [3, 0, 1, 0, 0, 1]


def test_each_cell_visits_row_by_row_and_drops() -> None:
    own = RESULT
    # Of the nine floor cells drop those with x == 2, then count what is left and remember the last x + 10 y.
    reset = [
        (Op.B_FLOOR, 0),
        (Op.EACH_CELL, 0, temporary(2), 3),
        (Op.IF_EQ, temporary(2), constant(2), 1),
        (Op.DROP_CELL, 0, 0, 0),
        (Op.END_EACH, 0, 0, 0),
        (Op.EACH_CELL, 0, temporary(2), 5),
        (Op.ADD, own, own, constant(1)),
        (Op.MUL, temporary(5), temporary(3), constant(10)),
        (Op.ADD, own + 1, temporary(5), temporary(2)),
        (Op.LOAD, own + 3, temporary(4)),
        (Op.END_EACH, 0, 0, 0),
        (Op.LOAD, own + 2, constant(5)),
    ]
    batch = batch_of(Assembly(reset=reset).program())
    assert batch.state.registers[0, own : own + 4].tolist() == [6, 33, 5, CELL + 32 * 3 + 3]


def test_each_cell_of_nothing_runs_nothing() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.B_WITHOUT, 0, 0),
        (Op.EACH_CELL, 0, temporary(2), 1),
        (Op.LOAD, RESULT, constant(1)),
        (Op.END_EACH, 0, 0, 0),
        (Op.LOAD, RESULT + 1, constant(1)),
    ]
    batch = batch_of(Assembly(reset=reset).program())
    assert batch.state.registers[0, RESULT : RESULT + 2].tolist() == [0, 1]


FLOOR = {(x, y) for x in (1, 2, 3) for y in (1, 2, 3)}


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ([(Op.B_FLOOR, 1)], FLOOR),
        ([(Op.B_WALL, 1, 0, 2)], {(2, 0)}),
        ([(Op.B_WALL, 1, 1, 1)], {(1, 4), (2, 4), (3, 4)}),
        ([(Op.B_WALL, 1, 2, 1)], {(0, 1), (0, 2), (0, 3)}),
        ([(Op.B_WALL, 1, 3, 2)], {(4, 2)}),
        ([(Op.B_NEXT_TO, 1, constant(0))], {(2, 1), (2, 3), (1, 2), (3, 2)}),
        ([(Op.B_IN_FRONT_OF, 1, constant(0))], {(2, 3)}),
        ([(Op.B_FLOOR, 1), (Op.B_FREE, 1)], FLOOR - {(2, 2)}),
        (
            [(Op.B_FLOOR, 1), (Op.B_NEXT_TO, 2, constant(0)), (Op.B_AND, 1, 2)],
            {(2, 1), (2, 3), (1, 2), (3, 2)},
        ),
        ([(Op.B_WALL, 1, 0, 2), (Op.B_WALL, 2, 3, 2), (Op.B_OR, 1, 2)], {(2, 0), (4, 2)}),
        (
            [(Op.B_FLOOR, 1), (Op.B_NEXT_TO, 2, constant(0)), (Op.B_WITHOUT, 1, 2)],
            FLOOR - {(2, 1), (2, 3), (1, 2), (3, 2)},
        ),
        ([(Op.B_WALL, 2, 0, 2), (Op.B_COPY, 1, 2)], {(2, 0)}),
        (
            [
                *((Op.LOAD, temporary(4 + i), constant(n)) for i, n in enumerate((2, 9, 0, 2))),
                (Op.B_RECT, 1, temporary(4)),
            ],
            {(2, 1), (3, 1), (2, 2), (3, 2)},
        ),
    ],
)
def test_boards(block: list[Instruction], expected: set[tuple[int, int]]) -> None:
    own = RESULT
    # One bit of two registers for each cell visited: x + 8 y would not fit into 16 bits, so rows go to registers.
    visit = [
        (Op.EACH_CELL, 1, temporary(2), 6),
        *[
            instruction
            for y in range(3)
            for instruction in (
                (Op.IF_EQ, temporary(3), constant(y + 1), 1),
                (Op.SET_BIT, own + y, temporary(2)),
            )
        ],
        (Op.END_EACH, 0, 0, 0),
        (Op.EACH_CELL, 1, temporary(2), 4),
        (Op.IF_EQ, temporary(3), constant(0), 1),
        (Op.SET_BIT, own + 3, temporary(2)),
        (Op.IF_EQ, temporary(3), constant(4), 1),
        (Op.SET_BIT, own + 4, temporary(2)),
        (Op.END_EACH, 0, 0, 0),
    ]
    batch = batch_of(Assembly(facing=(1,), reset=[*block, *visit]).program())
    lines = {y: int(batch.state.registers[0, own + i]) for i, y in enumerate((1, 2, 3, 0, 4))}
    assert {(x, y) for y, line in lines.items() for x in range(6) if line >> x & 1} == expected


def test_picked_cells_are_uniform_draws_in_reading_order() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.B_FREE, 0),
        (Op.PICK_CELL, temporary(0), 0, 0),
        (Op.LOAD, RESULT, temporary(0)),
        (Op.LOAD, RESULT + 1, temporary(1)),
    ]
    batch = batch_of(Assembly(reset=reset).program(), 300)
    free = sorted(FLOOR - {(2, 2)}, key=lambda cell: (cell[1], cell[0]))
    expected = [
        free[draws.below(draws.draw(draws.episode_key(7, i, 0), draws.site("a"), 0, 0), 8)]
        for i in range(300)
    ]
    assert [tuple(row) for row in batch.state.registers[:, RESULT : RESULT + 2].tolist()] == expected


def test_a_cell_of_an_empty_set_is_nowhere() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.B_WITHOUT, 0, 0),
        (Op.PICK_CELL, temporary(0), 0, 0),
        (Op.PUT, constant(1), temporary(0)),
    ]
    batch = batch_of(Assembly(at=((1, 1), (2, 2)), npcs=1, reset=reset).program())
    gone = [
        int(batch.state.registers[0, entity_register(1, name)]) for name in (Field.X, Field.Y, Field.GONE)
    ]
    assert gone == [-1, -1, 1]


CHOSEN = [
    # Board 1: the floor cells of the first line without the first, and the one in the lower left corner.
    *((Op.LOAD, temporary(4 + i), constant(n)) for i, n in enumerate((2, 3, 1, 1))),
    (Op.B_RECT, 1, temporary(4)),
    *((Op.LOAD, temporary(4 + i), constant(n)) for i, n in enumerate((1, 1, 3, 3))),
    (Op.B_RECT, 2, temporary(4)),
    (Op.B_OR, 1, 2),
]
NONE = [(Op.B_FLOOR, 1), (Op.B_WITHOUT, 1, 1)]


@pytest.mark.parametrize(
    ("block", "op", "thing", "expected"),
    [
        (CHOSEN, Op.FIRST_CELL, 0, (2, 1)),
        (NONE, Op.FIRST_CELL, 0, (-1, -1)),
        (CHOSEN, Op.NEAREST_CELL, 0, (2, 1)),
        (CHOSEN, Op.NEAREST_CELL, CELL + 32 * 3 + 2, (1, 3)),
        (CHOSEN, Op.NEAREST_CELL, CELL + 32 * 2 + 4, (3, 1)),
        (NONE, Op.NEAREST_CELL, 0, (-1, -1)),
    ],
)
def test_cells_are_found_on_boards(
    block: list[Instruction], op: Op, thing: int, expected: tuple[int, int]
) -> None:
    rules = [
        *block,
        (op, temporary(0), 1, constant(thing)),
        (Op.LOAD, RESULT, temporary(0)),
        (Op.LOAD, RESULT + 1, temporary(1)),
        (Op.B_COUNT, temporary(0), 1),
        (Op.LOAD, RESULT + 2, temporary(0)),
    ]
    batch = batch_of(Assembly(at=((2, 2),), rules=rules).program())
    step(batch)
    count = 3 if block is CHOSEN else 0
    assert batch.state.registers[0, RESULT : RESULT + 3].tolist() == [*expected, count]


def test_cells_are_visited_in_the_widest_room() -> None:
    reset = [
        (Op.B_FLOOR, 0),
        (Op.EACH_CELL, 0, temporary(0), 2),
        (Op.ADD, RESULT, RESULT, constant(1)),
        (Op.LOAD, RESULT + 1, temporary(2)),
        (Op.END_EACH, 0, 0, 0),
    ]
    batch = batch_of(Assembly(size=(30, 30), canvas=(30, 30), reset=reset).program())
    assert batch.state.registers[0, RESULT : RESULT + 2].tolist() == [28 * 28, CELL + 32 * 28 + 28]
