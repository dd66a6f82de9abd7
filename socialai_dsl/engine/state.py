"""The state of a batch of environments: few arrays, one row for each environment.

`State` is all that persists and is all a snapshot needs, `Ports` is what goes in and out of a call, `Row` is what the
functions of the engine see of one environment. Axis letters: E environments, S seats that callers play, R registers,
L tokens, H x W canvas. What each seat has is in row e * S + s, or of tokens and digests side by side in row e.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import BOARDS, CELL, MAX_SIDE, TEMPORARIES, Body
from socialai_dsl.widths import REGISTER, TOKEN, UNPINNED

RESETTING = -1
"""In `Register.ENDED` while reset code runs: nothing is drawn yet."""

ATTEMPTS = 64
"""How many rooms of an episode are drawn for one that is as required."""

# Constants that are arguments have the type of all numbers here, or Numba compiles the callee for each of them.
AGENT = np.int64(0)
ZERO = np.int64(0)
ONE = np.int64(1)
STILL = np.int64(Body.NONE)
NOTHING = np.int64(-1)
NO_PATH = np.int64(-1)
NO_CELL = np.int64(CELL - 1)
"""The cell of what is not in the room; operands from here on are cells."""

SCRATCH_BOARDS = BOARDS + 4
OCCUPIED = np.int64(BOARDS)
FREE = np.int64(BOARDS + 1)
FRONT = np.int64(BOARDS + 2)
SEEN = np.int64(BOARDS + 3)


class Key(IntEnum):
    """Words of a row of `State.keys`."""

    SEED = 0
    INDEX = 1
    EPISODE = 2
    KEY = 3  # of the episode, made of the three
    DIGEST = 4  # of the lines heard since the last reset
    PROGRAM = 5  # offset of the program in `words`
    POOL = (
        6  # programs to play: first entry of `choices`, number of entries << 32, 1 << 63 if one after another
    )
    ACT = 7  # of an episode in acts: which of them is played
    SPOILED = 8  # of an episode in acts: 1 if one of those before was no success
    WORDS = 9


class Link(IntEnum):
    """Words that follow a program in a batch. Right after them: for each action of the batch the program's own.

    Those that end in AT are addresses in the words of the program.
    """

    COUNTERS = 0  # first counter
    RULES = 1  # counters of rules, then come those of outcomes
    OUTCOMES = 2  # ways to end, deadly and time-out included
    VIEWS = 3  # first row of the views
    ACTIONS = 4  # choices of the batch's action space
    TEMPLATES = 5
    SLOTS = 6
    FIRST_ROLLING = 7  # the first and the last entity that may ever roll
    LAST_ROLLING = 8
    MORE = 9  # channels of the batch behind the fourth
    LOOKS = 10  # how many looks the program shows
    TEMPLATE_AT = 11  # for each template of the batch the program's own; -1 if it has none
    STRIDE_AT = 12  # for each template its filling without slots, and what the word of each slot counts
    SIZE_AT = 13  # for each slot how many words it has in the batch
    WORD_AT = 14  # for each word of each slot the program's own; -1 if it has none
    ENDING_AT = 15  # for each way to end the batch's own
    SUCCESS_AT = 16  # for each way to end whether it is a success
    LOOK_AT = 17  # for each look its channel, counted from the fifth
    LOOK_REGISTER_AT = 18  # for each entity the register of each look
    SEATS = 19  # seats that callers of the batch play, the agent's included
    TOKENS = 20  # tokens in a history of the batch
    END = 21


class Trait(IntEnum):
    """Bits that a batch adds to Header.FLAGS of its programs: what does not happen need not be asked for one by one."""

    GOES_BY_ITSELF = 1 << 20  # something counts or rolls
    PUSHED = (
        1 << 21
    )  # some object takes another status when it is pushed, or a member of the cast goes out of the way
    GESTURES = 1 << 22  # pictures of the batch have channels for where NPCs point and what they did last
    REWARDS = 1 << 23  # there are rewards besides that of an outcome
    MORE = 1 << 25  # pictures of the batch have channels of CELLS, of HANDS, or of looks
    HANDS = 1 << 26  # one for what NPCs carry
    CELLS = 1 << 27  # two for the cells that NPCs point at
    APART = 1 << 24  # some frame has code for what it perceives, or for the rest of a rule of `first`


class ArrayId(IntEnum):
    """The arrays of `Tables`, `State` and `Ports` in the order in which a call gets them, and then one more."""

    WORDS = 0
    VIEWS = 1
    CHOICES = 2
    WEIGHTS = 3
    REGISTERS = 4
    BOARDS = 5
    KEYS = 6
    TOKENS = 7
    IMAGE = 8
    EXTRA = 9
    ACTIONS = 10
    PINS = 11
    LAYOUT = 12
    CHOSEN = 13
    REWARD = 14
    TERMINATED = 15
    TRUNCATED = 16
    OUTCOME = 17
    FINAL_IMAGE = 18
    FINAL_TOKENS = 19
    FINAL_EXTRA = 20
    SUCCESS = 21
    ENDED = 22
    COUNTERS = 23
    SCRATCH = 24
    SETS = 25
    SPARE_REGISTERS = 26
    SPARE_BOARDS = 27
    SPARE_COUNTERS = 28
    IMAGE_IDS = 29
    REFUSED = 30
    PICTURE = 31
    SIZES = 32
    TAKEN = 33
    FLAT_ACTIONS = 34  # int64 (heads E S), the rows of ACTIONS one behind the other


class Size(IntEnum):
    """Entries of `Ports.sizes`."""

    REGISTERS = 0
    BOARD = 1
    TOKENS = 2
    EXTRA = 3
    SEATS = 4
    END = 5


class State(NamedTuple):
    """The state that persists from step to step. `tokens` and `image` are also the caller's observation."""

    registers: NDArray[np.int32]  # (E, R)
    boards: NDArray[
        np.uint32
    ]  # (E, H * W + 1 + 2 * H + W or more) cells as seen, the last off the canvas; solid, opaque rows; opaque columns
    keys: NDArray[np.uint64]  # (E, Key.WORDS + S - 1), the last as Key.DIGEST of seats other than the agent's
    tokens: NDArray[np.int16]  # (E, S L)
    image: NDArray[
        np.uint32
    ]  # (E S, 49) packed cells, from the player's left to its right, each from far to near
    extra: NDArray[
        np.uint16
    ]  # (E S, (49 N + 1) // 2) the bytes of the N channels behind the fourth, cell by cell


class Tables(NamedTuple):
    """The constant tables."""

    words: NDArray[np.int32]  # the programs, each followed by its link
    views: NDArray[
        np.uint16
    ]  # (poses, 49) cell of the board for each cell of the picture, by (y, x, direction)
    choices: NDArray[np.int64]  # offsets of programs, one pool behind the other
    weights: NDArray[
        np.int64
    ]  # of each choice and those before it in its pool, below 2**32; never decreasing


class Ports(NamedTuple):
    """The data that a call reads and writes besides the state."""

    actions: NDArray[np.int64]  # (E S, 3 + slots)
    pins: NDArray[np.int32]  # (layouts, R + 1) value of each register or UNPINNED; last: member of the pool
    layout: NDArray[np.int32]  # (E,) row of the pins that the next reset uses
    chosen: NDArray[np.bool_]  # (E,) rows that a reset is for
    reward: NDArray[np.float64]  # (E S,)
    terminated: NDArray[np.bool_]  # (E,)
    truncated: NDArray[np.bool_]  # (E,)
    outcome: NDArray[np.int32]  # (E,) of the episode that ended in this step, else -1
    final_image: NDArray[np.uint32]  # (E S, 49) last picture of an episode that was reset in the same step
    final_tokens: NDArray[np.int16]  # (E, S L)
    final_extra: NDArray[np.uint16]  # as `extra`
    success: NDArray[
        np.bool_
    ]  # (E S,) whether an episode ended in this step, and was a success in all its acts
    ended: NDArray[np.bool_]  # (E,) terminated or truncated
    counters: NDArray[np.int64]  # (counters of all programs,)
    scratch: NDArray[np.int64]  # (TEMPORARIES,)
    sets: NDArray[np.uint32]  # (SCRATCH_BOARDS * MAX_SIDE,)
    spare_registers: NDArray[np.int32]  # (R,) of a row that is played on for a look
    spare_boards: NDArray[np.uint32]  # (board,)
    spare_counters: NDArray[np.int64]  # (counters of all programs,)
    image_ids: NDArray[np.uint64]  # (E S,) digests of the pictures
    refused: NDArray[np.bool_]  # (E,) rows that were reset and found no room that is as required
    picture: NDArray[
        np.uint16
    ]  # bytes of `image` and `extra` cell by cell, (E S, (49 (4 + N) + 1) // 2); or (E S, 0)
    sizes: NDArray[np.int64]  # (Size.END,)
    taken: NDArray[np.bool_]  # (E S,) where a player sits; the agent's is always so


class Row(NamedTuple):
    """One environment: pointers to its rows of the above (`pointers.pointer`), for code that is compiled."""

    program: NDArray[np.int32]  # words from the program's first on
    registers: NDArray[np.int32]
    board: NDArray[np.uint32]
    key: NDArray[np.uint64]
    tokens: NDArray[np.int16]
    counters: NDArray[np.int64]  # from the program's first on
    pins: NDArray[np.int32]
    scratch: NDArray[np.int64]
    sets: NDArray[np.uint32]  # line y of board b is number b * MAX_SIDE + y


def empty_state(
    rows: int, registers: int, board: int, tokens: int, view: int, more: int, seats: int = 1
) -> State:
    """A state of zeros, with `more` channels behind the fourth; every row must be reset before it is used."""
    return State(
        registers=np.zeros((rows, registers), REGISTER),
        boards=np.zeros((rows, board), np.uint32),
        keys=np.zeros((rows, Key.WORDS + seats - 1), np.uint64),
        tokens=np.zeros((rows, seats * tokens), TOKEN),
        image=np.zeros((rows * seats, view * view), np.uint32),
        extra=np.zeros((rows * seats, (view * view * more + 1) // 2), np.uint16),
    )


def empty_ports(state: State, counters: int, slots: int, more: int) -> Ports:
    """Ports that fit a state with `more` channels behind the fourth, with nothing pinned and no outcome."""
    rows, registers = state.registers.shape
    players = len(state.image)
    picture = (state.image.shape[1] * (4 + more) + 1) // 2 if more else 0
    return Ports(
        actions=np.zeros((players, 3 + slots), np.int64),
        pins=no_pins(registers),
        layout=np.zeros(rows, np.int32),
        chosen=np.ones(rows, np.bool_),
        reward=np.zeros(players, np.float64),
        terminated=np.zeros(rows, np.bool_),
        truncated=np.zeros(rows, np.bool_),
        outcome=np.full(rows, -1, REGISTER),
        final_image=np.zeros_like(state.image),
        final_tokens=np.zeros_like(state.tokens),
        final_extra=np.zeros_like(state.extra),
        success=np.zeros(players, np.bool_),
        ended=np.zeros(rows, np.bool_),
        counters=np.zeros(counters, np.int64),
        scratch=np.zeros(TEMPORARIES, np.int64),
        sets=np.zeros(SCRATCH_BOARDS * MAX_SIDE, np.uint32),
        spare_registers=np.zeros(registers, REGISTER),
        spare_boards=np.zeros(state.boards.shape[1], np.uint32),
        spare_counters=np.zeros(counters, np.int64),
        image_ids=np.zeros(players, np.uint64),
        refused=np.zeros(rows, np.bool_),
        picture=np.zeros((players, picture), np.uint16),
        sizes=np.array(
            [registers, state.boards.shape[1], state.tokens.shape[1], state.extra.shape[1], players // rows],
            np.int64,
        ),
        taken=np.ones(players, np.bool_),
    )


def no_pins(registers: int) -> NDArray[np.int32]:
    """One row of pins that pins nothing: row 0 of every table of pins."""
    return np.full((1, registers + 1), UNPINNED, REGISTER)
