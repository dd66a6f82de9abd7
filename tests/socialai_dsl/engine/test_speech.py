"""Who hears what, and what is remembered of it."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.state import Key
from socialai_dsl.program import Header, Op, Register
from tests.assembly import Assembly, FrameSpec, batch_of, constant, play

SILENT = (7, 0, 0, 0)


def say(line: int) -> list[tuple[int, ...]]:
    return [(Op.SAY, constant(1), constant(line))]


def logged(room: Assembly, batch: Batch) -> list[int]:
    program = room.program()
    log, registers = program.header(Header.LOG), batch.state.registers[0]
    places = int(registers[Register.OLDEST]) + np.arange(int(registers[Register.LOGGED]))
    return registers[log + places % program.header(Header.LOG_SIZE)].tolist()


def test_lines_that_no_rule_waits_for_are_not_delivered_to_npcs() -> None:
    own = Assembly(at=((1, 1), (2, 1), (2, 2)), npcs=2).own
    talker = FrameSpec(1, ([],), then=({-1: say(0)},))
    listener = FrameSpec(2, ([],), then=({1: [(Op.LOAD, own, constant(1))]},))
    room = Assembly(
        at=((1, 1), (2, 1), (2, 2)),
        npcs=2,
        frames=(talker, listener),
        lines=(("x", (2,), 1),),
        earshot=(0, 9),
    )
    batch = batch_of(room.program())
    play(batch, SILENT)
    assert batch.state.registers[0, own] == 0


def test_the_oldest_whole_lines_make_room() -> None:
    lines = (("three", (2, 3, 4), 1), ("four", (5, 6, 7, 8), 1))
    turn = [(Op.IF_EQ, Register.T, constant(3), 2), *say(1), (Op.SKIP, 0, 0, 1), *say(0)]
    room = Assembly(
        at=((1, 1), (2, 1)), npcs=1, frames=(FrameSpec(1, ([],), then=({-1: turn},)),), lines=lines, tokens=8
    )
    batch = batch_of(room.program())
    seen = []
    digest = 0
    for t in range(1, 6):
        play(batch, SILENT)
        line = 1 if t == 3 else 0
        digest = draws.mix(digest ^ ((line + 1) * draws.GOLDEN & draws.MASK))
        assert int(batch.state.keys[0, Key.DIGEST]) == digest
        seen.append((logged(room, batch), batch.state.tokens[0].tolist()))
    assert seen == [
        ([0], [2, 3, 4, 0, 0, 0, 0, 0]),
        ([0, 0], [2, 3, 4, 2, 3, 4, 0, 0]),
        ([0, 1], [2, 3, 4, 5, 6, 7, 8, 0]),
        ([1, 0], [5, 6, 7, 8, 2, 3, 4, 0]),
        ([0, 0], [2, 3, 4, 2, 3, 4, 0, 0]),
    ]


@pytest.mark.parametrize("limit", [3, 10, 16, 17, 31, 64])
@pytest.mark.parametrize("lengths", [(0, 1, 2, 5), (15, 16, 17), (4, 16, 1, 40), (1, 2, 30, 3)], ids=str)
def test_lines_of_all_lengths_in_histories_of_all_lengths(lengths: tuple[int, ...], limit: int) -> None:
    """Against lists, with other environments on either side."""
    steps = 30
    spoken = [
        tuple(2 + (7 * t + i) % 20 for i in range(length))
        for t, length in zip(range(steps + 1), cycle(lengths), strict=False)
    ]
    said = [(Op.SAY, constant(1), Register.T)]
    room = Assembly(
        at=((1, 1), (2, 1)),
        npcs=1,
        frames=(FrameSpec(1, ([],), then=({-1: said},)),),
        lines=tuple((f"line {t}", words, 1) for t, words in enumerate(spoken)),
        tokens=limit,
        log=steps + 1,
        horizon=steps + 1,
    )
    batch = batch_of(room.program(), rows=3)
    kept: list[tuple[int, ...]] = []
    for t in range(1, steps + 1):
        while kept and sum(map(len, kept)) + len(spoken[t]) > limit:
            kept.pop(0)
        kept.append(spoken[t][:limit])
        play(batch, SILENT)
        expected = [word for line in kept for word in line]
        assert batch.state.registers[:, Register.TOKENS].tolist() == [len(expected)] * 3
        assert batch.state.tokens.tolist() == [expected + [0] * (limit - len(expected))] * 3, f"step {t}"


def test_the_log_is_bounded_by_lines_too() -> None:
    room = Assembly(
        at=((1, 1), (2, 1)),
        npcs=1,
        frames=(FrameSpec(1, ([],), then=({-1: say(0)},)),),
        lines=(("", (), 1),),
        log=3,
    )
    batch = batch_of(room.program())
    play(batch, *[SILENT] * 5)
    assert logged(room, batch) == [0, 0, 0]
    assert batch.state.registers[0, Register.TOKENS] == 0
