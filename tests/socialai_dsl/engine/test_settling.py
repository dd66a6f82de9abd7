"""When the code runs that lets statuses follow from others, and in which order everything in a step happens."""

from __future__ import annotations

import numpy as np
import pytest

from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Body, Field, Flag, Op, Register
from socialai_dsl.widths import REGISTER, UNPINNED
from tests.assembly import (
    CLOSED,
    LOCKED,
    OPEN,
    Assembly,
    FrameSpec,
    Instruction,
    batch_of,
    constant,
    entity_register,
    step,
)

SILENT = (7, 0, 0, 0)
TOGGLE = (int(Body.TOGGLE), 0, 0, 0)
ALWAYS = int(Flag.SETTLE_ALWAYS)
EARLY = int(Flag.PICTURE_BEFORE_NPCS)


def note(register: int, digit: int) -> list[Instruction]:
    """Append a digit to a trace that is kept in three registers, five digits of base 8 in each."""
    return [
        instruction
        for k in range(3)
        for instruction in (
            (Op.IF_LT, register + k, constant(8**4), 3),
            (Op.MUL, register + k, register + k, constant(8)),
            (Op.ADD, register + k, register + k, constant(digit)),
            (Op.SKIP, 0, 0, 4 * (2 - k)),
        )
    ]


def trace(batch: Batch, register: int) -> str:
    return "".join(f"{int(batch.state.registers[0, register + i]):o}".strip("0") for i in range(3))


# The agent at (1, 2) looks at a door in the left wall; an NPC far from it.
AT = ((1, 2), (3, 3), (0, 2))
DOOR = {"at": AT, "npcs": 1, "objects": ("door",), "facing": (2,)}
OWN = Assembly(**DOOR).own  # type: ignore[arg-type]
BEFORE, FIRST, ACTIVITY, THEN, LINKS, SETTLE, RULES = range(1, 8)


def traced(flags: int = 0, **room: object) -> Batch:
    frame = FrameSpec(
        1,
        ([*note(OWN, ACTIVITY)],),
        first=({-1: note(OWN, FIRST)},),
        then=({-1: note(OWN, THEN)},),
    )
    assembly = {
        **DOOR,
        "frames": (frame,),
        "before": note(OWN, BEFORE),
        "links": note(OWN, LINKS),
        "settle": note(OWN, SETTLE),
        "rules": note(OWN, RULES),
        "flags": flags,
        **room,
    }
    batch = batch_of(Assembly(**assembly).program())  # type: ignore[arg-type]
    assert trace(batch, OWN) == "56", "a reset settles once, links first"
    batch.state.registers[0, OWN] = 0
    return batch


@pytest.mark.parametrize(
    ("flags", "action", "expected"),
    [
        (0, SILENT, "12347"),
        (0, TOGGLE, "1562347"),
        (EARLY, TOGGLE, "1562347"),
        (ALWAYS, SILENT, "15623564756"),
        (ALWAYS | EARLY, SILENT, "15623564756"),
        (ALWAYS, TOGGLE, "15623564756"),
    ],
)
def test_the_order_of_a_step(flags: int, action: tuple[int, ...], expected: str) -> None:
    """Before; body, links, settle; each NPC's first, activity, settle, then; rules, settle."""
    batch = traced(flags)
    step(batch, action)
    assert trace(batch, OWN) == expected


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ((Op.BECOME, constant(2), constant(LOCKED)), "56"),
        ((Op.BECOME, constant(2), constant(CLOSED)), ""),
        ((Op.VANISH, constant(2)), "56"),
        ((Op.SET_FIELD, constant(2), Field.COLOR, constant(2)), ""),
    ],
)
def test_what_counts_as_a_change(rule: Instruction, expected: str) -> None:
    batch = traced(frames=(), rules=[rule], before=())
    step(batch)
    assert trace(batch, OWN) == expected
    batch.state.registers[0, OWN : OWN + 3] = 0
    step(batch)
    assert trace(batch, OWN) == "", "once"


def test_toggling_what_ignores_it_is_no_change() -> None:
    lock = [(Op.LOAD, entity_register(2, Field.STATUS), constant(LOCKED))]
    batch = traced(frames=(), before=(), rules=(), reset=lock)
    step(batch, TOGGLE)
    assert trace(batch, OWN) == ""


def test_before_sees_the_last_step() -> None:
    """The step has not begun: t, what was done, said and heard are those of the last one."""
    own = Assembly(at=((1, 1), (2, 1)), npcs=1).own
    asked = (Register.T, Register.ACTION, Register.NOUN, Register.UTTERANCE, Register.HEARD, Register.POKED)
    frame = FrameSpec(1, ([],), then=({-1: [(Op.SAY, constant(1), constant(0))]},))
    room = Assembly(
        at=((1, 1), (2, 1)),
        npcs=1,
        frames=(frame,),
        lines=(("hello", (2,), 1),),
        before=[(Op.LOAD, own + i, register) for i, register in enumerate(asked)],
    )
    batch = batch_of(room.program())
    step(batch, (int(Body.TOGGLE), 1, 1, 1))
    assert batch.state.registers[0, own : own + 6].tolist() == [0, Body.NONE, -1, 0, 0, -1]
    step(batch)
    assert batch.state.registers[0, own : own + 6].tolist() == [1, Body.TOGGLE, 1, 5, 1, 1]
    assert batch.state.registers[0, Register.UTTERANCE] == 0


@pytest.mark.parametrize(("template", "noun"), [(0, 0), (0, 2), (1, 0), (1, 2)])
def test_utterances_are_numbered(template: int, noun: int) -> None:
    batch = batch_of(Assembly().program())
    step(batch, (7, 1, template, noun))
    assert batch.state.registers[0, Register.UTTERANCE] == 1 + 3 * template + noun
    step(batch, (7, 0, template, noun))
    assert batch.state.registers[0, Register.UTTERANCE] == 0


# A lever would unlock: here an open door at (0, 2) lets the locked one at (4, 2) become closed.
LINKED = {
    "at": ((1, 2), (0, 2), (2, 0)),
    "objects": ("door", "door"),
    "facing": (2,),
    "links": [
        (Op.IF_EQ, entity_register(1, Field.STATUS), constant(OPEN), 2),
        (Op.IF_EQ, entity_register(2, Field.STATUS), constant(LOCKED), 1),
        (Op.BECOME, constant(2), constant(CLOSED)),
    ],
    "reset": [(Op.LOAD, entity_register(2, Field.STATUS), constant(LOCKED))],
}


def statuses(batch: Batch) -> list[int]:
    return [int(batch.state.registers[0, entity_register(n, Field.STATUS)]) for n in (1, 2)]


def test_an_early_picture_is_taken_before_anything_is_said() -> None:
    """What a scripted agent does in `then` is not in it either."""
    frame = FrameSpec(0, ([],), then=({-1: [(Op.BECOME, constant(1), constant(LOCKED))]},))
    room = {"at": ((1, 2), (0, 2)), "objects": ("door",), "facing": (2,), "frames": (frame,)}
    flags = int(Flag.AGENT_FRAME) | EARLY
    batch = batch_of(Assembly(flags=flags, **room).program())  # type: ignore[arg-type]
    for status in (CLOSED, LOCKED):
        step(batch)
        assert batch.state.image.view(np.uint8).reshape(7, 7, 4)[3, 5].tolist() == [4, 0, status, 0]


def test_a_lock_that_a_link_undoes_comes_and_goes_as_if_settled_without_end() -> None:
    """What settling itself changes is looked at again next time, so skipping where nothing changed shows nowhere."""
    settle = [
        (Op.IF_EQ, entity_register(2, Field.STATUS), constant(CLOSED), 1),
        (Op.BECOME, constant(2), constant(LOCKED)),
    ]
    own = Assembly(at=LINKED["at"]).own  # type: ignore[arg-type]
    count = [(Op.ADD, own, own, constant(1))]
    links = [*LINKED["links"], *count]  # type: ignore[misc]
    batch = batch_of(Assembly(**{**LINKED, "settle": settle, "links": links}).program())  # type: ignore[arg-type]
    step(batch, TOGGLE)
    assert statuses(batch) == [OPEN, LOCKED]
    before = int(batch.state.registers[0, own])
    step(batch)
    assert batch.state.registers[0, own] == before + 2, "after the agent, and after the rules"
    assert statuses(batch) == [OPEN, LOCKED]


def test_pins_are_settled() -> None:
    batch = batch_of(Assembly(**LINKED).program())  # type: ignore[arg-type]
    pins = np.full((2, batch.state.registers.shape[1] + 1), UNPINNED, REGISTER)
    pins[1, entity_register(1, Field.STATUS)] = OPEN
    batch.ports.layout[:] = 1
    batch.reset(pins)
    assert statuses(batch) == [OPEN, CLOSED]
    line = batch.state.boards[0, :42].reshape(7, 6)
    assert line[0, 2] >> 16 & 0xFF == CLOSED


def test_a_scripted_look_disturbs_nothing() -> None:
    """Code that runs before a step, links and settling run for it, and all of it is taken back."""
    at = (*LINKED["at"], (3, 3))  # type: ignore[misc]
    own = Assembly(at=at).own
    frame = FrameSpec(
        0,
        (
            [
                # It toggles once what was noted before the step says so.
                (Op.BODY, constant(Body.TOGGLE)),
                (Op.IF_EQ, own + 2, constant(0), 1),
                (Op.BODY, constant(Body.NONE)),
            ],
        ),
        then=({-1: [(Op.VANISH, constant(1))]},),
    )
    room = {
        **LINKED,
        "at": at,
        "objects": ("door", "door", "lava"),
        "frames": (frame,),
        "flags": int(Flag.AGENT_FRAME) | ALWAYS,
        "before": [(Op.LOAD, own + 2, constant(1)), (Op.COUNT, 0)],
        "settle": [(Op.ADD, own + 3, own + 3, constant(1))],
    }
    batch = batch_of(Assembly(**room).program(), 3)  # type: ignore[arg-type]
    batch.state.registers[:, Register.CHANGED] = (0, 1, 1)
    before = [array.copy() for array in (*batch.state, batch.counters)]
    batch.script()
    assert batch.ports.actions[:, 0].tolist() == [Body.TOGGLE] * 3
    for was, now in zip(before, (*batch.state, batch.counters), strict=True):
        np.testing.assert_array_equal(was, now)
    batch.step(Task.STEP_ONLY)
    assert batch.state.registers[:, entity_register(1, Field.GONE)].tolist() == [1] * 3
