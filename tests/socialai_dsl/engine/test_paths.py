"""Activities that go somewhere take shortest paths, break ties as the language says, and turn before they go."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Op, Register
from tests.assembly import CLOSED, HIDDEN, OPEN, Assembly, batch_of, constant, entity_register

LEFT, RIGHT, FORWARD, NONE = Body.LEFT, Body.RIGHT, Body.FORWARD, Body.NONE


def choice(op: Op, mover: int, target: int, **room: object) -> int:
    """The body action that an activity chooses in a room."""
    block = [(op, constant(mover), constant(target), 0)]
    batch = batch_of(Assembly(rules=block, **room).program())  # type: ignore[arg-type]
    batch.ports.actions[:] = (7, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    return int(batch.state.registers[0, Register.LAST_TURN])


@pytest.mark.parametrize(
    ("to", "facing", "expected"),
    [
        ((2, 3), 1, FORWARD),  # down
        ((2, 3), 0, RIGHT),
        ((2, 3), 2, LEFT),
        ((3, 3), 1, FORWARD),  # down before right
        ((3, 3), 0, RIGHT),
        ((1, 1), 3, FORWARD),  # up before left
        ((1, 1), 2, RIGHT),
        ((3, 1), 3, FORWARD),  # up before right
    ],
)
def test_ties_go_down_up_right_left(to: tuple[int, int], facing: int, expected: Body) -> None:
    assert choice(Op.GO_TO, 1, 0, at=(to, (2, 2)), npcs=1, facing=(0, facing)) == expected


@pytest.mark.parametrize(
    ("to", "facing", "expected"),
    [
        ((3, 3), 0, FORWARD),  # right, which is straight ahead, before down
        ((1, 1), 2, FORWARD),
        ((2, 3), 0, RIGHT),
        ((2, 3), 3, LEFT),  # what is behind
    ],
)
def test_a_script_of_the_agent_s_goes_straight_ahead(
    to: tuple[int, int], facing: int, expected: Body
) -> None:
    room = {"at": ((2, 2), to), "npcs": 1, "facing": (facing, 0), "flags": HIDDEN}
    assert choice(Op.GO_TO, 0, 1, **room) == expected


def test_behind_a_coin_decides() -> None:
    room = {"at": ((2, 3), (2, 2)), "npcs": 1, "facing": (0, 3)}
    block = [(Op.GO_TO, constant(1), constant(0), 1)]
    batch = batch_of(Assembly(rules=block, **room).program(), 200)  # type: ignore[arg-type]
    batch.ports.actions[:] = (7, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    expected = [
        draws.below(draws.draw(draws.episode_key(7, i, 0), draws.site("b"), 1, 3), 2) for i in range(200)
    ]
    assert batch.state.registers[:, Register.LAST_TURN].tolist() == expected
    assert set(expected) == {int(LEFT), int(RIGHT)}


def test_go_to_admits_a_taken_cell_and_stops_there() -> None:
    assert choice(Op.GO_TO, 1, 0, at=((2, 2), (2, 1)), npcs=1, facing=(0, 1)) == FORWARD
    assert choice(Op.GO_TO, 1, 2, at=((1, 1), (2, 2), (2, 2)), npcs=2) == NONE


def test_go_next_to_stops_beside() -> None:
    assert choice(Op.GO_NEXT_TO, 1, 0, at=((2, 2), (2, 1)), npcs=1, facing=(0, 1)) == NONE
    assert choice(Op.GO_NEXT_TO, 1, 0, at=((1, 1), (3, 1)), npcs=1, facing=(0, 2)) == FORWARD


def test_no_path_no_move() -> None:
    corner = ((3, 3), (1, 1), (2, 1), (1, 2))
    assert choice(Op.GO_TO, 1, 0, at=corner, npcs=3) == NONE
    assert choice(Op.GO_NEXT_TO, 1, 0, at=corner, npcs=3) == NONE


def test_hidden_npcs_are_in_the_way_of_npcs_only() -> None:
    row = ((1, 1), (2, 1), (3, 1))
    walled = {"npcs": 2, "size": (5, 3), "canvas": (5, 4), "facing": (0, 0, 2)}
    assert choice(Op.GO_TO, 0, 2, at=row, **walled) == NONE
    assert choice(Op.GO_TO, 0, 2, at=row, flags=HIDDEN, **walled) == FORWARD
    assert choice(Op.GO_TO, 2, 0, at=row, flags=HIDDEN, **walled) == NONE


def test_npcs_walk_around_what_is_deadly() -> None:
    room = {"at": ((1, 1), (3, 1), (2, 1)), "npcs": 1, "objects": ("lava",), "facing": (0, 1)}
    assert choice(Op.GO_TO, 1, 0, deadly=True, **room) == FORWARD, "down, around the lava"
    assert choice(Op.GO_TO, 1, 0, deadly=False, **{**room, "facing": (0, 2)}) == FORWARD, "straight over it"


@pytest.mark.parametrize(("status", "expected"), [(CLOSED, NONE), (OPEN, FORWARD)])
def test_doors_are_ways_when_open(status: int, expected: Body) -> None:
    room = {
        "at": ((1, 1), (3, 1), (2, 1)),
        "npcs": 1,
        "objects": ("door",),
        "size": (5, 3),
        "canvas": (5, 4),
        "facing": (0, 2),
        "reset": [(Op.LOAD, entity_register(2, Field.STATUS), constant(status))],
    }
    assert choice(Op.GO_TO, 1, 0, **room) == expected


@pytest.mark.parametrize("size", [8, 9, 7])
def test_shortest_paths_in_random_rooms(size: int) -> None:
    """In rooms with random obstacles every next cell is one nearer to the goal, and NONE means there is no way."""
    rng = np.random.default_rng(size)
    checked = blocked = 0
    for _ in range(120):
        cells = [(x, y) for x in range(1, size - 1) for y in range(1, size - 1)]
        picked = [cells[i] for i in rng.permutation(len(cells))[:14]]
        at = (picked[0], picked[1], *picked[2:])
        facing = int(rng.integers(4))
        room = {
            "at": at,
            "npcs": 1,
            "objects": ("door",) * 12,
            "size": (size, size),
            "canvas": (size, size),
            "facing": (0, facing),
        }
        action = choice(Op.GO_TO, 1, 0, **room)
        distance = _distances(picked[0], set(picked[2:]), size)
        here = distance.get(picked[1])
        if here is None:
            assert action == NONE
            blocked += 1
            continue
        best = next(
            d
            for d in (1, 3, 0, 2)
            if distance.get((picked[1][0] + (1, 0, -1, 0)[d], picked[1][1] + (0, 1, 0, -1)[d])) == here - 1
        )
        turn = (best - facing) % 4
        assert action in {0: (FORWARD,), 1: (RIGHT,), 3: (LEFT,), 2: (LEFT, RIGHT)}[turn]
        checked += 1
    assert checked > 50
    assert blocked > 1


def _distances(goal: tuple[int, int], walls: set[tuple[int, int]], size: int) -> dict[tuple[int, int], int]:
    distance = {goal: 0}
    queue = [goal]
    for x, y in queue:
        for cell in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            inside = 0 < cell[0] < size - 1 and 0 < cell[1] < size - 1
            if inside and cell not in walls and cell not in distance:
                distance[cell] = distance[(x, y)] + 1
                queue.append(cell)
    return distance
