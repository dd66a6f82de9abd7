"""Speech within earshot: the logs and tokens of the seats, the inboxes of NPCs."""

from typing import NamedTuple

import numpy as np

from socialai_dsl.engine.boards import npcs_are_hidden
from socialai_dsl.engine.entities import column, distance, field, is_present
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.rng import fold
from socialai_dsl.engine.seats import seat_register, seat_word, seats_played
from socialai_dsl.engine.state import AGENT, NOTHING, ZERO, Key, Link, Row
from socialai_dsl.program import (
    SECRET,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    LineColumn,
    Register,
    SeatColumn,
    SeatRegister,
)


@inline
def _line(row: Row, line: int, name: int) -> int:
    return row.program[row.program[Header.LINE_AT] + LineColumn.COLUMNS * line + name]


class Ears(NamedTuple):
    """Where a seat keeps what it hears: numbers of registers, its first token, and its digest in the row's key."""

    heard: int
    first_heard: int
    logged: int
    tokens: int
    oldest: int
    log: int
    start: int
    digest: int


@inline
def _ears_of_agent(row: Row) -> Ears:
    return Ears(
        np.int64(Register.HEARD),
        row.program[Header.HEARD],
        np.int64(Register.LOGGED),
        np.int64(Register.TOKENS),
        np.int64(Register.OLDEST),
        row.program[Header.LOG],
        ZERO,
        np.int64(Key.DIGEST),
    )


@inline
def _ears_of(row: Row, seat: int) -> Ears:
    """Of a seat from 1 on."""
    return Ears(
        seat_register(row, seat, SeatRegister.HEARD),
        seat_word(row, seat, SeatColumn.HEARD),
        seat_register(row, seat, SeatRegister.LOGGED),
        seat_register(row, seat, SeatRegister.TOKENS),
        seat_register(row, seat, SeatRegister.OLDEST),
        seat_word(row, seat, SeatColumn.LOG),
        seat * row.program[row.program[Header.SIZE] + Link.TOKENS],
        np.int64(Key.WORDS) - 1 + seat,
    )


@inline
def _forget_oldest(row: Row, ears: Ears, words: int) -> None:
    """Drop whole lines, the oldest first, until the log has room for one more line and the tokens for `words` more.

    What lies behind the tokens that are left is not cleared.
    """
    registers = row.registers
    lines = registers[ears.logged]
    most = row.program[Header.TOKENS] - words
    left = registers[ears.tokens]
    size = row.program[Header.LOG_SIZE]
    if left <= most and lines < size:
        return
    oldest = registers[ears.oldest]
    while lines > 0 and (left > most or lines >= size):
        left -= _line(row, registers[ears.log + oldest], LineColumn.TOKENS)
        oldest = oldest + 1 if oldest + 1 < size else 0
        lines -= 1
    left = max(left, 0)
    shift = registers[ears.tokens] - left
    for i in range(left):
        row.tokens[ears.start + i] = row.tokens[ears.start + shift + i]
    registers[ears.oldest] = oldest
    registers[ears.logged] = lines
    registers[ears.tokens] = left


@inline
def _remember(row: Row, ears: Ears, line: int) -> None:
    """Add a line to the log, the tokens and the digest; the oldest whole lines make room."""
    registers = row.registers
    words = _line(row, line, LineColumn.TOKENS)
    before = registers[ears.tokens]
    _forget_oldest(row, ears, words)
    start = registers[ears.tokens]
    first = row.program[Header.TOKEN_AT] + _line(row, line, LineColumn.FIRST_TOKEN)
    words = min(words, row.program[Header.TOKENS] - start)
    for i in range(words):
        row.tokens[ears.start + start + i] = row.program[first + i]
    for i in range(start + words, before):
        row.tokens[ears.start + i] = 0
    place = registers[ears.oldest] + registers[ears.logged]
    size = row.program[Header.LOG_SIZE]
    registers[ears.log + (place if place < size else place - size)] = line
    registers[ears.logged] += 1
    registers[ears.tokens] = start + words
    row.key[ears.digest] = fold(row.key[ears.digest], line)


@inline
def _take_in(row: Row, ears: Ears, line: int) -> None:
    """Hear a line."""
    heard = row.registers[ears.heard]
    if heard < row.program[Header.HEARD_SIZE]:
        row.registers[ears.first_heard + heard] = line
        row.registers[ears.heard] = heard + 1
    _remember(row, ears, line)


@inline
def remember(row: Row, line: int) -> None:
    """The agent has heard a line before."""
    _remember(row, _ears_of_agent(row), line)


@inline
def hear(row: Row, line: int) -> None:
    """The agent hears a line."""
    _take_in(row, _ears_of_agent(row), line)


@outline
def hear_on_seat(row: Row, seat: int, line: int) -> None:
    """The player of another seat hears a line."""
    stay_outline()
    _take_in(row, _ears_of(row, seat), line)


@inline
def clear_tokens(row: Row) -> None:
    """Empty the token buffers, and with them the digests."""
    for i in range(row.registers[Register.TOKENS]):
        row.tokens[i] = 0
    row.registers[Register.TOKENS] = 0
    row.key[Key.DIGEST] = np.uint64(0)
    for seat in range(1, seats_played(row)):
        length = row.program[row.program[Header.SIZE] + Link.TOKENS]
        for i in range(length):
            row.tokens[seat * length + i] = 0
        row.key[Key.WORDS - 1 + seat] = np.uint64(0)


@inline
def within_earshot(row: Row, speaker: int, hearer: int) -> bool:
    """Whether the voice of one carries to the other."""
    away = distance(row, speaker, hearer)
    return column(row, speaker, EntityColumn.NEAR) <= away <= column(row, speaker, EntityColumn.FAR)


@inline
def entry_size(row: Row) -> int:
    """Registers of an entry of an inbox: the class, and where rules read them the speaker and the noun."""
    return 3 if row.program[Header.FLAGS] & Flag.HEARD_BY else 1


@inline
def put_into_inbox(row: Row, inbox: int, utterance: int, speaker: int, noun: int) -> None:
    """Add what was said to an inbox, unless it is full."""
    count = row.registers[inbox]
    if count < row.program[Header.INBOX_SIZE]:
        row.registers[inbox] = count + 1
        if row.program[Header.FLAGS] & Flag.HEARD_BY:
            _put_with_speaker(row, inbox + 1 + 3 * count, utterance, speaker, noun)
        else:
            row.registers[inbox + 1 + count] = utterance


@outline
def _put_with_speaker(row: Row, place: int, utterance: int, speaker: int, noun: int) -> None:
    stay_outline()
    row.registers[place] = utterance
    row.registers[place + 1] = speaker
    row.registers[place + 2] = noun


@inline
def empty_inbox(row: Row, inbox: int) -> None:
    """Forget what was heard."""
    last = row.registers[inbox]
    if row.program[Header.FLAGS] & Flag.HEARD_BY:
        last *= 3
    for i in range(1, last + 1):
        row.registers[inbox + i] = 0
    row.registers[inbox] = 0


@inline
def inbox_class(row: Row, inbox: int) -> int:
    """The class of what was heard: 0 nothing, the number of classes if several differ."""
    count = row.registers[inbox]
    if count == 0:
        return 0
    first = row.registers[inbox + 1]
    if count > 1:
        size = entry_size(row)
        for i in range(1, count):
            if row.registers[inbox + 1 + size * i] != first:
                return row.program[Header.CLASSES]
    return first


@inline
def is_in_inbox(row: Row, utterance: int, inbox: int) -> bool:
    """Whether an utterance of this class was heard."""
    found = False
    size = entry_size(row)
    for i in range(row.registers[inbox]):
        found |= row.registers[inbox + 1 + size * i] == utterance
    return found


@inline
def first_heard(row: Row, inbox: int, classes: int, part: int) -> int:
    """The speaker (part 1) or noun (part 2) of an entry whose class is in a set of classes; -1 if there is none.

    Of several it is that of the agent, then of the member that comes first in the cast, whenever they spoke.
    """
    known = row.program[Header.CLASS_SET_AT] + row.program[Header.CLASS_SET_WORDS] * classes
    found = NOTHING
    for i in range(row.registers[inbox]):
        place = inbox + 1 + 3 * i
        utterance = row.registers[place]
        if (row.program[known + (utterance >> 5)] >> (utterance & 31)) & 1 == 1 and (
            found == NOTHING or row.registers[place + 1] < row.registers[found + 1]
        ):
            found = place
    return row.registers[found + part] if found != NOTHING else NOTHING


@inline
def _may_hear(row: Row, speaker: int) -> bool:
    """Whether a player hears a member at all: not while NPCs are hidden, unless that one is always audible."""
    return not npcs_are_hidden(row) or column(row, speaker, EntityColumn.MANNERS) & 1 != 0


@inline
def deliver(row: Row, speaker: int, utterance: int, noun: int) -> None:
    """Put an utterance into the inbox of every other member with a frame within earshot."""
    table = row.program[Header.FRAME_AT]
    x = field(row, speaker, Field.X)
    y = field(row, speaker, Field.Y)
    near = column(row, speaker, EntityColumn.NEAR)
    far = column(row, speaker, EntityColumn.FAR)
    last = NOTHING
    for _ in range(row.program[Header.FRAMES]):
        entity = row.program[table + FrameColumn.ENTITY]
        away = abs(field(row, entity, Field.X) - x) + abs(field(row, entity, Field.Y) - y)
        if (
            away <= far  # most are not, so this comes first
            and entity not in (last, speaker)
            and away >= near
            and is_present(row, entity)
            and (entity != AGENT or _may_hear(row, speaker))
        ):
            put_into_inbox(row, row.program[table + FrameColumn.INBOX], utterance, speaker, noun)
        last = entity
        table += FrameColumn.COLUMNS


@outline
def reach_seats(row: Row, speaker: int, line: int) -> None:
    """A line is heard by the players of the seats, other than the agent's and the speaker's own, within earshot."""
    stay_outline()
    if not _may_hear(row, speaker):
        return
    for seat in range(1, seats_played(row)):
        member = seat_word(row, seat, SeatColumn.ENTITY)
        if member != speaker and is_present(row, member) and within_earshot(row, speaker, member):
            hear_on_seat(row, seat, line)


@inline
def speak(row: Row, speaker: int, line: int) -> None:
    """An NPC says a line: the agent hears it if it may and is near, and so do NPCs for whom it means something."""
    utterance = _line(row, line, LineColumn.CLASS)
    if row.program[Header.FLAGS] & Flag.SEATS:
        reach_seats(row, speaker, line)
    if (
        utterance < SECRET
        and _may_hear(row, speaker)
        and is_present(row, AGENT)
        and within_earshot(row, speaker, AGENT)
    ):
        hear(row, line)
    utterance &= SECRET - 1
    if utterance > 1:
        deliver(row, speaker, utterance, _line(row, line, LineColumn.NOUN))
