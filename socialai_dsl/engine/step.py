"""One step of one environment, in the order the language fixes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.boards import is_deadly
from socialai_dsl.engine.calls import TERMINATED, TRUNCATED
from socialai_dsl.engine.entities import field, is_present, set_field
from socialai_dsl.engine.jit import inline, merged, outline, stay_outline
from socialai_dsl.engine.picture import take_pictures
from socialai_dsl.engine.pointers import bytes_of, float64_of, int64_of
from socialai_dsl.engine.seats import seat_value, seat_word, seats_played
from socialai_dsl.engine.speech import empty_inbox, inbox_class
from socialai_dsl.engine.state import AGENT, NOTHING, STILL, ZERO, ArrayId, Link, Row, Trait
from socialai_dsl.engine.turns import (
    bury,
    compute_statuses,
    conclude,
    follow_links,
    go_by_itself,
    move_agent,
    move_players,
    notice,
    perceive,
    say_as_agent,
    settle,
    speak_as_players,
    state_table,
    take_turns,
)
from socialai_dsl.engine.vm import past_tests, run
from socialai_dsl.program import Body, Field, Flag, FrameColumn, Header, Register, SeatColumn, SeatRegister


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
def _pair(row: Row, link: int, action: NDArray[np.int64]) -> int:
    """The number of what an action says, template by template; -1 for silence and what the grammar cannot say."""
    if action[1] != 1:
        return NOTHING
    template = row.program[row.program[link + Link.TEMPLATE_AT] + action[2]]
    filling = _filling(row, link, action)
    if template < 0 or filling < 0:
        return NOTHING
    return template * row.program[Header.NOUNS] + filling


@inline
def _takes_turns(row: Row, npc: int) -> bool:
    """Whether a member follows a frame, so that what it did last is forgotten in its turn."""
    for frame in range(row.program[Header.FRAMES]):
        if (
            row.program[row.program[Header.FRAME_AT] + FrameColumn.COLUMNS * frame + FrameColumn.ENTITY]
            == npc
        ):
            return True
    return False


@outline
def begin_on_seats(row: Row, book: Any, number: int) -> None:
    """Note where players sit, what they do and what they say; row `number` of the book is the agent's."""
    stay_outline()
    registers = row.registers
    link = row.program[Header.SIZE]
    if not is_present(row, AGENT):
        be_silent(row)
        registers[Register.ACTION] = Body.NONE
    for seat in range(1, seats_played(row)):
        first = seat_word(row, seat, SeatColumn.FIRST)
        npc = seat_word(row, seat, SeatColumn.ENTITY)
        for cleared in (SeatRegister.UTTERANCE, SeatRegister.LINE, SeatRegister.HEARD, SeatRegister.BONUS):
            registers[first + cleared] = 0
        registers[first + SeatRegister.ACTION] = Body.NONE
        was_taken = registers[first + SeatRegister.TAKEN]
        is_taken = bytes_of(book, ArrayId.TAKEN, ZERO)[number + seat]
        registers[first + SeatRegister.TAKEN] = is_taken
        if was_taken != 0 or is_taken != 0:
            set_field(row, npc, Field.TOGGLED, ZERO)
            if is_taken != 0 or not _takes_turns(row, npc):
                set_field(row, npc, Field.LAST, STILL)
        if is_taken == 0 or not is_present(row, npc):
            continue
        action = int64_of(book, ArrayId.ACTIONS, number + seat)
        body = row.program[link + Link.END + action[0]]
        registers[first + SeatRegister.ACTION] = body
        set_field(row, npc, Field.LAST, body)
        pair = _pair(row, link, action)
        if pair != NOTHING:
            registers[first + SeatRegister.UTTERANCE] = 1 + pair
            run(row, seat_word(row, seat, SeatColumn.SAYS))
            registers[first + SeatRegister.LINE] = registers[Register.SAID_LINE]
            registers[Register.SAID_LINE] = 0


@inline
def decode(row: Row, link: int, action: NDArray[np.int64]) -> None:
    """Note the agent's body action and utterance. What its grammar cannot say is silence."""
    registers = row.registers
    program = row.program
    registers[Register.ACTION] = program[link + Link.END + action[0]]
    be_silent(row)
    pair = _pair(row, link, action)
    if pair != NOTHING:
        registers[Register.TEMPLATE] = pair // program[Header.NOUNS]
        registers[Register.NOUN] = pair % program[Header.NOUNS]
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
    if flags & Flag.SEATS:
        begin_on_seats(row, book, number)

    frame = program[Header.FRAME_AT]
    heard = 0
    chosen = False
    if flags & Flag.AGENT_FRAME:
        heard = inbox_class(row, program[frame + FrameColumn.INBOX])
        perceive(row, frame, flags)
        # Whatever it has chosen, the caller decides what the agent does.
        chosen = notice(row, program[state_table(row, frame) + 1 + heard])
    move_agent(row, registers[Register.ACTION])
    if flags & Flag.SEATS:
        move_players(row)
    if flags & (Flag.PICTURE_BEFORE_NPCS | Trait.GOES_BY_ITSELF):
        changed = follow_links(row)
        if flags & Flag.PICTURE_BEFORE_NPCS:
            take_pictures(row, link, book, number)
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
    if flags & Flag.SEATS:
        speak_as_players(row)

    take_turns(row)
    if program[Header.RULES_PC] != 0:
        run(row, program[Header.RULES_PC])
    is_over = False
    if flags & Flag.SEATS:
        is_over = bury(row)
    settle(row)
    reward = _judge(row, link, is_over)
    if not flags & Flag.PICTURE_BEFORE_NPCS:
        take_pictures(row, link, book, number)
    if flags & Trait.REWARDS:
        reward += np.float64(registers[Register.BONUS]) / 100.0
        reward += np.float64(program[Header.EACH_STEP]) / 1e6
    return reward


@merged
def _judge(row: Row, link: int, is_over: bool) -> float:
    """Whether the episode ends, how, and for what share of the reward; `is_over`: those who could play on are dead."""
    registers = row.registers
    program = row.program
    outcomes = program[link + Link.OUTCOMES]
    if is_over or (
        is_present(row, AGENT) and is_deadly(row, field(row, AGENT, Field.X), field(row, AGENT, Field.Y))
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


@outline
def pay_seats(row: Row, book: Any, number: int) -> None:
    """Write the rewards of the seats other than the agent's, which is row `number` of the book."""
    stay_outline()
    program = row.program
    worth = 0.0
    if row.registers[Register.ENDED] == TERMINATED:
        slope = np.float64(program[Header.SLOPE]) / 1000.0
        worth = 1.0 - slope * np.float64(row.registers[Register.T]) / np.float64(program[Header.HORIZON])
    for seat in range(1, seats_played(row)):
        reward = np.float64(seat_value(row, seat, SeatRegister.SHARE)) / 100.0 * worth
        reward += np.float64(seat_value(row, seat, SeatRegister.BONUS)) / 100.0
        reward += np.float64(program[Header.EACH_STEP]) / 1e6
        float64_of(book, ArrayId.REWARD, ZERO)[number + seat] = reward
