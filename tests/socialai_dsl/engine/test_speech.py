"""Who hears what, and what is remembered of it."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import pytest

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.program import Flag, Header, Op, Register
from tests.assembly import HIDDEN, Assembly, FrameSpec, batch_of, constant

SILENT = (7, 0, 0, 0)
SPEAK = (7, 1, 0, 1)  # class 2 of the assembly's grammar
NOTHING_SPECIAL = (7, 1, 1, 0)  # class 1


def play(batch: Batch, *actions: tuple[int, ...]) -> None:
    for action in actions:
        batch.ports.actions[:] = action
        batch.step(Task.STEP_ONLY)


def say(line: int) -> list[tuple[int, ...]]:
    return [(Op.SAY, constant(1), constant(line))]


def logged(room: Assembly, batch: Batch) -> list[int]:
    program = room.program()
    log, registers = program.header(Header.LOG), batch.state.registers[0]
    places = int(registers[Register.OLDEST]) + np.arange(int(registers[Register.LOGGED]))
    return registers[log + places % program.header(Header.LOG_SIZE)].tolist()


@pytest.mark.parametrize(
    ("action", "answer"), [(SILENT, 0), (SPEAK, 2), (NOTHING_SPECIAL, 1), ((7, 1, 1, 2), 4)]
)
def test_the_agents_words_come_by_class(action: tuple[int, ...], answer: int) -> None:
    own = Assembly(at=((1, 1), (2, 1)), npcs=1).own
    then = {heard: [(Op.LOAD, own, constant(heard))] for heard in range(6)}
    batch = batch_of(
        Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(FrameSpec(1, ([],), then=(then,)),)).program()
    )
    play(batch, action)
    assert batch.state.registers[0, own] == answer
    play(batch, SILENT)
    assert batch.state.registers[0, own] == 0, "what was heard is forgotten after the turn"


@pytest.mark.parametrize(
    ("earshot", "heard"), [((0, 1), False), ((0, 2), True), ((3, 9), False), ((2, 2), True)]
)
def test_earshot_is_a_range_of_distances(earshot: tuple[int, int], heard: bool) -> None:
    own = Assembly(at=((1, 1), (2, 2)), npcs=1).own
    frame = FrameSpec(1, ([],), then=({2: [(Op.LOAD, own, constant(1)), *say(0)]},))
    room = Assembly(at=((1, 1), (2, 2)), npcs=1, frames=(frame,), lines=(("hi", (2,), 1),), earshot=earshot)
    batch = batch_of(room.program())
    play(batch, SPEAK)
    assert bool(batch.state.registers[0, own]) == heard
    assert bool(batch.state.registers[0, Register.HEARD]) == heard


def test_several_different_utterances_are_the_class_of_many() -> None:
    own = Assembly(at=((1, 1), (2, 1), (2, 2)), npcs=2).own
    # NPC 1 repeats class 3 or class 2 to NPC 2, who has heard the agent say class 2 already.
    talker = FrameSpec(
        1, ([],), then=({2: [(Op.IF_EQ, Register.T, constant(1), 2), *say(0), (Op.SKIP, 0, 0, 1), *say(1)]},)
    )
    many = 5
    listener = FrameSpec(
        2,
        ([],),
        then=(
            {
                many: [
                    (Op.IF_HEARD, Assembly(at=((1, 1),) * 3, npcs=2).inbox_register(2, frames=2), 3, 1),
                    (Op.LOAD, own, constant(30)),
                ],
                2: [(Op.LOAD, own, constant(20))],
            },
        ),
    )
    lines = (("three", (2,), 3), ("two", (3,), 2))
    batch = batch_of(
        Assembly(
            at=((1, 1), (2, 1), (2, 2)), npcs=2, frames=(talker, listener), lines=lines, earshot=(0, 9)
        ).program()
    )
    play(batch, SPEAK)
    assert batch.state.registers[0, own] == 30
    play(batch, SPEAK)
    assert batch.state.registers[0, own] == 20, "the same class twice is that class"


def test_npcs_before_the_speaker_hear_it_in_the_next_step() -> None:
    own = Assembly(at=((1, 1), (2, 1), (2, 2)), npcs=2).own
    listener = FrameSpec(1, ([],), then=({3: [(Op.LOAD, own, Register.T)]},))
    talker = FrameSpec(2, ([],), then=({-1: [(Op.IF_EQ, Register.T, constant(2), 1), *say(0)]},))
    room = Assembly(
        at=((1, 1), (2, 1), (2, 2)),
        npcs=2,
        frames=(listener, talker),
        lines=(("x", (2,), 3),),
        earshot=(0, 9),
    )
    batch = batch_of(room.program())
    play(batch, SILENT, SILENT)
    assert batch.state.registers[0, own] == 0
    play(batch, SILENT, SILENT)
    assert batch.state.registers[0, own] == 3


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


@pytest.mark.parametrize(("flags", "audible", "heard"), [(0, (), 1), (HIDDEN, (), 0), (HIDDEN, (1,), 1)])
def test_hidden_npcs_are_silent_unless_audible(flags: int, audible: tuple[int, ...], heard: int) -> None:
    frame = FrameSpec(1, ([],), then=({-1: say(0)},))
    room = Assembly(
        at=((1, 1), (2, 1)), npcs=1, frames=(frame,), lines=(("x", (2,), 1),), flags=flags, audible=audible
    )
    batch = batch_of(room.program())
    play(batch, SILENT)
    assert batch.state.registers[0, Register.HEARD] == heard


def test_only_the_first_line_of_a_turn_counts() -> None:
    frame = FrameSpec(1, ([],), first=({-1: say(1)},), then=({-1: say(0)},))
    room = Assembly(at=((1, 1), (2, 1)), npcs=1, frames=(frame,), lines=(("x", (2,), 1), ("y", (3,), 1)))
    batch = batch_of(room.program())
    play(batch, SILENT)
    assert logged(room, batch) == [1]


def test_the_agent_hears_its_own_voice_where_it_does() -> None:
    lines = tuple((f"line{i}", (2 + i,), 1) for i in range(6))
    room = Assembly(lines=lines, flags=int(Flag.OWN_VOICE), agent_says=1)
    batch = batch_of(room.program())
    play(batch, (7, 1, 1, 2), SILENT, (7, 1, 0, 1))
    assert logged(room, batch) == [5, 1]
    assert batch.state.tokens[0, :3].tolist() == [7, 3, 0]


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


def hearing(*rules: tuple[int, ...], **more: object) -> tuple[Assembly, FrameSpec]:
    """A listener, entity 2, whose `then` runs some code; entity 1 speaks in the step before, line 0 then line 1."""
    speaker = [(Op.SAY, constant(1), Register.T)]
    frames = (FrameSpec(1, ([],), then=({-1: speaker},)), FrameSpec(2, ([],), then=({-1: list(rules)},)))
    lines = (("zero", (2,), 1), ("one", (2,), 3), ("two", (3,), 40), ("three", (4,), 2))
    room = Assembly(
        at=((1, 1), (2, 1), (2, 2)),
        npcs=2,
        frames=frames,
        lines=lines,
        line_nouns=(-1, -1, 2, 1),
        earshot=(0, 9),
        flags=int(Flag.HEARD_BY),
        classes=(1, 2, 3, 1, 1, 41),
        class_sets=((2,), (3, 40), (33, 35)),
        **more,  # type: ignore[arg-type]
    )
    return room, frames[1]


def test_who_said_it_and_which_noun_was_in_it() -> None:
    own = Assembly(at=((1, 1),) * 3).own
    room, _ = hearing(
        *[(Op.HEARD_FROM, own + 2 * k, 0, k) for k in range(3)],
        *[(Op.HEARD_NOUN, own + 2 * k + 1, 0, k) for k in range(3)],
    )
    inbox = room.inbox_register(2, 2)
    code = [(op, a, inbox, c) for op, a, _, c in room.frames[1].then[0][-1]]
    room, _ = hearing(*code)
    batch = batch_of(room.program())

    def heard() -> list[int]:
        return batch.state.registers[0, room.own : room.own + 6].tolist()

    play(batch, SILENT)
    assert heard() == [-1, -1, 1, -1, -1, -1], "the NPC, without a noun"
    play(batch, (7, 1, 0, 1))
    assert heard() == [0, 1, 1, 2, -1, -1], "the agent of class 2, then the NPC of class 40"
    play(batch, SILENT)
    assert heard() == [1, 1, -1, -1, -1, -1]
    play(batch, (7, 1, 0, 2))
    assert heard() == [-1, -1, 0, 2, -1, -1], "the agent of class 3; what was heard before is forgotten"
    assert not batch.state.registers[0, inbox : inbox + 13].any()


def test_the_first_of_several_entries_counts() -> None:
    own = Assembly(at=((1, 1),) * 3).own
    room, _ = hearing()
    inbox = room.inbox_register(2, 2)
    room, _ = hearing(
        (Op.HEARD_FROM, own, inbox, 1), (Op.IF_HEARD, inbox, 40, 1), (Op.LOAD, own + 1, constant(5))
    )
    batch = batch_of(room.program())
    play(batch, SILENT, (7, 1, 0, 2))
    assert batch.state.registers[0, [room.own, room.own + 1]].tolist() == [0, 5], "the agent spoke first"
