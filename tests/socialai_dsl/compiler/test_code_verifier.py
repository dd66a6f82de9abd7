"""What the verifier proves about cells, boards, loops and the code at each entry: mutants of a small program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.compiler.tables import InvalidProgramError, verify
from socialai_dsl.program import (
    BOARDS,
    CELL,
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    Body,
    EntityColumn,
    Field,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
    TypeColumn,
)
from tests.tiny import Folder

Code = Sequence[tuple[int, ...]]
RESET, RULES, REQUIRE = Header.RESET_PC, Header.RULES_PC, Header.REQUIRE_PC


def const(value: int) -> int:
    return CONSTANT + value


def temp(index: int) -> int:
    return TEMPORARY + index


def cell(x: int, y: int) -> int:
    return const(CELL + 32 * y + x)


SCENARIO = """
scenario: workbench
horizon: 20
earshot: room
actions: [left, right, forward, toggle]
grammar: {templates: [Go <noun>, Look <noun>], nouns: [up, down]}
room: {size: 7}
objects:
  door: {type: door, at: [6, 2], color: red}
  box: {type: ball, at: [3, 3], color: blue}
  switches: {type: switch, at: [[1, 0], [2, 0]], color: green}
let:
  die: pick(0 | 1 | 2 | 3)
  lucky: pick(box | door)
  n: pick(0..5)
require: [die < 3]
cast:
  guide: {at: [4, 3], facing: left, color: red, frame: idle}
  statue: {at: [4, 5], facing: up, color: red}
  agent: {at: [2, 3], facing: right, color: red}
frames:
  idle: {states: {waiting: {do: stay}}}
outcome:
  - success: agent.at(door)
"""
GUIDE = 1


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Program:
    """A program with code at three entries, each replaced by a test."""
    found = sd.compile(sd.load(Folder(tmp_path_factory.mktemp("verifier")).save("workbench", SCENARIO)))
    assert isinstance(found, Program)
    return found


def with_code(program: Program, entry: Header, code: Code) -> Program:
    """The program with this code, and its HALT, behind all other code."""
    h = program.header
    rows = [[*row, *[0] * (4 - len(row))] for row in (*code, (Op.HALT,))]
    words = program.words.tolist()
    at, count = h(Header.CODE_AT), h(Header.INSTRUCTIONS)
    flat = [word for row in rows for word in row]
    end = at + 4 * count
    words[end:end] = flat
    for word in Header:
        if word.name.endswith("_AT") and h(word) >= end:
            words[word] += len(flat)
    words[Header.SIZE] = len(words)
    words[Header.INSTRUCTIONS] += len(rows)
    words[entry] = count
    return replace(
        program,
        words=np.array(words, np.int32),
        source_map=(*program.source_map, *[None] * len(rows)),
    )


def n(program: Program) -> int:
    """The register of `let.n`, a number from 0 to 5."""
    return next(name.register for name in program.registers if name.path == "let.n")


FILL = (Op.B_FLOOR, 0)
EACH = (Op.EACH_CELL, 0, temp(0))

SOUND: dict[str, tuple[Header, Code]] = {
    "tests of cells": (
        RULES,
        [(Op.IF_NEXT_TO, cell(6, 6), const(0), 0), (Op.IF_REACHES, const(0), cell(0, 0), 0)],
    ),
    "no cell at all": (RULES, [(Op.IF_SAME_CELL, const(CELL - 1), const(0), 0)]),
    "a cell of an entity": (
        RULES,
        [(Op.CELL_OF, temp(0), const(1)), (Op.DISTANCE, temp(1), temp(0), const(2))],
    ),
    "a coordinate": (RULES, [(Op.FIELD, temp(0), cell(1, 2), Field.Y)]),
    "a view": (RULES, [(Op.LOAD, temp(0), const(3)), (Op.SEES, temp(0), const(0), cell(2, 2))]),
    "a loop in a rule": (
        RULES,
        [FILL, (*EACH, 2), (Op.IF_LE, temp(0), temp(2), 0), (Op.DROP_CELL,), (Op.END_EACH,)],
    ),
    "a cell of a loop": (RULES, [FILL, (*EACH, 1), (Op.IF_SAME_CELL, temp(2), const(0), 0), (Op.END_EACH,)]),
    "sets of cells in a rule": (
        RULES,
        [
            FILL,
            (Op.B_COPY, 1, 0),
            (Op.B_NEXT_TO, 2, cell(1, 1)),
            (Op.B_AND, 1, 2),
            (Op.B_COUNT, temp(0), 1),
            (Op.FIRST_CELL, temp(1), 1),
            (Op.NEAREST_CELL, temp(3), 1, const(0)),
            (Op.PICK_CELL, temp(5), 1, 0),
        ],
    ),
    "a number from before a loop": (
        RULES,
        [
            FILL,
            (Op.LOAD, temp(5), const(0)),
            (*EACH, 1),
            (Op.ADD, temp(5), temp(5), const(1)),
            (Op.END_EACH,),
            (Op.IF_EQ, temp(5), const(3), 0),
        ],
    ),
    "a cell beside a cell": (
        RULES,
        [(Op.CELL_BESIDE, temp(0), cell(6, 6), const(3)), (Op.CELL_BESIDE, temp(1), temp(0), const(0))],
    ),
    "a thing on a cell": (RULES, [(Op.PLACE, const(4), cell(3, 3)), (Op.PLACE, const(1), const(CELL - 1))]),
    "a thing in another": (RULES, [(Op.SET_FIELD, const(4), Field.INSIDE, const(3))]),
    "the statue points": (RULES, [(Op.POINT, const(2), const(3)), (Op.BODY, const(Body.STOP_POINTING))]),
    "what lies in another": (
        RULES,
        [(Op.FIELD, temp(0), const(4), Field.INSIDE), (Op.IF_NEXT_TO, temp(0), const(0), 0)],
    ),
    "a reward": (RULES, [(Op.REWARD, const(-100))]),
    "an end with a share": (RULES, [(Op.END_GRADED, 0, const(2000))]),
    "acceptance": (REQUIRE, [(Op.LOAD, Register.ACCEPTED, const(1))]),
    "a mark that statuses are to be settled": (RULES, [(Op.LOAD, Register.CHANGED, const(1))]),
}

REFUSED: dict[str, tuple[Header, Code]] = {
    "an entity or a cell": (
        RULES,
        [
            (Op.LOAD, temp(0), const(2)),
            (Op.IF_EQ, temp(0), const(2), 1),
            (Op.LOAD, temp(0), cell(1, 1)),
            (Op.IF_NEXT_TO, temp(0), const(0), 0),
        ],
    ),
    "a cell below the canvas": (RULES, [(Op.IF_NEXT_TO, cell(0, 7), const(0), 0)]),
    "a cell beside the last": (RULES, [(Op.IF_NEXT_TO, cell(7, 6), const(0), 0)]),
    "a number between entities and cells": (RULES, [(Op.IF_NEXT_TO, const(CELL - 2), const(0), 0)]),
    "looking at an entity that does not exist": (RULES, [(Op.IF_LOOKS_AT, const(0), const(7), 0)]),
    "nothing between entities that do not exist": (RULES, [(Op.IF_UNOBSTRUCTED, const(-1), const(0), 0)]),
    "the cell of no entity": (RULES, [(Op.CELL_OF, temp(0), const(7))]),
    "a cell in a register of something else": (RULES, [(Op.CELL_OF, "n", const(0))]),
    "a cell that sees": (RULES, [(Op.LOAD, temp(0), const(0)), (Op.SEES, temp(0), cell(1, 1), const(0))]),
    "a view in no direction": (RULES, [(Op.LOAD, temp(0), const(4)), (Op.SEES, temp(0), const(0), const(1))]),
    "a view in a direction that was never written": (RULES, [(Op.SEES, temp(0), const(0), const(1))]),
    "a view that turns a register": (RULES, [(Op.SEES, Register.ACCEPTED, const(0), const(1))]),
    "a line that does not exist": (RULES, [(Op.SAY, const(1), const(4000))]),
    "a line below zero": (RULES, [(Op.SAY, const(1), const(-1))]),
    "a cell that says something": (RULES, [(Op.SAY, cell(1, 1), const(0))]),
    "a cell that vanishes": (RULES, [(Op.VANISH, cell(1, 1))]),
    "a cell with a status": (RULES, [(Op.BECOME, cell(1, 1), const(0))]),
    "a cell that walks": (RULES, [(Op.GO_TO, cell(1, 1), const(0), 0)]),
    "the colour of a cell as a status": (
        RULES,
        [(Op.FIELD, temp(0), cell(1, 1), 0), (Op.BECOME, const(3), temp(0))],
    ),
    "a set of cells that was never filled": (RULES, [(Op.B_COUNT, temp(0), 0)]),
    "a set of cells that was filled on one way only": (
        RULES,
        [(Op.IF_EQ, const(0), const(1), 1), FILL, (Op.B_COUNT, temp(0), 0)],
    ),
    "a copy of nothing": (RULES, [(Op.B_COPY, 0, 1)]),
    "a set of cells that only a loop fills": (
        RULES,
        [FILL, (*EACH, 1), (Op.B_FLOOR, 1), (Op.END_EACH,), (Op.B_COUNT, temp(5), 1)],
    ),
    "a set of cells that does not exist": (RULES, [(Op.B_FLOOR, BOARDS)]),
    "a count in a register": (RULES, [FILL, (Op.B_COUNT, "n", 0)]),
    "a cell in one temporary": (RULES, [FILL, (Op.FIRST_CELL, temp(TEMPORARIES - 1), 0)]),
    "the cell nearest to nobody": (RULES, [FILL, (Op.NEAREST_CELL, temp(0), 0, const(9))]),
    "the nearest of entities that do not exist": (RULES, [(Op.NEAREST, temp(0), const(0), 1 << 8 | 99)]),
    "the nearest of no entities": (RULES, [(Op.NEAREST, temp(0), const(0), 1 << 8)]),
    "the entity nearest to nobody": (RULES, [(Op.NEAREST, temp(0), const(9), 0)]),
    "a pick without a site": (RULES, [FILL, (Op.PICK_CELL, temp(0), 0, 999)]),
    "free cells in a rule": (RULES, [FILL, (Op.B_FREE, 0)]),
    "a placement in a rule": (RULES, [FILL, (Op.FIRST_CELL, temp(0), 0), (Op.PUT, const(1), temp(0))]),
    "a room shown in a rule": (RULES, [(Op.DRAW_ROOM, 1)]),
    "a room shown in no way there is": (RESET, [(Op.DRAW_ROOM, 2)]),
    "a new room in a rule": (RULES, [(Op.MAKE_ROOM, const(7), const(7))]),
    "a loop over nothing": (RULES, [(*EACH, 1), (Op.DROP_CELL,), (Op.END_EACH,)]),
    "a loop without an end": (RULES, [FILL, (*EACH, 1), (Op.DROP_CELL,), (Op.SKIP, 0, 0, 0)]),
    "a loop in a loop": (
        RULES,
        [FILL, (*EACH, 3), (Op.EACH_CELL, 0, temp(3), 1), (Op.DROP_CELL,), (Op.END_EACH,), (Op.END_EACH,)],
    ),
    "a loop with room for two coordinates": (
        RULES,
        [FILL, (Op.EACH_CELL, 0, temp(TEMPORARIES - 2), 1), (Op.DROP_CELL,), (Op.END_EACH,)],
    ),
    "a way out of a loop": (
        RULES,
        [
            FILL,
            (*EACH, 2),
            (Op.IF_EQ, const(0), const(1), 2),
            (Op.DROP_CELL,),
            (Op.END_EACH,),
            (Op.IF_EQ, const(0), const(0), 0),
        ],
    ),
    "a way into a loop": (
        RULES,
        [
            FILL,
            (Op.IF_EQ, const(0), const(1), 2),
            (*EACH, 2),
            (Op.DROP_CELL,),
            (Op.DROP_CELL,),
            (Op.END_EACH,),
        ],
    ),
    "an end in a loop": (RULES, [FILL, (*EACH, 1), (Op.HALT,), (Op.END_EACH,)]),
    "a cell dropped outside of a loop": (RULES, [FILL, (Op.DROP_CELL,)]),
    "an end of no loop": (RULES, [FILL, (Op.END_EACH,)]),
    "an entity that grows in a loop": (
        RULES,
        [
            FILL,
            (Op.LOAD, temp(5), const(0)),
            (*EACH, 2),
            (Op.IF_NEXT_TO, temp(5), const(0), 0),
            (Op.ADD, temp(5), temp(5), const(1)),
            (Op.END_EACH,),
        ],
    ),
    "an entity that grew in a loop": (
        RULES,
        [
            FILL,
            (Op.LOAD, temp(5), const(0)),
            (*EACH, 1),
            (Op.ADD, temp(5), temp(5), const(1)),
            (Op.END_EACH,),
            (Op.IF_NEXT_TO, temp(5), const(0), 0),
        ],
    ),
    "a set of bits that grows in a loop": (
        RULES,
        [FILL, (Op.LOAD, temp(5), const(0)), (*EACH, 1), (Op.SET_BIT, temp(5), temp(0)), (Op.END_EACH,)],
    ),
    "a value that only a loop writes": (
        RULES,
        [FILL, (*EACH, 1), (Op.LOAD, temp(5), const(0)), (Op.END_EACH,), (Op.IF_EQ, temp(5), const(0), 0)],
    ),
    "a value from the round before": (
        RULES,
        [FILL, (*EACH, 2), (Op.IF_EQ, temp(5), const(0), 0), (Op.LOAD, temp(5), const(0)), (Op.END_EACH,)],
    ),
    "the cell of a loop behind it": (
        RULES,
        [FILL, (*EACH, 1), (Op.DROP_CELL,), (Op.END_EACH,), (Op.IF_NEXT_TO, temp(2), const(0), 0)],
    ),
    "the cell beside nothing": (RULES, [(Op.CELL_BESIDE, temp(0), const(7), const(0))]),
    "the cell beside in no direction": (RULES, [(Op.CELL_BESIDE, temp(0), const(1), const(4))]),
    "nothing put on a cell": (RULES, [(Op.PLACE, const(7), cell(1, 1))]),
    "a cell put on a cell": (RULES, [(Op.PLACE, cell(1, 1), cell(1, 1))]),
    "a thing put beside the canvas": (RULES, [(Op.PLACE, const(1), cell(7, 6))]),
    "a thing in what does not exist": (RULES, [(Op.SET_FIELD, const(4), Field.INSIDE, const(7))]),
    "a thing in a cell": (RULES, [(Op.SET_FIELD, const(4), Field.INSIDE, cell(1, 1))]),
    "a fifth direction to point": (RULES, [(Op.SET_FIELD, const(1), Field.POINTING, const(5))]),
    "a place set like any field": (RULES, [(Op.SET_FIELD, const(1), Field.X, const(1))]),
    "presence set like any field": (RULES, [(Op.SET_FIELD, const(1), Field.GONE, const(0))]),
    "a thing that points": (RULES, [(Op.POINT, const(3), const(0))]),
    "the agent points": (RULES, [(Op.POINT, const(0), const(0))]),
    "pointing nowhere": (RULES, [(Op.POINT, const(1), const(4))]),
    "pointing off the canvas": (RULES, [(Op.POINT, const(1), const(CELL + 32 * 30))]),
    "facing what does not exist": (RULES, [(Op.FACE, const(1), const(99), 0)]),
    "nobody who faces": (RULES, [(Op.FACE, const(99), const(1), 0)]),
    "facing at no place": (RULES, [(Op.FACE, const(1), const(1), 1000)]),
    "a choice of nothing": (RULES, [(Op.CHOOSE, 0, 0, 0)]),
    "a choice among eight": (RULES, [(Op.CHOOSE, 0, 8, 0)]),
    "a choice of what is no action": (RULES, [(Op.CHOOSE, 0x98, 2, 0)]),
    "a choice at no place": (RULES, [(Op.CHOOSE, 0x10, 2, 1000)]),
    "pointing without a direction": (RULES, [(Op.BODY, const(Body.POINT))]),
    "a reward beyond all": (RULES, [(Op.REWARD, const(101))]),
    "a reward that nobody knows": (RULES, [(Op.REWARD, Register.OUTCOME)]),
    "an end that does not exist": (RULES, [(Op.END_GRADED, 1, const(5))]),
    "an end with a share that nobody knows": (RULES, [(Op.END_GRADED, 0, temp(9))]),
    "who said it where nobody notes it": (RULES, [(Op.HEARD_FROM, temp(0), "inbox", 0)]),
    "acceptance by a rule": (RULES, [(Op.LOAD, Register.ACCEPTED, const(1))]),
    "a mark of something else": (RULES, [(Op.LOAD, Register.CHANGED, const(2))]),
    "acceptance by the reset": (RESET, [(Op.LOAD, Register.ACCEPTED, const(1))]),
    "a number written while a room is judged": (REQUIRE, [(Op.LOAD, "n", const(1))]),
    "time written by a rule": (RULES, [(Op.LOAD, Register.T, const(1))]),
    "a place written by a rule": (RULES, [(Op.LOAD, FIRST_ENTITY + Field.X, const(1))]),
    "a direction written by a rule": (RULES, [(Op.LOAD, FIRST_ENTITY + Field.DIR, const(1))]),
    "a place written by the reset": (RESET, [(Op.LOAD, FIRST_ENTITY + Field.X, const(1))]),
    "an inbox written by a rule": (RULES, [(Op.LOAD, "inbox", const(1))]),
    "a kind that is too great": (
        RESET,
        [(Op.LOAD, FIRST_ENTITY + ENTITY_FIELDS * GUIDE + Field.STATUS, const(200))],
    ),
    "the lesser of 3 and a product that may wrap around": (
        RULES,
        [
            (Op.MUL, temp(0), const(500_000), const(500_000)),
            (Op.MUL, temp(1), temp(0), temp(0)),
            (Op.MUL, temp(2), temp(1), temp(0)),
            (Op.MIN, "n", temp(2), const(3)),
        ],
    ),
    "a sum that may wrap around": (
        RULES,
        [
            (Op.MUL, temp(0), const(1 << 18), const(1 << 18)),
            (Op.MUL, temp(1), temp(0), const(1 << 18)),
            (Op.ADD, temp(1), temp(1), temp(1)),
            *[(Op.ADD, temp(1), temp(1), temp(1)) for _ in range(9)],
            (Op.MIN, temp(1), temp(1), const(3)),
            (Op.MAX, temp(1), temp(1), const(0)),
            (Op.DIV, "n", temp(0), temp(1)),
        ],
    ),
    "how many bits of -1 are set": (RULES, [(Op.COUNT_BITS, "n", const(-1))]),
    "the width before there is a room": (
        RESET,
        [FILL, (Op.LOAD, temp(0), Register.WIDTH), (Op.LOAD, temp(1), const(0)), (Op.PUT, const(1), temp(0))],
    ),
}


def filled_in(program: Program, code: Code) -> Code:
    """The code with the numbers of registers that are called by name."""
    registers = {"n": n(program), "inbox": program.header(Header.INBOX)}
    return [tuple(registers.get(word, word) for word in row) for row in code]  # type: ignore[call-overload]


@pytest.mark.parametrize("name", SOUND)
def test_sound_code_is_accepted(name: str, program: Program) -> None:
    entry, code = SOUND[name]
    verify(with_code(program, entry, filled_in(program, code)))


@pytest.mark.parametrize("name", REFUSED)
def test_unsound_code_is_refused(name: str, program: Program) -> None:
    entry, code = REFUSED[name]
    with pytest.raises(InvalidProgramError, match="refused: at "):
        verify(with_code(program, entry, filled_in(program, code)))


def type_row(program: Program, number: int) -> int:
    """Where the first row of an entity's type is."""
    h = program.header
    row = int(program.words[h(Header.ENTITY_AT) + EntityColumn.COLUMNS * number + EntityColumn.TYPE])
    return h(Header.TYPE_AT) + TypeColumn.COLUMNS * row


TABLES: dict[str, Callable[[Program], tuple[int, int]]] = {
    "an NPC with a status code beyond the picture": lambda p: (
        p.header(Header.ENTITY_AT) + EntityColumn.COLUMNS * GUIDE + EntityColumn.KIND,
        256,
    ),
    "a view without an extent": lambda p: (p.header(Header.ENTITY_AT) + EntityColumn.VIEW, 0),
    "code for links outside of the table": lambda p: (Header.LINKS_PC, 5000),
    "code before steps outside of the table": lambda p: (Header.BEFORE_PC, -1),
    "code for required rooms outside of the table": lambda p: (Header.REQUIRE_PC, 5000),
    "code for timers outside of the table": lambda p: (Header.TICK_PC, 5000),
    "code for beliefs outside of the table": lambda p: (
        p.header(Header.FRAME_AT) + FrameColumn.PERCEIVE,
        5000,
    ),
    "code after the body action outside of the table": lambda p: (
        p.header(Header.FRAME_AT) + FrameColumn.DEFERRED,
        -1,
    ),
    "a push by what is neither body nor ball": lambda p: (
        p.header(Header.ENTITY_AT) + EntityColumn.COLUMNS * 4 + EntityColumn.PUSHED_BY,
        4,
    ),
    "a push to no status": lambda p: (type_row(p, 3) + TypeColumn.PUSHED, 3),
    "a stop in no status": lambda p: (type_row(p, 3) + TypeColumn.ROLLS, 4),
    "five channels": lambda p: (Header.CHANNELS, 5),
    "more lost than there is": lambda p: (Header.SLOPE, 1001),
    "a set of classes that is cut off": lambda p: (Header.CLASS_SETS, 30_000),
}


@pytest.mark.parametrize("name", TABLES)
def test_unsound_tables_are_refused(name: str, program: Program) -> None:
    at, value = TABLES[name](program)
    words = program.words.copy()
    words[at] = value
    with pytest.raises(InvalidProgramError, match="refused"):
        verify(replace(program, words=words))


def test_a_register_has_one_name(program: Program) -> None:
    twice = (*program.registers, replace(program.registers[0], path="let.alias"))
    with pytest.raises(InvalidProgramError, match="two names"):
        verify(replace(program, registers=twice))
