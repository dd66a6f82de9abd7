"""What bodies do, and in which order an NPC notices, acts, concludes and speaks."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Flag, Op, Register
from tests.assembly import (
    CLOSED,
    HIDDEN,
    OPEN,
    Assembly,
    FrameSpec,
    batch_of,
    constant,
    entity_register,
    play,
    temporary,
)


def body(action: Body) -> tuple[int, ...]:
    return int(action), 0, 0, 0


def entity(batch: Batch, number: int, *fields: Field) -> list[int]:
    return [int(batch.state.registers[0, entity_register(number, name)]) for name in fields]


POSE = (Field.X, Field.Y, Field.DIR)


def npc_program(activity: list[tuple[int, ...]], **room: object) -> Batch:
    frames = (FrameSpec(1, (activity,)),)
    return batch_of(Assembly(npcs=1, frames=frames, **room).program())  # type: ignore[arg-type]


FORWARD = [(Op.BODY, constant(Body.FORWARD))]


def noting(own: int, digit: int, base: int = 10) -> list[tuple[int, ...]]:
    """Code that appends a digit to a register."""
    return [(Op.MUL, own, own, constant(base)), (Op.ADD, own, own, constant(digit))]


def test_two_frames_of_one_npc_share_a_turn() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    frames = (
        FrameSpec(1, ([(Op.BODY, constant(Body.RIGHT))],), then=({2: noting(own, 1)},)),
        FrameSpec(1, ([],), then=({2: [*noting(own, 2), (Op.SAY, constant(1), constant(0))]},)),
    )
    lines = (("hello", (2,), 1),)
    batch = batch_of(
        Assembly(at=((1, 1), (2, 2)), npcs=1, frames=frames, lines=lines, earshot=(0, 9)).program()
    )
    play(batch, (7, 1, 0, 1))
    assert batch.state.registers[0, own] == 12, "both heard it"
    assert entity(batch, 1, Field.LAST) == [Body.RIGHT], "the frame without a body action does not hide it"
    assert batch.state.registers[0, Register.HEARD] == 1


def test_scripted_actions_leave_everything_as_it_is() -> None:
    own = Assembly(at=((2, 2), (3, 2)), npcs=1).own
    frame = FrameSpec(
        0,
        ([(Op.BODY, constant(Body.TOGGLE))],),
        first=({-1: [(Op.COUNT, 0), *noting(own, 1)]},),
        then=({-1: [(Op.SAY, constant(0), constant(2 + 4)), *noting(own, 2)]},),
    )
    lines = tuple((f"line{i}", (2,), 1) for i in range(2 + 6))
    room = Assembly(
        at=((2, 2), (3, 2)),
        npcs=1,
        frames=(frame,),
        lines=lines,
        flags=int(Flag.AGENT_FRAME),
        agent_says=3,
    )
    batch = batch_of(room.program(), 3)
    before = [array.copy() for array in (*batch.state, batch.counters)]
    batch.script()
    assert batch.ports.actions.tolist() == [[Body.TOGGLE, 1, 1, 1]] * 3, "pair 4 is template 1, noun 1"
    for was, now in zip(before, (*batch.state, batch.counters), strict=True):
        np.testing.assert_array_equal(was, now)
    batch.ports.actions[:] = (2, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    assert batch.state.registers[0, own] == 12, "in a step the frame's effects happen"
    assert entity(batch, 0, Field.LAST) == [Body.FORWARD], "but its body does what the action says"
    assert batch.state.registers[0, Register.TEMPLATE] == -1, "and it says what the action says"
    assert batch.state.registers[0, Register.SAID_LINE] == 0


def cell_at(batch: Batch, x: int, y: int) -> tuple[list[int], bool]:
    """How a cell looks (type, colour, status, direction) and whether it is solid."""
    look = int(batch.state.boards[0, 6 * y + x])
    return [look >> 8 * i & 0xFF for i in range(4)], bool(batch.state.boards[0, 43 + y] >> x & 1)


OPENED = [(Op.LOAD, entity_register(2, Field.STATUS), constant(OPEN))]


@pytest.mark.parametrize(
    ("thing", "look"), [("door", [4, 0, OPEN, 0]), ("lava", [9, 0, 0, 0])], ids=["door", "lava"]
)
def test_an_npc_hides_what_it_stands_on_until_it_leaves(thing: str, look: list[int]) -> None:
    batch = npc_program(FORWARD, at=((1, 1), (1, 2), (2, 2)), objects=(thing,), reset=OPENED)
    assert cell_at(batch, 2, 2) == (look, False)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([11, 0, 1, 0], False)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == (look, False)
    assert cell_at(batch, 3, 2) == ([11, 0, 1, 0], False)


@pytest.mark.parametrize("hidden", [0, HIDDEN])
def test_where_an_npc_vanishes_the_door_reappears(hidden: int) -> None:
    vanish = [(Op.IF_EQ, Register.T, constant(2), 1), (Op.VANISH, constant(1))]
    room = {"at": ((1, 1), (1, 2), (2, 2)), "objects": ("door",), "reset": OPENED}
    batch = npc_program(FORWARD, rules=vanish, flags=hidden, **{**room, "at": ((1, 1), (2, 2), (2, 2))})
    for npc in (
        batch,
        npc_program([], rules=vanish, flags=hidden, **{**room, "at": ((3, 3), (2, 2), (2, 2))}),
    ):
        play(npc, body(Body.NONE), body(Body.NONE))
        assert cell_at(npc, 2, 2) == ([4, 0, OPEN, 0], False)
        assert cell_at(npc, 3, 2) == ([1, 0, 0, 0], False)


def test_a_door_that_shuts_under_an_npc_is_shut_when_it_leaves() -> None:
    shut = [(Op.BECOME, constant(2), constant(CLOSED))]
    activity = [(Op.IF_EQ, Register.T, constant(2), 1), (Op.BODY, constant(Body.FORWARD))]
    batch = npc_program(activity, at=((1, 1), (2, 2), (2, 2)), objects=("door",), reset=OPENED, rules=shut)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([11, 0, 1, 0], True), "the NPC is seen, the cell is shut"
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([4, 0, CLOSED, 0], True)
    assert entity(batch, 1, Field.X) == [3]


def test_a_thing_that_vanishes_under_an_npc_leaves_floor() -> None:
    gone = [(Op.VANISH, constant(2))]
    activity = [(Op.IF_EQ, Register.T, constant(2), 1), (Op.BODY, constant(Body.FORWARD))]
    batch = npc_program(activity, at=((1, 1), (2, 2), (2, 2)), objects=("door",), rules=gone)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([11, 0, 1, 0], False)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([1, 0, 0, 0], False)


def test_of_two_in_one_cell_the_other_reappears() -> None:
    """Of NPCs the first is seen, of objects the last; what is in the way is so below something else too."""
    rules = [(Op.IF_EQ, Register.T, constant(1), 2), (Op.VANISH, constant(1)), (Op.VANISH, constant(4))]
    room = Assembly(
        at=((1, 1), (2, 2), (2, 2), (3, 3), (3, 3)), npcs=2, objects=("door", "lava"), rules=rules
    )
    batch = batch_of(room.program())
    assert cell_at(batch, 2, 2) == ([11, 0, 1, 0], False)
    assert cell_at(batch, 3, 3) == ([9, 0, 0, 0], True)
    play(batch, body(Body.NONE))
    assert cell_at(batch, 2, 2) == ([11, 0, 2, 0], False)
    assert cell_at(batch, 3, 3) == ([4, 0, CLOSED, 0], True)


@pytest.mark.parametrize(("thing", "look"), [("door", [4, 0, OPEN, 0]), ("lava", [9, 0, 0, 0])])
def test_the_agent_and_a_hidden_npc_in_one_cell_with_a_thing(thing: str, look: list[int]) -> None:
    """Neither changes how the cell looks; the agent's own place in the picture reads empty."""
    room = {"at": ((1, 2), (2, 2), (2, 2)), "npcs": 1, "objects": (thing,), "flags": HIDDEN, "reset": OPENED}
    batch = batch_of(Assembly(**room).program())  # type: ignore[arg-type]
    image = batch.state.image.view(np.uint8).reshape(7, 7, 4)
    assert image[3, 5].tolist() == look
    play(batch, body(Body.FORWARD))
    assert entity(batch, 0, *POSE) == [2, 2, 0]
    assert image[3, 6].tolist() == [1, 0, 0, 0]
    assert cell_at(batch, 2, 2) == (look, False)
    play(batch, body(Body.FORWARD), body(Body.RIGHT), body(Body.RIGHT))
    assert image[3, 5].tolist() == look, "turned round, it sees the thing again"


def test_lava_under_a_hidden_npc_is_deadly() -> None:
    room = {"at": ((1, 2), (2, 2), (2, 2)), "npcs": 1, "objects": ("lava",), "flags": HIDDEN, "deadly": True}
    batch = batch_of(Assembly(**room).program())  # type: ignore[arg-type]
    play(batch, body(Body.FORWARD))
    assert batch.state.registers[0, Register.OUTCOME] == 2


def test_what_is_perceived_comes_before_anything_else_of_a_turn_even_of_one_without_rules() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    frames = (
        FrameSpec(1, ([*noting(own, 3), *FORWARD],), first=({-1: noting(own, 2)},), perceive=noting(own, 1)),
        FrameSpec(1, ([],), perceive=noting(own, 4)),
    )
    batch = batch_of(Assembly(at=((1, 1), (2, 2)), npcs=1, frames=frames).program())
    play(batch, body(Body.NONE))
    assert batch.state.registers[0, own] == 1234


def test_the_scripted_agent_defers_too() -> None:
    own = Assembly(at=((2, 2),)).own
    frame = FrameSpec(
        0,
        ([],),
        first=({-1: [(Op.BODY, constant(Body.RIGHT))]},),
        deferred=noting(own, 1),
        perceive=noting(own, 2),
    )
    batch = batch_of(Assembly(at=((2, 2),), frames=(frame,), flags=int(Flag.AGENT_FRAME)).program())
    batch.script()
    assert batch.ports.actions[0, 0] == Body.RIGHT
    assert batch.state.registers[0, own] == 0
    play(batch, body(Body.RIGHT))
    assert batch.state.registers[0, own] == 21


def test_what_moves_by_itself_moves_in_the_look_ahead_of_the_script_too() -> None:
    """What the agent says may depend on it, and everything is put back."""
    at = ((2, 2), (2, 3))
    marble_x = entity_register(1, Field.X)
    say = [
        (Op.IF_EQ, marble_x, constant(3), 2),
        (Op.SAY, constant(0), constant(1)),
        (Op.SKIP, 0, 0, 1),
        (Op.SAY, constant(0), constant(0)),
    ]
    frame = FrameSpec(0, ([(Op.BODY, constant(Body.NONE))],), then=({-1: say},))
    room = Assembly(
        at=at,
        objects=("marble",),
        frames=(frame,),
        flags=int(Flag.AGENT_FRAME | Flag.ROLLS),
        reset=[(Op.LOAD, entity_register(1, Field.STATUS), constant(1))],
        lines=tuple((f"line{i}", (2,), 1) for i in range(6)),
        agent_says=1,
    )
    batch = batch_of(room.program())
    before, board = batch.state.registers.copy(), batch.state.boards.copy()
    batch.script()
    assert batch.ports.actions[0].tolist() == [7, 1, 0, 1]
    assert np.array_equal(batch.state.registers, before)
    assert np.array_equal(batch.state.boards, board)


@pytest.mark.parametrize("before", [0, 1], ids=["as the whole activity", "behind another instruction"])
def test_an_action_is_drawn_among_those_in_a_word(before: int) -> None:
    # Right twice, so that it has two chances of four; then forward, then nothing.
    word = Body.RIGHT | Body.RIGHT << 4 | Body.FORWARD << 8 | Body.NONE << 12
    activity = [(Op.LOAD, temporary(0), constant(0))] * before + [(Op.CHOOSE, word, 4, 0)]
    room = Assembly(
        at=((1, 1), (2, 3)), npcs=1, frames=(FrameSpec(1, (activity,)),), sites=((draws.site("b"), 3),)
    )
    batch = batch_of(room.program(), rows=200)
    play(batch, body(Body.NONE))
    chosen = batch.state.registers[:, entity_register(1, Field.LAST)]
    expected = [
        word >> 4 * draws.below(draws.draw(draws.episode_key(7, i, 0), draws.site("b"), 1, 3), 4) & 15
        for i in range(200)
    ]
    assert chosen.tolist() == expected
    assert {*expected} == {Body.RIGHT, Body.FORWARD, Body.NONE}


@pytest.mark.parametrize("before", [0, 1], ids=["as the whole activity", "behind another instruction"])
@pytest.mark.parametrize(
    ("place", "turned"),
    [((4, 3), {Body.NONE}), ((2, 5), {Body.RIGHT}), ((2, 1), {Body.LEFT}), ((1, 3), {Body.LEFT, Body.RIGHT})],
    ids=["ahead", "to the right", "to the left", "behind"],
)
def test_one_who_faces_somebody_makes_a_quarter_turn(
    before: int, place: tuple[int, int], turned: set[Body]
) -> None:
    activity = [(Op.LOAD, temporary(0), constant(0))] * before + [(Op.FACE, constant(1), constant(0), 0)]
    room = Assembly(
        at=(place, (2, 3)), npcs=1, frames=(FrameSpec(1, (activity,)),), sites=((draws.site("b"), 3),)
    )
    batch = batch_of(room.program(), rows=50)
    last = batch.state.registers[:, entity_register(1, Field.LAST)]
    play(batch, body(Body.NONE))
    assert {*last.tolist()} == turned
    batch.state.registers[:, entity_register(0, Field.GONE)] = 1
    play(batch, body(Body.NONE))
    assert {*last.tolist()} == {Body.NONE}, "there is nobody to face"


def test_a_turn_shows_the_lowest_npc_of_its_cell() -> None:
    turning = FrameSpec(2, ([(Op.BODY, constant(Body.LEFT))],))
    batch = batch_of(Assembly(at=((1, 1), (2, 3), (2, 3)), npcs=2, frames=(turning,)).program())
    before = batch.state.boards.copy()
    play(batch, body(Body.NONE))
    assert entity(batch, 2, Field.DIR) == [3]
    assert np.array_equal(batch.state.boards, before), "the other one stands in front of it"


ANSWER_AND_GO = (Op.ANSWER, 2, constant(1), 0 << 8 | 2)
"""Counter 2, line 1, the frame's second state."""


@pytest.mark.parametrize(
    "through",
    [[], [(Op.IF_LE, constant(0), Register.T, 0)], [(Op.LOAD, temporary(0), constant(0))]],
    ids=["alone", "behind a comparison", "in code"],
)
def test_an_answer_counts_says_and_goes_on(through: list[tuple[int, ...]]) -> None:
    """What is an answer but for comparisons `conclude` takes itself; behind anything else the interpreter does."""
    frame = FrameSpec(1, ([], []), then=({-1: [*through, ANSWER_AND_GO]}, {}))
    lines = (("hello", (2,), 1), ("bye", (3,), 1))
    batch = batch_of(Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(frame,), lines=lines).program())
    play(batch, body(Body.NONE), body(Body.NONE))
    registers = batch.state.registers[0]
    assert batch.counters[2] == 1, "the second state has no rule"
    assert batch.state.tokens[0][:2].tolist() == [3, 0]
    assert registers[Register.HEARD] == 0
