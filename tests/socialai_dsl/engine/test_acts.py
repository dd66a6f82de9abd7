"""Members drawn by weight, suites played in acts, graded and other rewards."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key, no_pins
from socialai_dsl.program import Body, Op, Program, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import (
    Assembly,
    constant,
    part_of,
)

WON, LOST, TIMEOUT = 0, 1, 3
WIN, LOSE, WAIT = (int(Body.DONE), 0, 0, 0), (int(Body.PICKUP), 0, 0, 0), (7, 0, 0, 0)
SITE = 77


def member(number: int, horizon: int = 8, percent: int = 100, **more: object) -> Program:
    """A scenario that `done` wins and `pickup` loses; its first register is its number, its second a draw."""
    own = Assembly().own
    return Assembly(
        reset=[
            (Op.LOAD, own, constant(number)),
            (Op.DRAW, own + 1, constant(1000), 0),
        ],
        outcomes={(-1, Body.DONE): [(Op.END, WON, percent)], (-1, Body.PICKUP): [(Op.END, LOST, 0)]},
        sites=((SITE, 0),),
        horizon=horizon,
        **more,  # type: ignore[arg-type]
    ).program()


def suite(members: int, rows: int = 1, in_sequence: bool = True, seed: int = 7, **more: object) -> Batch:
    parts = [part_of(member(number, **more)) for number in range(members)]  # type: ignore[arg-type]
    batch = Batch(parts, [range(members)], [0] * rows, 8, sequences=(0,) if in_sequence else ())
    batch.state.keys[:, Key.SEED] = seed
    batch.state.keys[:, Key.INDEX] = np.arange(rows)
    batch.reset()
    return batch


def own(batch: Batch) -> list[int]:
    first = Assembly().own
    return batch.state.registers[0, first : first + 2].tolist()


def play(batch: Batch, action: tuple[int, ...], task: Task = Task.STEP_ONLY) -> tuple[float, int]:
    batch.ports.actions[:] = action
    ended = batch.step(task)
    return float(batch.ports.reward[0]), ended


def drawn(act: int, episode: int = 0) -> int:
    key = draws.act_key(draws.episode_key(7, 0, episode), act)
    return draws.below(draws.draw(key, SITE, 0, 0), 1000)


def test_the_acts_of_an_episode_follow_each_other_on_one_clock() -> None:
    batch = suite(3)
    assert own(batch) == [0, drawn(0)]
    assert play(batch, WAIT) == (0.0, 0)
    reward, ended = play(batch, WIN)
    assert (reward, ended) == (pytest.approx((1 - 0.9 * 2 / 8) / 3), 0)
    assert not batch.ports.terminated[0]
    assert batch.ports.outcome[0] == -1
    assert own(batch) == [1, drawn(1)]
    assert batch.state.registers[0, Register.T] == 2
    assert play(batch, WAIT) == (0.0, 0)
    reward, ended = play(batch, WIN)
    assert (reward, ended) == (pytest.approx((1 - 0.9 * 4 / 8) / 3), 0)
    assert own(batch) == [2, drawn(2)]
    reward, ended = play(batch, WIN)
    assert (reward, ended) == (pytest.approx((1 - 0.9 * 5 / 8) / 3), 1)
    assert batch.ports.terminated[0]
    assert batch.ports.outcome[0] == WON
    assert batch.ports.success[0]
    counters = batch.counters
    assert counters[[first + 1 + WON for first in batch.first_counters]].tolist() == [1, 1, 1]


@pytest.mark.parametrize("task", [Task.STEP_NEXT, Task.STEP_SAME])
def test_the_next_episode_begins_with_the_first_act(task: Task) -> None:
    batch = suite(2)
    play(batch, WIN, task)
    assert play(batch, WIN, task)[1] == 1
    if task == Task.STEP_NEXT:
        play(batch, WAIT, task)
    assert batch.state.keys[0, [Key.EPISODE, Key.ACT, Key.SPOILED]].tolist() == [1, 0, 0]
    assert own(batch) == [0, drawn(0, 1)]
    assert batch.state.registers[0, Register.T] == 0


def test_one_act_that_is_lost_spoils_the_episode() -> None:
    batch = suite(2)
    play(batch, LOSE)
    assert own(batch)[0] == 1, "the next is played all the same"
    assert play(batch, WIN)[1] == 1
    assert batch.ports.outcome[0] == WON
    assert not batch.ports.success[0]
    batch.reset()
    play(batch, WIN)
    assert play(batch, LOSE)[1] == 1
    assert batch.ports.outcome[0] == LOST
    assert not batch.ports.success[0]


def test_time_ends_the_episode_in_whatever_act() -> None:
    batch = suite(3, horizon=2)
    play(batch, WIN)
    assert play(batch, WAIT)[1] == 1
    assert batch.ports.truncated[0]
    assert batch.ports.outcome[0] == TIMEOUT
    batch.reset()
    play(batch, WAIT)
    reward, ended = play(batch, WIN)
    assert (reward, ended) == (pytest.approx(0.1 / 3), 1), "no time is left for the other acts"
    assert batch.ports.terminated[0]
    assert not batch.ports.success[0]
    assert batch.state.registers[0, Register.T] == 2


def test_a_layout_may_start_with_a_later_act() -> None:
    batch = suite(3)
    width = batch.state.registers.shape[1] + 1
    pins = np.concatenate([no_pins(width - 1), np.full((1, width), UNPINNED, REGISTER)])
    pins[1, -1] = 2
    batch.ports.layout[:] = 1
    batch.reset(pins)
    assert own(batch) == [2, drawn(2)]
    assert play(batch, WIN)[1] == 1


def test_acts_keep_their_history_to_themselves() -> None:
    program = member(0, lines=(("hello", (2, 3), 1),), rules=[], flags=8, agent_says=1)
    batch = Batch([part_of(program)] * 2, [[0, 1]], [0], 8, sequences=(0,))
    batch.reset()
    play(batch, (7, 1, 0, 0))
    assert batch.state.tokens[0].any()
    assert batch.state.keys[0, Key.DIGEST] != 0
    play(batch, WIN)
    assert not batch.state.tokens[0].any()
    assert batch.state.keys[0, Key.DIGEST] == 0


def test_acts_must_have_one_horizon() -> None:
    parts = [part_of(member(0, horizon=5)), part_of(member(1, horizon=6))]
    with pytest.raises(AssertionError, match="horizons"):
        Batch(parts, [[0, 1]], [0], 8, sequences=(0,))


def members_drawn(batch: Batch) -> list[int]:
    batch.reset()
    return batch.state.registers[:, Assembly().own].tolist()


@pytest.mark.parametrize("weights", [[1, 1, 1, 1], [1, 0, 5, 2], [0, 0, 0, 9], [1 << 30, 1, 1 << 31, 7]])
def test_members_are_drawn_by_weight(weights: list[int]) -> None:
    batch = suite(4, rows=200, in_sequence=False)
    uniform = members_drawn(batch)
    assert batch.weights(0) == [1, 1, 1, 1]
    batch.set_weights(0, weights)
    assert batch.weights(0) == weights
    site = draws.site("member")
    bits = [draws.draw(draws.episode_key(7, i, 0), site, 0, 0) for i in range(200)]
    assert members_drawn(batch) == [draws.choose(u, weights) for u in bits]
    assert uniform == [draws.below(u, 4) for u in bits]


@pytest.mark.parametrize("weights", [[1, 1], [1, -1, 1], [0, 0, 0], [1 << 31, 1 << 31, 0]])
def test_weights_that_are_none(weights: list[int]) -> None:
    batch = suite(3, in_sequence=False)
    with pytest.raises(ValueError, match="weights: got"):
        batch.set_weights(0, weights)
    assert batch.weights(0) == [1, 1, 1]


def test_weights_of_one_pool_leave_the_other_alone() -> None:
    parts = [part_of(member(number)) for number in range(4)]
    batch = Batch(parts, [[0, 1], [2, 3]], [0, 1] * 20, 8)
    batch.state.keys[:, Key.INDEX] = np.arange(40)
    before = members_drawn(batch)
    batch.set_weights(0, [0, 1])
    after = members_drawn(batch)
    assert after[1::2] == before[1::2]
    assert set(before[1::2]) == {2, 3}
    assert set(after[::2]) == {1}


@given(st.integers(0, draws.MASK), st.lists(st.integers(0, 9), min_size=1, max_size=9).filter(any))
def test_a_choice_has_weight(bits: int, weights: list[int]) -> None:
    assert weights[draws.choose(bits, weights)] > 0
    assert draws.choose(bits, [1] * len(weights)) == draws.below(bits, len(weights))


def test_acts_have_keys_of_their_own() -> None:
    key = draws.episode_key(1, 2, 3)
    keys = [draws.act_key(key, act) for act in range(64)]
    assert keys[0] == key
    assert len(set(keys)) == 64
    assert not set(keys[1:]) & {draws.attempt_key(key, attempt) for attempt in range(64)}
