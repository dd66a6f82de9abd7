"""What moves others: put on a cell, pushed by a body, rolling until something blocks them."""

from socialai_dsl.engine.boards import draw_cell, is_deadly, is_in_the_way, is_solid, type_row
from socialai_dsl.engine.entities import (
    column,
    field,
    is_at,
    is_present,
    npc_at,
    set_field,
    step_x,
    step_y,
)
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import AGENT, ONE, RESETTING, ZERO, Link, Row
from socialai_dsl.engine.whereabouts import x_of, y_of
from socialai_dsl.program import EntityColumn, Field, Header, Register, TypeColumn


@inline
def put_on(row: Row, entity: int, thing: int) -> None:
    """Put an entity on the cell where a thing is, or was when it left the room; a body only where it can stand.

    It is in the room then. Nothing happens if that thing never had a cell.
    """
    x = x_of(row, thing)
    y = y_of(row, thing)
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    if x < 0 or x >= width or y < 0 or y >= height or is_at(row, entity, x, y):
        return
    drawn = row.registers[Register.ENDED] != RESETTING
    if drawn and entity <= row.program[Header.NPCS] and not is_free(row, x, y):
        return
    old_x = field(row, entity, Field.X)
    old_y = field(row, entity, Field.Y)
    set_field(row, entity, Field.X, x)
    set_field(row, entity, Field.Y, y)
    set_field(row, entity, Field.GONE, ZERO)
    if entity > row.program[Header.NPCS]:
        set_field(row, entity, Field.CARRIER, ZERO)
    row.registers[Register.CHANGED] = 1
    if drawn:
        draw_cell(row, old_x, old_y)
        draw_cell(row, x, y)


@inline
def is_free(row: Row, x: int, y: int) -> bool:
    """Whether an NPC or something rolling can enter this cell."""
    return (
        not is_solid(row, x, y)
        and not is_deadly(row, x, y)
        and npc_at(row, x, y) == 0
        and not is_at(row, AGENT, x, y)
    )


@inline
def _object_in_the_way(row: Row, x: int, y: int) -> int:
    """The last object that keeps others from entering this cell; 0 if there is none."""
    for entity in range(row.program[Header.ENTITIES] - 1, row.program[Header.NPCS], -1):
        if is_at(row, entity, x, y) and is_in_the_way(row, entity):
            return entity
    return 0


@outline
def push(row: Row, x: int, y: int, direction: int, rolling: int) -> None:
    """A body (`rolling` 0) or something rolling (1) wants to enter a cell where something is in its way."""
    stay_outline()
    entity = _object_in_the_way(row, x, y)
    if entity == 0 or field(row, entity, Field.POKED) != 0:
        return
    status = row.program[type_row(row, entity) + TypeColumn.PUSHED]
    only_rolling = column(row, entity, EntityColumn.PUSHED_BY) & 1
    if status != field(row, entity, Field.STATUS) and rolling >= only_rolling:
        set_field(row, entity, Field.DIR, direction)
        _become(row, entity, status)


@outline
def push_aside(row: Row, x: int, y: int, direction: int) -> None:
    """A body walks into a cell that is not solid: who can be pushed there goes on to the next one, if that is free."""
    stay_outline()
    who = npc_at(row, x, y)  # or the agent, which is 0
    ahead_x = x + step_x(direction)
    ahead_y = y + step_y(direction)
    if not is_at(row, who, x, y) or column(row, who, EntityColumn.MANNERS) & 2 == 0:
        return
    if is_free(row, ahead_x, ahead_y):
        set_field(row, who, Field.X, ahead_x)
        set_field(row, who, Field.Y, ahead_y)
        draw_cell(row, x, y)
        draw_cell(row, ahead_x, ahead_y)


@outline
def roll(row: Row) -> None:
    """Move each rolling object one cell, in order. One with an obstacle ahead pushes it, and rolls no more."""
    stay_outline()
    link = row.program[Header.SIZE]
    for entity in range(row.program[link + Link.FIRST_ROLLING], row.program[link + Link.LAST_ROLLING] + 1):
        if is_present(row, entity):
            rolls = row.program[type_row(row, entity) + TypeColumn.ROLLS]
            if rolls > 0:
                _roll_on(row, entity, rolls - 1)


@inline
def _roll_on(row: Row, entity: int, stopped: int) -> None:
    direction = field(row, entity, Field.DIR)
    x = field(row, entity, Field.X)
    y = field(row, entity, Field.Y)
    ahead_x = x + step_x(direction)
    ahead_y = y + step_y(direction)
    if is_free(row, ahead_x, ahead_y):
        set_field(row, entity, Field.X, ahead_x)
        set_field(row, entity, Field.Y, ahead_y)
        draw_cell(row, x, y)
        draw_cell(row, ahead_x, ahead_y)
    else:
        if is_solid(row, ahead_x, ahead_y):
            push(row, ahead_x, ahead_y, direction, ONE)
        _become(row, entity, stopped)


@inline
def _become(row: Row, entity: int, status: int) -> None:
    set_field(row, entity, Field.STATUS, status)
    row.registers[Register.CHANGED] = 1
    draw_cell(row, field(row, entity, Field.X), field(row, entity, Field.Y))
