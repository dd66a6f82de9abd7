"""Hands: what members of the cast pick up, put down and give to each other."""

from socialai_dsl.engine.boards import draw_cell
from socialai_dsl.engine.entities import (
    column,
    field,
    is_at,
    npc_at,
    set_field,
    step_x,
    step_y,
)
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.pushing import is_free, put_on
from socialai_dsl.engine.state import AGENT, NOTHING, ONE, ZERO, Row
from socialai_dsl.program import CELL, EntityColumn, Field, Header, Register


@inline
def carried_by(row: Row, who: int) -> int:
    """The object that a member of the cast carries; 0 if its hands are empty."""
    for entity in range(row.program[Header.NPCS] + 1, row.program[Header.ENTITIES]):
        if field(row, entity, Field.CARRIER) == 1 + who:
            return entity
    return ZERO


@outline
def pick_up(row: Row, who: int) -> None:
    """Take what can be carried from the cell ahead, if nobody stands there and the hands are empty."""
    stay_outline()
    direction = field(row, who, Field.DIR)
    x = field(row, who, Field.X) + step_x(direction)
    y = field(row, who, Field.Y) + step_y(direction)
    thing = _carryable_at(row, x, y)
    if thing > 0 and _body_at(row, x, y) == NOTHING and carried_by(row, who) == 0:
        set_field(row, thing, Field.CARRIER, 1 + who)
        set_field(row, thing, Field.GONE, ONE)
        row.registers[Register.CHANGED] = 1
        draw_cell(row, x, y)


@outline
def put_down(row: Row, who: int) -> None:
    """Give what is carried to the member ahead, if it takes it, or lay it there, if something can roll there."""
    stay_outline()
    thing = carried_by(row, who)
    if thing == 0:
        return
    direction = field(row, who, Field.DIR)
    x = field(row, who, Field.X) + step_x(direction)
    y = field(row, who, Field.Y) + step_y(direction)
    other = _body_at(row, x, y)
    if other != NOTHING:
        if _accepts(row, other) and carried_by(row, other) == 0:
            set_field(row, thing, Field.CARRIER, 1 + other)
    elif is_free(row, x, y):
        put_on(row, thing, CELL + 32 * y + x)


@inline
def _carryable_at(row: Row, x: int, y: int) -> int:
    """The last object in this cell that can be carried and is not held back; 0 if there is none."""
    for entity in range(row.program[Header.ENTITIES] - 1, row.program[Header.NPCS], -1):
        can_be = column(row, entity, EntityColumn.PUSHED_BY) & 2 != 0
        if can_be and is_at(row, entity, x, y) and field(row, entity, Field.POKED) == 0:
            return entity
    return ZERO


@inline
def _body_at(row: Row, x: int, y: int) -> int:
    """The member of the cast in this cell, the agent before NPCs; -1 if there is none."""
    if is_at(row, AGENT, x, y):
        return AGENT
    npc = npc_at(row, x, y)
    return npc if npc > 0 else NOTHING


@inline
def _accepts(row: Row, who: int) -> bool:
    """Whether a member of the cast takes what it is given."""
    register = column(row, who, EntityColumn.ACCEPTS)
    return register == 0 or row.registers[register] != 0
