"""Boards: the look of each cell, and the cells that no body can enter."""

import numpy as np

from socialai_dsl.engine.entities import column, field, is_at, is_present, object_at
from socialai_dsl.engine.jit import inline, outline, stay_outline
from socialai_dsl.engine.state import ZERO, Row
from socialai_dsl.program import (
    EntityColumn,
    Field,
    Flag,
    Header,
    Register,
    TypeColumn,
)


@inline
def solid_line(row: Row, y: int) -> int:
    """Where the solid cells of a line of the room are in the board."""
    return row.program[Header.CANVAS_WIDTH] * row.program[Header.CANVAS_HEIGHT] + 1 + y


@inline
def opaque_line(row: Row, y: int) -> int:
    """Where the cells of a line of the room that one cannot look through are in the board."""
    return solid_line(row, y) + row.program[Header.CANVAS_HEIGHT]


@inline
def opaque_column(row: Row, x: int) -> int:
    """Where the cells of a column of the room that one cannot look through are in the board."""
    return opaque_line(row, row.program[Header.CANVAS_HEIGHT]) + x


@inline
def _set_bit(row: Row, line: int, x: int, value: bool) -> None:
    """Write one bit of a word of the board."""
    bit = np.int64(1) << x
    if value:
        row.board[line] = row.board[line] | bit
    else:
        row.board[line] = row.board[line] & ~bit


@inline
def _set_opaque(row: Row, x: int, y: int, value: bool) -> None:
    """Note whether one cannot look through a cell."""
    _set_bit(row, opaque_line(row, y), x, value)
    _set_bit(row, opaque_column(row, x), y, value)


@inline
def is_opaque(row: Row, x: int, y: int) -> bool:
    """Whether one cannot look through this cell: walls, objects that are not transparent, all off the canvas.

    While reset code runs that is so after `note_opaque` only.
    """
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    if x < 0 or x >= width or y < 0 or y >= height:
        return True
    return (row.board[opaque_line(row, y)] >> x) & 1 == 1


@inline
def is_solid(row: Row, x: int, y: int) -> bool:
    """Whether walls or objects keep bodies out of this cell; off the canvas always."""
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    if x < 0 or x >= width or y < 0 or y >= height:
        return True
    return (row.board[solid_line(row, y)] >> x) & 1 == 1


@inline
def is_deadly(row: Row, x: int, y: int) -> bool:
    """Whether the thing in this cell (which must be on the canvas) is deadly."""
    mask = row.program[Header.DEADLY]
    if mask == 0:
        return False
    code = row.board[y * row.program[Header.CANVAS_WIDTH] + x] & 0xFF
    return code < 32 and (mask >> code) & 1 == 1


@inline
def room_table(row: Row) -> int:
    """Offset of the template of this room."""
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    return row.program[Header.ROOM_AT] + row.registers[Register.ROOM] * (
        width * height + 1 + 3 * height + width
    )


@inline
def _built_opaque(row: Row) -> int:
    """Where the cells of the bare room that one cannot look through are: a word for each line, then for each column."""
    height = row.program[Header.CANVAS_HEIGHT]
    return room_table(row) + row.program[Header.CANVAS_WIDTH] * height + 1 + 2 * height


@inline
def npcs_are_hidden(row: Row) -> bool:
    """Whether the agent perceives no NPC."""
    return row.program[Header.FLAGS] & Flag.NPCS_HIDDEN != 0


@inline
def type_row(row: Row, entity: int) -> int:
    """Offset of the entity's row in the type table, by its status."""
    line = column(row, entity, EntityColumn.TYPE) + field(row, entity, Field.STATUS)
    return row.program[Header.TYPE_AT] + TypeColumn.COLUMNS * line


@inline
def is_deadly_under(row: Row, x: int, y: int) -> bool:
    """Whether the thing in this cell is deadly, whoever stands on it and is drawn over it."""
    mask = row.program[Header.DEADLY]
    if mask == 0:
        return False
    code = row.program[room_table(row) + y * row.program[Header.CANVAS_WIDTH] + x] & 0xFF
    top = object_at(row, x, y)
    if top > 0:
        code = row.program[type_row(row, top) + TypeColumn.CODE]
    return code < 32 and (mask >> code) & 1 == 1


@inline
def object_look(row: Row, entity: int) -> int:
    """Packed cell that shows an object."""
    table = type_row(row, entity)
    return (
        row.program[table + TypeColumn.CODE]
        | field(row, entity, Field.COLOR) << 8
        | row.program[table + TypeColumn.STATUS] << 16
        | row.program[table + TypeColumn.ORIENTATION] << 24
    )


@inline
def npc_look(row: Row, entity: int) -> int:
    """Packed cell that shows an NPC. Its status is the code itself."""
    table = row.program[Header.TYPE_AT] + TypeColumn.COLUMNS * column(row, entity, EntityColumn.TYPE)
    return (
        row.program[table + TypeColumn.CODE]
        | field(row, entity, Field.COLOR) << 8
        | field(row, entity, Field.STATUS) << 16
        | field(row, entity, Field.DIR) << 24
    )


@inline
def is_in_the_way(row: Row, entity: int) -> bool:
    """Whether this object keeps bodies out of its cell now."""
    return row.program[type_row(row, entity) + TypeColumn.WALKABLE] == 0


@inline
def _hides(row: Row, entity: int) -> bool:
    """Whether one cannot look through this object as it is now."""
    return row.program[type_row(row, entity) + TypeColumn.TRANSPARENT] == 0


@inline
def note_opaque(row: Row) -> None:
    """Note where one cannot look through in the whole room."""
    built = _built_opaque(row)
    lines = opaque_line(row, ZERO)
    for i in range(row.program[Header.CANVAS_HEIGHT] + row.program[Header.CANVAS_WIDTH]):
        row.board[lines + i] = row.program[built + i]
    first = row.program[Header.NPCS] + 1
    for entity in range(first, row.program[Header.ENTITIES]):  # what is furnished is not as it was built
        if is_present(row, entity):
            _set_opaque(row, field(row, entity, Field.X), field(row, entity, Field.Y), np.bool_(False))
    for entity in range(first, row.program[Header.ENTITIES]):
        if is_present(row, entity) and _hides(row, entity):
            _set_opaque(row, field(row, entity, Field.X), field(row, entity, Field.Y), np.bool_(True))


@outline
def draw_cell(row: Row, x: int, y: int) -> None:
    """Draw one cell anew: the room, over it the last object there, over it the lowest NPC if NPCs are shown.

    One object that is in the way is enough, wherever it lies; so is one that cannot be looked through.
    """
    stay_outline()
    width = row.program[Header.CANVAS_WIDTH]
    height = row.program[Header.CANVAS_HEIGHT]
    if x < 0 or x >= width or y < 0 or y >= height:
        return
    cell = y * width + x
    table = room_table(row)
    row.board[cell] = row.program[table + cell]
    npcs = row.program[Header.NPCS]
    solid = (row.program[table + width * height + 1 + y] >> x) & 1
    opaque = (row.program[_built_opaque(row) + y] >> x) & 1
    furnished = 0
    for entity in range(npcs + 1, row.program[Header.ENTITIES]):
        if is_at(row, entity, x, y):
            row.board[cell] = object_look(row, entity)
            solid = (solid & furnished) | np.int64(is_in_the_way(row, entity))
            opaque = (opaque & furnished) | np.int64(_hides(row, entity))
            furnished = 1
    _set_bit(row, solid_line(row, y), x, solid == 1)
    _set_opaque(row, x, y, opaque == 1)
    if npcs_are_hidden(row):
        return
    for entity in range(1, npcs + 1):
        if is_at(row, entity, x, y):
            row.board[cell] = npc_look(row, entity)
            break


@inline
def draw_npc(row: Row, npc: int) -> None:
    """Draw an NPC that is in the room and the lowest in its cell; gives what `draw_cell` gives for that cell."""
    if not npcs_are_hidden(row):
        cell = field(row, npc, Field.Y) * row.program[Header.CANVAS_WIDTH] + field(row, npc, Field.X)
        row.board[cell] = npc_look(row, npc)


@inline
def draw_entity(row: Row, entity: int) -> None:
    """Draw the cell of an entity anew, if it has one."""
    if field(row, entity, Field.X) >= 0:
        draw_cell(row, field(row, entity, Field.X), field(row, entity, Field.Y))


@inline
def draw_all(row: Row) -> None:
    """Draw every entity into the bare room; gives what `draw_cell` gives for each cell."""
    width = row.program[Header.CANVAS_WIDTH]
    npcs = row.program[Header.NPCS]
    entities = row.program[Header.ENTITIES]
    for entity in range(npcs + 1, entities):
        if is_present(row, entity):
            x = field(row, entity, Field.X)
            y = field(row, entity, Field.Y)
            row.board[y * width + x] = object_look(row, entity)
            _set_bit(row, solid_line(row, y), x, np.bool_(False))
    # What lies under something else may be in the way all the same.
    for entity in range(npcs + 1, entities):
        if is_present(row, entity) and is_in_the_way(row, entity):
            line = solid_line(row, field(row, entity, Field.Y))
            _set_bit(row, line, field(row, entity, Field.X), np.bool_(True))
    note_opaque(row)
    if npcs_are_hidden(row):
        return
    for entity in range(npcs, 0, -1):
        if is_present(row, entity):
            cell = field(row, entity, Field.Y) * width + field(row, entity, Field.X)
            row.board[cell] = npc_look(row, entity)


@inline
def copy_room(row: Row) -> None:
    """Copy the bare room of this size: its cells and its solid rows."""
    size = row.program[Header.CANVAS_WIDTH] * row.program[Header.CANVAS_HEIGHT] + 1
    table = room_table(row)
    for i in range(size + row.program[Header.CANVAS_HEIGHT]):
        row.board[i] = row.program[table + i]
