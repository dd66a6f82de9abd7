"""One step of one environment, in the order the language fixes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.boards import is_deadly
from socialai_dsl.engine.calls import TERMINATED, TRUNCATED
from socialai_dsl.engine.entities import field
from socialai_dsl.engine.jit import inline, merged
from socialai_dsl.engine.picture import take_picture
from socialai_dsl.engine.pointers import int64_of
from socialai_dsl.engine.speech import empty_inbox, inbox_class
from socialai_dsl.engine.state import AGENT, NOTHING, ArrayId, Link, Row, Trait
from socialai_dsl.engine.turns import (
    compute_statuses,
    conclude,
    follow_links,
    go_by_itself,
    move_agent,
    notice,
    perceive,
    say_as_agent,
    settle,
    state_table,
    take_turns,
)
from socialai_dsl.engine.vm import past_tests, run
from socialai_dsl.program import Field, Flag, FrameColumn, Header, Register


@merged
def begin(row: Row) -> None:
    """Store values of the past state; then advance time, and clear what was heard, used and said."""
    registers = row.registers
    if row.program[Header.BEFORE_PC] != 0:
        run(row, row.program[Header.BEFORE_PC])
    registers[Register.T] += 1
    registers[Register.HEARD] = 0
    registers[Register.POKED] = -1
    registers[Register.SAID_LINE] = 0
    registers[Register.BONUS] = 0


@inline
def be_silent(row: Row) -> None:
    """The agent has said nothing in this step."""
    registers = row.registers
    registers[Register.TEMPLATE] = -1
    registers[Register.NOUN] = -1
    registers[Register.CLASS] = 0
    registers[Register.UTTERANCE] = 0


@inline
def _filling(row: Row, link: int, action: NDArray[np.int64]) -> int:
    """The number of the words in all slots of what the agent says; -1 if the program lacks one of them."""
    program = row.program
    slots = program[link + Link.SLOTS]
    sizes = program[link + Link.SIZE_AT]
    words = program[link + Link.WORD_AT]
    strides = program[link + Link.STRIDE_AT] + action[2] * (1 + slots)
    filling = program[strides]
    lacks = False
    for slot in range(slots):
        stride = program[strides + 1 + slot]
        if stride != 0:
            word = program[words + action[3 + slot]]
            lacks |= word < 0
            filling += stride * word
        words += program[sizes + slot]
    return NOTHING if lacks else filling


@inline
def decode(row: Row, link: int, action: NDArray[np.int64]) -> None:
    """Note the agent's body action and utterance. What its grammar cannot say is silence."""
    registers = row.registers
    program = row.program
    registers[Register.ACTION] = program[link + Link.END + action[0]]
    be_silent(row)
    if action[1] == 1:
        template = program[program[link + Link.TEMPLATE_AT] + action[2]]
        filling = _filling(row, link, action)
        if template >= 0 and filling >= 0:
            pair = template * program[Header.NOUNS] + filling
            registers[Register.TEMPLATE] = template
            registers[Register.NOUN] = filling
            registers[Register.UTTERANCE] = 1 + pair
            registers[Register.CLASS] = program[program[Header.CLASS_AT] + pair]


@merged
def step_row(row: Row, link: int, book: Any, number: int) -> float:
    """One step; the reward. Whether and how the episode ended is in the registers.

    It is row `number` of the book.
    """
    registers = row.registers
    program = row.program
    flags = program[Header.FLAGS]
    begin(row)
    decode(row, link, int64_of(book, ArrayId.ACTIONS, number))

    frame = program[Header.FRAME_AT]
    heard = 0
    chosen = False
    if flags & Flag.AGENT_FRAME:
        heard = inbox_class(row, program[frame + FrameColumn.INBOX])
        perceive(row, frame, flags)
        # Whatever it has chosen, the caller decides what the agent does.
        chosen = notice(row, program[state_table(row, frame) + 1 + heard])
    move_agent(row, registers[Register.ACTION])
    if flags & (Flag.PICTURE_BEFORE_NPCS | Trait.GOES_BY_ITSELF):
        changed = follow_links(row)
        if flags & Flag.PICTURE_BEFORE_NPCS:
            take_picture(row, link, book, number)
        compute_statuses(row, changed)
        if flags & Trait.GOES_BY_ITSELF:
            compute_statuses(row, go_by_itself(row))
    else:
        settle(row)
    say_as_agent(row)
    if flags & Flag.AGENT_FRAME:
        conclude(row, frame, state_table(row, frame), heard, chosen, flags)
        empty_inbox(row, program[frame + FrameColumn.INBOX])
        registers[Register.SAID_LINE] = 0

    take_turns(row)
    if program[Header.RULES_PC] != 0:
        run(row, program[Header.RULES_PC])
    settle(row)
    reward = _judge(row, link)
    if not flags & Flag.PICTURE_BEFORE_NPCS:
        take_picture(row, link, book, number)
    if flags & Trait.REWARDS:
        reward += np.float64(registers[Register.BONUS]) / 100.0
        reward += np.float64(program[Header.EACH_STEP]) / 1e6
    return reward


@merged
def _judge(row: Row, link: int) -> float:
    """Whether the episode ends, how, and for what share of the reward."""
    registers = row.registers
    program = row.program
    outcomes = program[link + Link.OUTCOMES]
    if field(row, AGENT, Field.X) >= 0 and is_deadly(
        row, field(row, AGENT, Field.X), field(row, AGENT, Field.Y)
    ):
        registers[Register.OUTCOME] = outcomes - 2
        registers[Register.PERCENT] = 0
    else:
        table = program[Header.OUTCOME_AT] + 8 * registers[Register.CLASS]
        pc = program[table + registers[Register.ACTION]]
        if pc != 0:
            pc = past_tests(row, pc)
        if pc != 0:
            run(row, pc)
    if registers[Register.OUTCOME] >= 0:
        registers[Register.ENDED] = TERMINATED
    elif registers[Register.T] >= program[Header.HORIZON]:
        registers[Register.ENDED] = TRUNCATED
        registers[Register.OUTCOME] = outcomes - 1
        registers[Register.PERCENT] = 0
    else:
        return 0.0
    row.counters[program[link + Link.RULES] + registers[Register.OUTCOME]] += 1
    row.counters[program[Header.COUNTERS] - 1] += 1
    share = np.float64(registers[Register.PERCENT]) / 100.0
    slope = np.float64(program[Header.SLOPE]) / 1000.0
    return share * (1.0 - slope * np.float64(registers[Register.T]) / np.float64(program[Header.HORIZON]))
