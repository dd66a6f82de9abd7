"""What bodies do, and in which order an NPC notices, acts, concludes and speaks."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.kernel import Task
from socialai_dsl.program import Body, Field, Flag, Op, Register
from tests.assembly import (
    CLOSED,
    HIDDEN,
    LOCKED,
    OPEN,
    Assembly,
    FrameSpec,
    batch_of,
    constant,
    entity_register,
)


def play(batch: Batch, *actions: tuple[int, ...]) -> None:
    for action in actions:
        batch.ports.actions[:] = action
        batch.step(Task.STEP_ONLY)


def body(action: Body) -> tuple[int, ...]:
    return int(action), 0, 0, 0


def entity(batch: Batch, number: int, *fields: Field) -> list[int]:
    return [int(batch.state.registers[0, entity_register(number, name)]) for name in fields]


POSE = (Field.X, Field.Y, Field.DIR)


def test_the_agent_turns_and_walks() -> None:
    batch = batch_of(Assembly(at=((2, 2),)).program())
    play(batch, body(Body.RIGHT))
    assert entity(batch, 0, *POSE) == [2, 2, 1]
    play(batch, body(Body.LEFT), body(Body.LEFT))
    assert entity(batch, 0, *POSE) == [2, 2, 3]
    play(batch, body(Body.FORWARD))
    assert entity(batch, 0, *POSE) == [2, 1, 3]
    play(batch, body(Body.FORWARD), body(Body.PICKUP), body(Body.DROP), body(Body.DONE))
    assert entity(batch, 0, *POSE) == [2, 1, 3], "a wall stops it, and the rest does nothing"
    assert entity(batch, 0, Field.LAST) == [Body.DONE]
    assert batch.state.registers[0, Register.ACTION] == Body.DONE


@pytest.mark.parametrize(("flags", "x"), [(0, 2), (HIDDEN, 3)])
def test_only_shown_npcs_block_the_agent(flags: int, x: int) -> None:
    batch = batch_of(Assembly(at=((2, 2), (3, 2)), npcs=1, flags=flags).program())
    play(batch, body(Body.FORWARD))
    assert entity(batch, 0, Field.X) == [x]


def test_toggling_things() -> None:
    batch = batch_of(Assembly(at=((1, 2), (0, 2)), objects=("door",), facing=(2,)).program())
    for status in (OPEN, CLOSED, OPEN):
        play(batch, body(Body.TOGGLE))
        assert entity(batch, 1, Field.STATUS) == [status]
        assert batch.state.registers[0, Register.POKED] == 1
    play(batch, body(Body.FORWARD), body(Body.FORWARD))
    assert entity(batch, 0, *POSE) == [0, 2, 2], "through the door, and not off the canvas"
    assert batch.state.registers[0, Register.POKED] == -1


def test_a_locked_door_stays_locked() -> None:
    locked = [(Op.LOAD, entity_register(1, Field.STATUS), constant(LOCKED))]
    batch = batch_of(Assembly(at=((1, 2), (0, 2)), objects=("door",), facing=(2,), reset=locked).program())
    play(batch, body(Body.TOGGLE))
    assert entity(batch, 1, Field.STATUS) == [LOCKED]
    assert batch.state.registers[0, Register.POKED] == 1


@pytest.mark.parametrize("flags", [0, HIDDEN])
def test_poking_an_npc_hidden_or_not(flags: int) -> None:
    batch = batch_of(Assembly(at=((2, 2), (3, 2)), npcs=1, flags=flags).program())
    play(batch, body(Body.TOGGLE))
    assert batch.state.registers[0, Register.POKED] == 1
    play(batch, body(Body.NONE))
    assert batch.state.registers[0, Register.POKED] == -1
    assert entity(batch, 1, Field.POKED) == [1], "for the rest of the episode"


def npc_program(activity: list[tuple[int, ...]], **room: object) -> Batch:
    frames = (FrameSpec(1, (activity,)),)
    return batch_of(Assembly(npcs=1, frames=frames, **room).program())  # type: ignore[arg-type]


FORWARD = [(Op.BODY, constant(Body.FORWARD))]


@pytest.mark.parametrize(
    ("room", "x"),
    [
        ({"at": ((1, 1), (2, 2))}, 3),
        ({"at": ((3, 2), (2, 2))}, 2),
        ({"at": ((3, 2), (2, 2)), "flags": HIDDEN}, 2),
        ({"at": ((1, 1), (2, 2), (3, 2)), "objects": ("door",)}, 2),
        ({"at": ((1, 1), (2, 2), (3, 2)), "objects": ("lava",)}, 3),
        ({"at": ((1, 1), (2, 2), (3, 2)), "objects": ("lava",), "deadly": True}, 2),
    ],
)
def test_npcs_never_enter_what_is_taken_solid_or_deadly(room: dict[str, object], x: int) -> None:
    batch = npc_program(FORWARD, **room)
    play(batch, body(Body.NONE))
    assert entity(batch, 1, Field.X, Field.LAST) == [x, Body.FORWARD]


def test_the_board_follows_the_npc() -> None:
    batch = npc_program(FORWARD, at=((1, 1), (1, 2)))
    for x in (2, 3, 3):
        play(batch, body(Body.NONE))
        cells = batch.state.boards[0, :42].reshape(7, 6) & 0xFF
        assert np.argwhere(cells == 11).tolist() == [[2, x]]


def test_npcs_toggle_things() -> None:
    batch = npc_program([(Op.BODY, constant(Body.TOGGLE))], at=((1, 1), (1, 2), (2, 2)), objects=("door",))
    play(batch, body(Body.NONE))
    assert entity(batch, 2, Field.STATUS) == [OPEN]
    assert batch.state.registers[0, Register.POKED] == -1, "that is for what the agent uses"


def noting(own: int, digit: int, base: int = 10) -> list[tuple[int, ...]]:
    """Code that appends a digit to a register."""
    return [(Op.MUL, own, own, constant(base)), (Op.ADD, own, own, constant(digit))]


def test_first_activity_then_and_clock() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    room = Assembly(
        at=((1, 1), (2, 2)),
        npcs=1,
        settle=noting(own, 4, 5),
        flags=int(Flag.SETTLE_ALWAYS),
        frames=(
            FrameSpec(
                1,
                ([*noting(own, 2, 5), (Op.BODY, constant(Body.RIGHT))],),
                first=({-1: noting(own, 1, 5)},),
                then=({-1: noting(own, 3, 5)},),
            ),
        ),
    )
    clock = room.state_register(0) + 1
    batch = batch_of(room.program())
    batch.state.registers[0, own] = 0
    play(batch, body(Body.NONE))
    # Settled: after the agent, after the NPC's body, at the end.
    assert batch.state.registers[0, own] == int("412434", 5)
    assert batch.state.registers[0, clock] == 1
    assert entity(batch, 1, Field.DIR) == [1]


def test_goto_in_first_runs_the_new_states_activity_and_restarts_the_clock() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    room = Assembly(
        at=((1, 1), (2, 2)),
        npcs=1,
        frames=(
            FrameSpec(
                1,
                ([(Op.BODY, constant(Body.LEFT))], [(Op.BODY, constant(Body.RIGHT))]),
                first=({-1: [(Op.IF_EQ, Register.T, constant(3), 1), (Op.GOTO, 0, 1)]},),
                then=({-1: noting(own, 1)}, {-1: noting(own, 2)}),
            ),
        ),
    )
    state = room.state_register(0)
    batch = batch_of(room.program())
    play(batch, *[body(Body.NONE)] * 2)
    assert batch.state.registers[0, [state, state + 1, own]].tolist() == [0, 2, 11]
    play(batch, body(Body.NONE))
    assert batch.state.registers[0, [state, state + 1, own]].tolist() == [1, 1, 112]
    assert entity(batch, 1, Field.DIR) == [3], "left, left, right"


def test_a_first_rule_with_its_own_action_takes_the_whole_turn() -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    frame = FrameSpec(
        1,
        ([(Op.BODY, constant(Body.LEFT))],),
        first=({-1: [(Op.BODY, constant(Body.RIGHT))]},),
        then=({-1: noting(own, 1)},),
    )
    room = Assembly(at=((1, 1), (2, 2)), npcs=1, frames=(frame,))
    batch = batch_of(room.program())
    play(batch, body(Body.NONE))
    assert entity(batch, 1, Field.DIR) == [1]
    assert batch.state.registers[0, [own, room.state_register(0) + 1]].tolist() == [0, 1]


def test_npcs_act_in_order_and_see_what_those_before_did() -> None:
    frames = (FrameSpec(1, (FORWARD,)), FrameSpec(2, (FORWARD,)))
    follow = batch_of(Assembly(at=((1, 1), (2, 2), (1, 2)), npcs=2, frames=frames).program())
    play(follow, body(Body.NONE))
    assert [entity(follow, n, Field.X)[0] for n in (1, 2)] == [3, 2]
    blocked = batch_of(Assembly(at=((1, 1), (1, 2), (2, 2)), npcs=2, frames=frames).program())
    play(blocked, body(Body.NONE))
    assert [entity(blocked, n, Field.X)[0] for n in (1, 2)] == [1, 3]


def test_who_left_the_room_does_nothing() -> None:
    batch = npc_program(FORWARD, at=((1, 1), (2, 2)), reset=[(Op.VANISH, constant(1))])
    play(batch, body(Body.NONE))
    assert entity(batch, 1, Field.X) == [2]
    play(batch, body(Body.RIGHT), body(Body.FORWARD), body(Body.LEFT), body(Body.FORWARD), body(Body.FORWARD))
    assert entity(batch, 0, *POSE) == [3, 2, 0], "it blocks nobody"


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
    before = [array.copy() for array in (*batch.state, batch.ports.counters)]
    batch.script()
    assert batch.ports.actions.tolist() == [[Body.TOGGLE, 1, 1, 1]] * 3, "pair 4 is template 1, noun 1"
    for was, now in zip(before, (*batch.state, batch.ports.counters), strict=True):
        np.testing.assert_array_equal(was, now)
    batch.ports.actions[:] = (2, 0, 0, 0)
    batch.step(Task.STEP_ONLY)
    assert batch.state.registers[0, own] == 12, "in a step the frame's effects happen"
    assert entity(batch, 0, Field.LAST) == [Body.FORWARD], "but its body does what the action says"
    assert batch.state.registers[0, Register.TEMPLATE] == -1, "and it says what the action says"
    assert batch.state.registers[0, Register.SAID_LINE] == 0
