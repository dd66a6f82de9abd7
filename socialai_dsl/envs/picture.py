"""A row of a table as a picture: the room from above, as RGB or as text."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.gestures import gestures_of
from socialai_dsl.envs.panel import Face
from socialai_dsl.envs.render import draw_ansi, draw_grid, figures
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.tiles import NPC, Code, draw_tile
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    VIEW,
    EntityColumn,
    Field,
    Flag,
    Header,
    Program,
    TypeColumn,
)

_DOWN = 1


def frame(table: Table, row: int, mode: str, tile: int = 32) -> Any:
    """uint8 (H * tile, W * tile, 3) for rgb_array, a text for ansi."""
    codes, agent = table.cells(row)
    width, height = table.room(row)
    gestures = gestures_of(table.program(row), table.state.registers[row])
    if mode == "ansi":
        return "\n".join([plain_text(table, row), *figures(codes[:height, :width], gestures)])
    seen = _seen(table, row, agent)[:height, :width]
    return draw_grid(codes[:height, :width], agent, seen, tile, _under_npcs(table, row), gestures)


def plain_text(table: Table, row: int) -> str:
    """The room as text, without a word on what the letters do not say."""
    codes, agent = table.cells(row)
    width, height = table.room(row)
    return draw_ansi(codes[:height, :width], agent)


def coloured_text(table: Table, row: int) -> str:
    """The room as text with escape codes for colours, what the agent has in view on a lighter ground.

    Where the scenario shows its agent gestures, lines below the room say who points and who did what last.
    """
    codes, agent = table.cells(row)
    width, height = table.room(row)
    seen = _seen(table, row, agent)[:height, :width]
    gestures = gestures_of(table.program(row), table.state.registers[row])
    shown = {place: gesture for place, gesture in gestures.items() if gesture.words}
    told = figures(codes[:height, :width], shown, shown)
    return "\n".join([draw_ansi(codes[:height, :width], agent, colour=True, seen=seen), *told])


def cast_of(table: Table, row: int, tile: int = 32) -> list[Face]:
    """The NPCs that the agent can see in a row: what the scenario calls them, with a name that was drawn.

    All look down; those that have left are shown as well.
    """
    program, registers = table.program(row), table.state.registers[row]
    if program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return []
    described = table.describe(row)
    faces = []
    for number, entity in enumerate(program.entities):
        if entity.role != "npc":
            continue
        fields = registers[FIRST_ENTITY + ENTITY_FIELDS * number :]
        code = (NPC, int(fields[Field.COLOR]), int(fields[Field.STATUS]), _DOWN)
        member = described[entity.key] if entity.index is None else described[entity.key][entity.index]
        name = f": {member['name']}" if "name" in member else ""
        faces.append(Face(f"{entity}{name}", draw_tile(code, None, False, tile)))
    return faces


def _under_npcs(table: Table, row: int) -> dict[tuple[int, int], Code]:
    """(x, y) -> the object in whose cell an NPC stands and is drawn; a cell of the canvas shows one of them."""
    program, registers = table.program(row), table.state.registers[row]
    if program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return {}
    fields = registers[FIRST_ENTITY:][: ENTITY_FIELDS * len(program.entities)].reshape(-1, ENTITY_FIELDS)
    present = {
        number: (int(entity[Field.X]), int(entity[Field.Y]))
        for number, entity in enumerate(fields)
        if entity[Field.X] >= 0 and not entity[Field.GONE]
    }
    roles = [entity.role for entity in program.entities]
    npcs = {place for number, place in present.items() if roles[number] == "npc"}
    return {
        place: _look(program, number, fields[number])
        for number, place in present.items()
        if roles[number] == "object" and place in npcs
    }


def _look(program: Program, number: int, entity: NDArray[np.int16]) -> Code:
    """How an object looks in its status."""
    entities, types = program.header(Header.ENTITY_AT), program.header(Header.TYPE_AT)
    kind = int(program.words[entities + EntityColumn.COLUMNS * number + EntityColumn.TYPE])
    first = types + TypeColumn.COLUMNS * (kind + int(entity[Field.STATUS]))
    look = program.words[first : first + TypeColumn.COLUMNS]
    return (
        int(look[TypeColumn.CODE]),
        int(entity[Field.COLOR]),
        int(look[TypeColumn.STATUS]),
        int(look[TypeColumn.ORIENTATION]),
    )


def _seen(table: Table, row: int, agent: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Which cells of the canvas lie in the agent's field of view, bool (H, W)."""
    program = table.program(row)
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    x, y, direction = agent
    ys, xs = np.mgrid[:height, :width]
    dx, dy = xs - x, ys - y
    ahead_x, ahead_y = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    ahead, aside = dx * ahead_x + dy * ahead_y, -dx * ahead_y + dy * ahead_x
    seen: NDArray[np.bool_] = (ahead >= 0) & (ahead < VIEW) & (abs(aside) <= VIEW // 2)
    return seen
