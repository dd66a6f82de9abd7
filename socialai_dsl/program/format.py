"""The layout of a program in words: its header, its tables, and an environment's registers."""

from __future__ import annotations

from enum import IntEnum

from socialai_dsl.widths import LARGEST_NUMBER

VERSION = 2
TEMPORARY = 8192
TEMPORARIES = 1 << 15
"""Room for the values of the largest rule that checking lets pass; only those in use are ever touched."""
CONSTANT = 1 << 20
"""Added to a constant to make an operand of it, unless that lies so far below zero that it is its own operand."""
_LEAST_ADDED_TO = -CONSTANT // 2
SECRET = 1 << 16
"""Added to the class of a line that the agent never hears: it is said to others alone."""
BOARDS = 256
"""Scratch boards (sets of cells): a few for each of the searches that an expression can have in each other."""

ENTITY_FIELDS = 10
FIRST_ENTITY = 32
CELL = 2048
"""Entity operands from here on are cells: `CELL + 32 * y + x`."""
NO_ACTION = 7
VIEW = 7
MAX_SIDE = 30
"""Widest and highest canvas: a row of a board is one 32-bit word."""


def constant(value: int) -> int:
    """The operand word of a known value."""
    assert abs(value) <= LARGEST_NUMBER, f"internal: the constant {value} does not fit into an operand"
    return value + CONSTANT if value >= _LEAST_ADDED_TO else value


def constant_of(operand: int) -> int | None:
    """The value that an operand word states, None if it names a register or temporary."""
    if operand < 0:
        return operand
    return operand - CONSTANT if operand >= CONSTANT // 2 else None


def is_temporary(operand: int, first: int = 0) -> bool:
    """Whether an operand word names a temporary, the first or a later one."""
    return TEMPORARY + first <= operand < TEMPORARY + TEMPORARIES


class Header(IntEnum):
    """Words of the header. Offsets (`*_AT`) count words from the program's start; `*_PC` are code addresses."""

    SIZE = 0  # words in the whole program
    REGISTERS = 1  # registers of a row
    CANVAS_WIDTH = 2
    CANVAS_HEIGHT = 3
    ENTITIES = 4  # agent + NPCs + objects
    NPCS = 5
    PRIMITIVES = 6  # the agent's body actions, without "no movement"
    TEMPLATES = 7
    NOUNS = 8
    CLASSES = 9  # utterance classes C, silence and "other" included
    HORIZON = 10
    FLAGS = 11  # see Flag
    TOKENS = 12  # L, length of the history buffer
    LOG = 13  # first register of the log, a ring of line numbers that begins at Register.OLDEST
    LOG_SIZE = 14  # how many lines it holds: never more than fit into L tokens
    HEARD = 15  # first register of the lines the agent heard this step, in the order spoken
    HEARD_SIZE = 16
    INBOX = 17  # first register of the inboxes: INBOX_SIZE + 1 registers for each NPC (count, then classes)
    INBOX_SIZE = 18
    FRAMES = 19  # frame instances; the agent's, if it has one, is the first
    DEADLY = 20  # bit k: type code k is deadly
    MIN_WIDTH = 21
    MIN_HEIGHT = 22
    HEIGHTS = 23  # number of heights: room template = (width - MIN_WIDTH) * HEIGHTS + height - MIN_HEIGHT
    OUTSIDE = 24  # packed code of a cell off the canvas
    CODE_AT = 25  # (I, 4)
    INSTRUCTIONS = 26
    ACTION_AT = 27  # (PRIMITIVES + 1,) index of the agent's primitive -> Body
    CLASS_AT = 28  # (TEMPLATES, NOUNS) -> utterance class, never 0
    ENTITY_AT = 29  # (ENTITIES, ENTITY_COLUMNS), see EntityColumn
    TYPE_AT = 30  # (rows, TYPE_COLUMNS): one row for each (type, status), see TypeColumn
    ROOM_AT = 31  # (templates, room_words): packed cells (the last is OUTSIDE), rows of bits, columns of bits
    FRAME_AT = 32  # (FRAMES, FRAME_COLUMNS), see FrameColumn
    STATE_AT = 33  # (states, 1 + 2 * (C + 1)): activity pc, `first` pc by class, `then` pc by class
    OUTCOME_AT = 34  # (C, 8) pc by utterance class and Body
    LINE_AT = 35  # (lines, LINE_COLUMNS), see LineColumn
    TOKEN_AT = 36  # (sum of line lengths,) token ids
    SITE_AT = 37  # (sites, 2): site, number | episodes in which it stays the same << 16 (draws.py)
    RESET_PC = 38
    SETTLE_PC = 39  # computed statuses; run when Register.CHANGED is set, always with Flag.SETTLE_ALWAYS
    RULES_PC = 40  # once a step after all turns: memories, then the rules of the world
    LINES = 41
    STATES = 42
    SITES = 43
    TYPE_ROWS = 44
    COUNTERS = 45  # rules, then outcomes, then deadly, time-out, episodes
    AGENT_SAYS = 46  # 1 + line spoken by the agent for pair (0, 0), if it hears itself; pairs follow row by row; else 0
    BEFORE_PC = 47  # run at the start of a step, before time goes on: what `prev` and memories ask
    LINKS_PC = 48  # what statuses change directly in others (`unlocks`); run when Register.CHANGED is set
    REQUIRE_PC = (
        49  # run after a reset; it sets Register.ACCEPTED to 1 if the room is as required. 0: it always is
    )
    TICK_PC = 50  # run once a step after the agent has moved: what counts by itself (timers)
    SLOPE = 51  # thousandths of the success reward that are lost by the horizon
    EACH_STEP = 52  # millionths that are added to the reward of every step; may be negative
    CLASS_SET_AT = (
        53  # (CLASS_SETS, CLASS_SET_WORDS): bit k % 32 of word k // 32 says whether class k is in it
    )
    CLASS_SETS = 54
    CLASS_SET_WORDS = 55
    # Channels of the picture: 4, 6 with pointing and last act, 8 with cells that are pointed at, 1 more with
    # `Flag.SHOWS_CARRYING`. Looks are not counted: their table, (ENTITIES, looks), is all that follows the table at
    # CLASS_SET_AT; see `Program.look_table`.
    CHANNELS = 56
    END = 57


class Flag(IntEnum):
    """Bits of Header.FLAGS."""

    NPCS_HIDDEN = 1
    PICTURE_BEFORE_NPCS = 2
    AGENT_FRAME = 4
    OWN_VOICE = 8
    SETTLE_ALWAYS = 16  # computed statuses depend on more than what sets Register.CHANGED
    EGOCENTRIC = 32  # the picture shows an NPC's direction as (direction - the agent's + 2) mod 4
    OCCLUSION = 64  # what is not transparent hides what lies behind it, from the agent and from `SEES`
    ROLLS = 128  # some type of object rolls
    CARRYING = 512  # some object can be carried
    SHOWS_CARRYING = 1024  # the picture has a channel for what NPCs carry
    HEARD_BY = (
        256  # an entry of an inbox has three registers: class, speaker, noun (-1 none); else only the class
    )
    SEATS = 2048  # others than the agent have a seat; behind the header stands the seat table, see SeatColumn
    SEATS_HIDDEN = 4096  # the own cell of the picture does not tell which seat it is


class Register(IntEnum):
    """Registers that every program has."""

    T = 0  # steps since reset
    WIDTH = 1
    HEIGHT = 2
    ROOM = 3  # room template
    ACTION = 4  # Body of the agent this step
    CLASS = 5  # utterance class of the agent this step, 0 silent
    TEMPLATE = 6  # of the agent's utterance this step, -1 silent
    NOUN = 7
    OUTCOME = 8  # index into Program.outcomes once the episode has ended, else -1
    PERCENT = 9  # of the reward, for that outcome
    HEARD = 10  # number of lines heard this step
    LOGGED = 11  # number of lines in the log
    TOKENS = 12  # number of tokens in the history
    ENDED = 13  # 1 terminated, 2 truncated, else 0; in NextStep mode the next step resets
    POKED = 14  # entity toggled at by the agent this step, -1 none (an NPC: it was poked)
    SAID_LINE = 15  # 1 + line that the entity on turn says this step, 0 none
    LAST_TURN = 16  # Body of the entity on turn
    UTTERANCE = 17  # of the agent this step: 1 + template * fillings + filling, 0 silent
    CHANGED = 18  # 1: what computed statuses may depend on has changed since they were last settled
    ACCEPTED = 19  # written by the code at REQUIRE_PC
    ATTEMPT = (
        20  # how many rooms of this episode were not as required; part of the key of every draw at reset
    )
    BONUS = 21  # per cent of the success reward that rules add to the reward of this step
    OLDEST = 22  # where in the log its oldest line is


class Field(IntEnum):
    """Registers of an entity."""

    X = 0
    Y = 1
    DIR = 2  # 0 right (east), 1 down (south), 2 left (west), 3 up (north)
    COLOR = 3  # 0 red, 1 green, 2 blue, 3 purple, 4 yellow, 5 grey
    STATUS = 4  # of an object: index into its type's states; of an NPC: its status code in the picture
    GONE = 5  # 1: not in the room
    POKED = 6  # NPC: 1 once it was poked in this episode; object: 1 while it reacts to no toggle and no push
    LAST = 7  # Body of its last turn
    POINTING = 8  # NPC: 0 not pointing, 1 + direction, or a cell as an operand; it lasts until it stops
    CARRIER = 8  # object: 0, or 1 + the member of the cast who carries it; then it is gone
    INSIDE = 9  # object that may lie in another: number of that object
    TOGGLED = 9  # NPC: number of the object that it toggled at in its last turn, 0 if none


class Body(IntEnum):
    """Body actions, in the order of the paper."""

    LEFT = 0
    RIGHT = 1
    FORWARD = 2
    PICKUP = 3
    DROP = 4
    TOGGLE = 5
    DONE = 6
    NONE = 7
    POINT = 8  # of NPCs only; the direction or the cell is in Field.POINTING
    STOP_POINTING = 9


class EntityColumn(IntEnum):
    """Columns of the entity table."""

    TYPE = 0  # first row in the type table; the status is added
    KIND = 1  # NPC: greatest status code it can have in the picture (see Field.STATUS); object: 0
    NEAR = 2  # least and greatest Manhattan distance at which its voice is heard
    FAR = 3
    MANNERS = 4  # member of the cast, bits: 1 heard even while NPCs are hidden, 2 moved by who walks into it
    VIEW = 5  # side of its view square
    PUSHED_BY = 6  # who can push an object: 0 anybody, 1 only what rolls; 2 is added if it can be carried
    ACCEPTS = 6  # member of the cast: 0 takes what it is given; else a register that is 1 while it does
    COLUMNS = 7


class TypeColumn(IntEnum):
    """Columns of the type table; one row for each status of each object type, one for NPCs, one for the agent."""

    CODE = 0  # type code in the picture
    STATUS = 1  # status code in the picture
    ORIENTATION = 2
    WALKABLE = 3
    TRANSPARENT = 4
    TOGGLED = 5  # status after a toggle (its own index if a toggle does nothing)
    PUSHED = (
        6  # status after a push: a body or something rolling tried to enter its cell (its own index: nothing)
    )
    ROLLS = 7  # 0, or: it moves one cell a step the way it was pushed; then 1 + its status when something is in its way
    COLUMNS = 8


class FrameColumn(IntEnum):
    """Columns of the frame table: one row for each (cast member, frame), in the order of their turns."""

    ENTITY = 0
    STATE = 1  # register of the state (counted from 0 within this frame)
    CLOCK = 2  # register: activities of this state that have been run
    ROWS = 3  # first row in the state table
    STATES = 4  # number of states
    INBOX = 5  # first register of its inbox
    PERCEIVE = 6  # code run at the start of its turn, before `first`: beliefs; 0 none
    DEFERRED = 7  # code run after the body action where a rule of `first` has chosen it: the rest of that rule; 0 none
    COLUMNS = 8


class SeatColumn(IntEnum):
    """Columns of the seat table: one row for each seat but the agent's, in the order of the cast.

    Before the rows stands their number, behind them for each line 1 + the pair of the grammar that says the same, or 0.
    """

    ENTITY = 0
    FIRST = 1  # first of its registers, see SeatRegister
    HEARD = 2  # first register of the lines it heard this step, as at Header.HEARD
    LOG = 3  # first register of its log, as at Header.LOG
    SAYS = 4  # code that says the line of SeatRegister.UTTERANCE
    COLUMNS = 5


class SeatRegister(IntEnum):
    """Registers of a seat other than the agent's, whose own are among `Register`."""

    TAKEN = 0  # 1: a player sits there in this step
    ACTION = 1  # Body of the player in this step
    UTTERANCE = 2  # 1 + pair of the player in this step, 0 silent
    LINE = 3  # 1 + line that it says in this step, 0 none
    HEARD = 4  # as Register.HEARD, LOGGED, TOKENS and OLDEST
    LOGGED = 5
    TOKENS = 6
    OLDEST = 7
    SHARE = 8  # as Register.PERCENT and BONUS
    BONUS = 9
    WISH = 10  # Body that its member's frame chose in its last turn, while a player sat there
    WISH_LINE = 11  # 1 + line that the frame chose to say, 0 none
    COUNT = 12


MOST_CHOICES = 7
"""The most actions that fit into the operand of `Op.CHOOSE`, which is a positive int32."""


class LineColumn(IntEnum):
    """Columns of the line table: one row for each thing that may be heard."""

    FIRST_TOKEN = 0
    TOKENS = 1
    CLASS = 2  # utterance class to NPCs that hear it, 1 if no rule waits for it; SECRET more if the agent never does
    NOUN = 3  # the filling that a pattern with slots finds in it; -1 none
    COLUMNS = 4


class Counting(IntEnum):
    """Which cells a rectangle is made of."""

    FLOOR = 0  # plain floor
    BUILT = 1  # floor and what is built on it, inside the walls
    ALL = 2  # all of the canvas


class Side(IntEnum):
    """Sides of a room."""

    TOP = 0
    BOTTOM = 1
    LEFT = 2
    RIGHT = 3


LAST_ACTS = {"forward": 0, "left": 1, "right": 2, "toggle": 3, "point": 4, "stop": 8, "none": 10}
"""Last acts of an NPC in the sixth channel; `point` has the direction added, relative if the picture is egocentric."""
NO_GESTURE = 255
"""In the channels behind the fourth: no NPC, or it does not point, carries nothing, or has no such look."""
LOOKS = ("type", "color", "status", "orientation")
"""The channels that say what a cell looks like."""
GESTURES = ("pointing", "last_act", "pointing_right", "pointing_ahead")
"""The channels of gestures: none of them, the first two, or all."""
POINTING_HERE = 128
"""In the last two of them: no cell to the right, or ahead, of the NPC that points at a cell."""
CHANNELS = (*LOOKS, *GESTURES, "carrying")
"""All channels of the picture that need no declaration, in their order; behind them come looks."""


def pack_held(code: int, color: int) -> int:
    """What an NPC carries, as the channel `carrying` shows it; its type code is below 32."""
    return code | color << 5


def unpack_held(value: int) -> tuple[int, int]:
    """Type code and colour of what the channel `carrying` shows."""
    return value & 31, value >> 5


def place_of(cell: int) -> tuple[int, int]:
    """The x and y of a cell that is given as an operand."""
    return (cell - CELL) % 32, (cell - CELL) // 32


def pack_cell(code: int, color: int = 0, status: int = 0, orientation: int = 0) -> int:
    """The four channels of a cell in one 32-bit word; its bytes in memory order are the channels."""
    return code | color << 8 | status << 16 | orientation << 24
