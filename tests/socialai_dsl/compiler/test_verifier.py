"""The verifier accepts what the compiler makes and refuses every hand-made mutant of it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.compiler.tables import InvalidProgramError, verify
from socialai_dsl.program import (
    CONSTANT,
    TEMPORARY,
    TESTS,
    EntityColumn,
    FrameColumn,
    Header,
    LineColumn,
    Op,
    Program,
    TypeColumn,
)
from socialai_dsl.widths import MOST_WORDS, WHOLE_REGISTER

Words = np.ndarray


@pytest.fixture(scope="module")
def program() -> Program:
    return sd.compile(sd.load("talkitout+oracle"))


@pytest.fixture(scope="module")
def answering() -> Program:
    """A program in which an answer is one instruction."""
    return sd.compile(sd.load("talkitout"))


def mutated(program: Program, change: Callable[[Words, Program], None]) -> Program:
    words = program.words.copy()
    change(words, program)
    assert not np.array_equal(words, program.words), "the mutant is no mutant"
    return replace(program, words=words)


def code_word(words: Words, program: Program, op: Op, position: int, nth: int = 0) -> int:
    """Index of an operand of the nth instruction with this op."""
    rows = [i for i, row in enumerate(program.code.tolist()) if row[0] == op]
    return program.header(Header.CODE_AT) + 4 * rows[nth] + 1 + position


def set_code(op: Op, position: int, value: int, nth: int = 0) -> Callable[[Words, Program], None]:
    def change(words: Words, program: Program) -> None:
        words[code_word(words, program, op, position, nth)] = value

    return change


def set_header(word: Header, value: int | Callable[[Program], int]) -> Callable[[Words, Program], None]:
    def change(words: Words, program: Program) -> None:
        words[word] = value(program) if callable(value) else value

    return change


def set_table(table: Header, at: int, value: int) -> Callable[[Words, Program], None]:
    def change(words: Words, program: Program) -> None:
        words[program.header(table) + at] = value

    return change


def a_test(program: Program) -> int:
    """Index of the skip of the first test."""
    row = next(i for i, (op, *_) in enumerate(program.code.tolist()) if op in TESTS)
    return program.header(Header.CODE_AT) + 4 * row + 3


def jump_backward(words: Words, program: Program) -> None:
    words[a_test(program)] = -2


def jump_out(words: Words, program: Program) -> None:
    words[a_test(program)] = 100_000


def lose_last_halt(words: Words, program: Program) -> None:
    # Of two HALTs in a row only the first is reached.
    end = program.header(Header.CODE_AT) + 4 * program.header(Header.INSTRUCTIONS)
    words[[end - 4, end - 8]] = Op.COUNT


def unknown_op(words: Words, program: Program) -> None:
    words[program.header(Header.CODE_AT) + 4] = 99


def board_in_a_rule(words: Words, program: Program) -> None:
    at = code_word(words, program, Op.GOTO, 0) - 1
    words[at : at + 4] = [Op.B_FLOOR, 0, 0, 0]
    words[at + 4 : at + 8] = [Op.B_FREE, 0, 0, 0]


MUTANTS: dict[str, Callable[[Words, Program], None]] = {
    "a size that is not the length": set_header(Header.SIZE, 17),
    "a canvas too wide": set_header(Header.CANVAS_WIDTH, 31),
    "more entities than rows": set_header(Header.ENTITIES, 9),
    "no utterance class for speech": set_header(Header.CLASSES, 1),
    "fewer classes than the tables": set_header(Header.CLASSES, 3),
    "a log that overflows": set_header(Header.LOG_SIZE, 10),
    "a log over the inboxes": set_header(Header.LOG, lambda p: p.header(Header.INBOX)),
    "a log behind the row": set_header(Header.LOG, lambda p: p.header(Header.REGISTERS) - 1),
    "an inbox that overflows": set_header(Header.INBOX_SIZE, 1),
    "code behind the end": set_header(Header.CODE_AT, 10_000_000),
    "code cut off": set_header(Header.INSTRUCTIONS, 1_000_000),
    "a reset outside the code": set_header(Header.RESET_PC, 5000),
    "more lines than rows": set_header(Header.LINES, 5000),
    "more sites than rows": set_header(Header.SITES, 5000),
    "rooms higher than the canvas": set_header(Header.MIN_HEIGHT, 9),
    "a body action that does not exist": set_table(Header.ACTION_AT, 0, 8),
    "an utterance in class 0": set_table(Header.CLASS_AT, 0, 0),
    "an utterance in a class that does not exist": set_table(Header.CLASS_AT, 3, 77),
    "an entity without a type": set_table(Header.ENTITY_AT, EntityColumn.TYPE, 99),
    "a toggle to nowhere": set_table(Header.TYPE_AT, 2 * TypeColumn.COLUMNS + TypeColumn.TOGGLED, 5),
    "a type code too large": set_table(Header.TYPE_AT, TypeColumn.CODE, 40),
    "a frame of an object": set_table(Header.FRAME_AT, FrameColumn.ENTITY, 6),
    "a state outside the table": set_table(Header.FRAME_AT, FrameColumn.ROWS, 30),
    "a state in a register of something else": set_table(Header.FRAME_AT, FrameColumn.STATE, 3),
    "an activity outside the code": set_table(Header.STATE_AT, 0, 4000),
    "an outcome outside the code": set_table(Header.OUTCOME_AT, 5, -1),
    "a line longer than the history": set_table(Header.LINE_AT, LineColumn.TOKENS, 300),
    "a line in no class": set_table(Header.LINE_AT, LineColumn.CLASS, 0),
    "a word outside the vocabulary": set_table(Header.TOKEN_AT, 0, 1000),
    "a jump backward": jump_backward,
    "a jump out of the code": jump_out,
    "no end": lose_last_halt,
    "an op that does not exist": unknown_op,
    "a board outside of a reset": board_in_a_rule,
    "an entity that does not exist": set_code(Op.IF_NEXT_TO, 0, CONSTANT + 8),
    "an entity below zero": set_code(Op.GO_NEXT_TO, 1, CONSTANT - 1),
    "an entity from any register": set_code(Op.IF_NEXT_TO, 1, 0),
    "an answer that does not exist": set_code(Op.ANSWER, 1, CONSTANT + 4000),
    "an answer that may not exist": set_code(Op.ANSWER, 1, TEMPORARY + 63),
    "an answer that is not counted anywhere": set_code(Op.ANSWER, 0, 400),
    "an answer into a state that does not exist": set_code(Op.ANSWER, 2, 51),
    "an answer of a frame that does not exist": set_code(Op.ANSWER, 2, 4 << 8 | 1),
    "an answer into no state of a frame": set_code(Op.ANSWER, 2, 1 << 8),
    "a state that does not exist": set_code(Op.GOTO, 1, 50),
    "a frame that does not exist": set_code(Op.GOTO, 0, 4),
    "a counter that does not exist": set_code(Op.COUNT, 0, 400),
    "an outcome that does not exist": set_code(Op.END, 0, 3),
    "more than the whole reward": set_code(Op.END, 1, 101),
    "a draw among nothing": set_code(Op.DRAW, 1, CONSTANT),
    "a site that does not exist": set_code(Op.DRAW, 2, 999),
    "a draw of another at no site": set_code(Op.DRAW_OTHER, 2, 6 << 24 | 999),
    "a draw of another among one": set_code(Op.DRAW_OTHER, 2, 1 << 24),
    "a draw of another among more than there are": set_code(Op.DRAW_OTHER, 2, 7 << 24),
    "a draw of other than nothing": set_code(Op.DRAW_OTHER, 1, TEMPORARY + 60),
    "a bit beyond the word": set_code(Op.SET_BIT, 1, CONSTANT + 63),
    "a board that does not exist": set_code(Op.B_FLOOR, 0, 8),
    "a side that does not exist": set_code(Op.B_WALL, 1, 4),
    "a cell in no temporary": set_code(Op.PUT, 1, 5),
    "a cell that was never drawn": set_code(Op.PUT, 1, TEMPORARY + 60),
    "a room without a template": set_code(Op.MAKE_ROOM, 0, CONSTANT + 9),
    "a write to no register": set_code(Op.LOAD, 0, 7000),
    "a write out of range": set_code(Op.LOAD, 1, CONSTANT + 3, nth=0),
    "a temporary that does not exist": set_code(Op.ADD, 0, TEMPORARY + 64),
    "a direction that does not exist": set_code(Op.LOAD, 1, CONSTANT + 77, nth=5),
}


def test_what_the_compiler_makes_is_accepted(program: Program) -> None:
    verify(program)


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_refused(name: str, program: Program, answering: Program) -> None:
    whole = answering if name.startswith("an answer") else program
    with pytest.raises(InvalidProgramError, match="refused"):
        verify(mutated(whole, MUTANTS[name]))


@pytest.mark.parametrize("which", ["low", "high"])
def test_what_no_register_holds_is_refused(which: str, program: Program) -> None:
    """However wide its range is said to be."""
    least, greatest = WHOLE_REGISTER
    ends = {"low": (least - 1, 0), "high": (0, greatest + 1)}[which]
    first, *others = program.registers
    wide = replace(first, low=ends[0], high=ends[1])
    with pytest.raises(InvalidProgramError, match="which no register does"):
        verify(replace(program, registers=(wide, *others)))


def test_more_words_than_tokens_tell_apart_are_refused(program: Program) -> None:
    many = tuple(f"word{i}" for i in range(MOST_WORDS + 1))
    with pytest.raises(InvalidProgramError, match="more words than tokens"):
        verify(replace(program, vocabulary=many))


def test_a_reward_is_paid_once_a_step(tmp_path: Path) -> None:
    """So that what a step pays is at most what all rules pay, which a register holds."""
    path = tmp_path / "paid.yaml"
    path.write_text(PAID, encoding="utf-8")
    paid = sd.compile(sd.load(path))
    frame = paid.header(Header.STATE_AT)

    def elsewhere(words: Words, program: Program) -> None:
        words[frame] = program.header(Header.RULES_PC)

    verify(paid)
    with pytest.raises(InvalidProgramError, match="more than once a step"):
        verify(mutated(paid, elsewhere))


PAID = """\
scenario: paid
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 6}
objects: {door: {type: door, place: wall(top)}}
frames: {talk: {states: {s: {then: [{hears: any, say: Hi}]}}}}
cast: {agent: {}, ann: {frame: talk}}
rules: [{when: t > 3, reward: 5}]
outcome: [{success: agent.at(door)}]
"""


@pytest.mark.parametrize(("position", "value"), [(0, 7000), (1, -1), (2, -1)])
def test_questions_about_nothing_are_refused(position: int, value: int) -> None:
    """Who said what was heard is asked of a place in an inbox."""
    chatter = sd.compile(sd.load(Path(__file__).parents[2] / "data" / "agreement" / "chatter.yaml"))
    with pytest.raises(InvalidProgramError, match="HEARD_FROM"):
        verify(mutated(chatter, set_code(Op.HEARD_FROM, position, value)))
