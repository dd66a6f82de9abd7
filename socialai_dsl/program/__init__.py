"""The narrow waist: what the compiler hands to the engine, and nothing else.

A `Program` is one int32 vector (`words`) that the engine reads, plus names and texts for people. `words` starts with a
header (`Header`), which holds sizes, flags and the offsets of the tables below. All offsets count from the first word
of the program, so programs can be laid one behind the other in a batch.

**State.** An environment is a row of int32 registers, a row of uint32 boards, and a row of uint64 keys (engine/state.py
gives shapes). Registers 0 to 31 are the same in every program (`Register`). From `FIRST_ENTITY` on follow the entities,
`ENTITY_FIELDS` registers each (`Field`): the agent is entity 0, NPCs follow in cast order, then objects in file order,
members of a group next to each other. Then come the program's own registers (drawn names, `let`, frame states, clocks,
...), the lines heard this step, the inboxes of the NPCs, and the log of lines heard since the last reset.

**Code.** An instruction is four words: op, a, b, c; `instructions.TABLE` says what each op does. Tests go on with the
next instruction if they hold and skip `c` instructions forward if not; nothing ever jumps backward. `EACH_CELL` is the
one loop: it runs the instructions up to its `END_EACH` once for each cell of a board, so it is bounded by the room.
Code starts at a `pc`, counted in instructions from the code table's start, and ends at `HALT`; pc 0 is a `HALT`, so an
entry of 0 means "nothing to do".

**Operands.** `v(x)`, the value of an operand word x: a constant x - CONSTANT if x >= CONSTANT // 2, x itself if it is
negative (`constant`); a temporary if x >= TEMPORARY; else the register x. Temporaries are int64 scratch of one run and
carry nothing from run to run. An entity is named by its number; where a place will do, also by a cell:
`CELL + 32 * y + x`, which is always present, never moves and faces nowhere. Boards are sets of cells, numbered 0 to
BOARDS - 1; they carry nothing from run to run.

**Utterance classes.** The compiler groups all pairs (template, noun) that no rule of the program tells apart into one
class; class 0 is silence, 1 is "said, but nothing any rule waits for". Tables are indexed by class, so a step visits
only rules that what was heard can fire.
"""

from __future__ import annotations

from socialai_dsl.program.format import (
    BOARDS,
    CELL,
    CHANNELS,
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    GESTURES,
    LAST_ACTS,
    LOOKS,
    MAX_SIDE,
    MOST_CHOICES,
    NO_ACTION,
    NO_GESTURE,
    POINTING_HERE,
    SECRET,
    TEMPORARIES,
    TEMPORARY,
    VERSION,
    VIEW,
    Body,
    Counting,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    LineColumn,
    Register,
    SeatColumn,
    SeatRegister,
    Side,
    TypeColumn,
    constant,
    constant_of,
    is_temporary,
    pack_cell,
    pack_held,
    place_of,
    unpack_held,
)
from socialai_dsl.program.instructions import CLASS_BITS, TESTS, Op, OpClass
from socialai_dsl.program.program import (
    EntityName,
    Outcome,
    Program,
    RegisterName,
    room_words,
)

__all__ = [
    "BOARDS",
    "CELL",
    "CHANNELS",
    "CLASS_BITS",
    "CONSTANT",
    "ENTITY_FIELDS",
    "FIRST_ENTITY",
    "GESTURES",
    "LAST_ACTS",
    "LOOKS",
    "MAX_SIDE",
    "MOST_CHOICES",
    "NO_ACTION",
    "NO_GESTURE",
    "POINTING_HERE",
    "SECRET",
    "TEMPORARIES",
    "TEMPORARY",
    "TESTS",
    "VERSION",
    "VIEW",
    "Body",
    "Counting",
    "EntityColumn",
    "EntityName",
    "Field",
    "Flag",
    "FrameColumn",
    "Header",
    "LineColumn",
    "Op",
    "OpClass",
    "Outcome",
    "Program",
    "Register",
    "RegisterName",
    "SeatColumn",
    "SeatRegister",
    "Side",
    "TypeColumn",
    "constant",
    "constant_of",
    "is_temporary",
    "pack_cell",
    "pack_held",
    "place_of",
    "room_words",
    "unpack_held",
]
