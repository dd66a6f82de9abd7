"""A row of a table as a picture: the room from above, as RGB or as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.table import Table
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    NO_GESTURE,
    VIEW,
    EntityColumn,
    EntityName,
    Field,
    Flag,
    Header,
    Program,
    TypeColumn,
)
from socialai_dsl.render.gestures import Gesture, gestures_of
from socialai_dsl.render.grid import draw_ansi, draw_grid, figures, own_hands
from socialai_dsl.render.marks import Marks, marks_of
from socialai_dsl.render.panel import Face
from socialai_dsl.render.tiles import EMPTY, NPC, Code, draw_tile

_DOWN = 1
_GROUND = (EMPTY, 0, 0, 0)


@dataclass(frozen=True, eq=False)
class Scene:
    """The content of a picture of the room, for one of the seats.

    Attributes:
        codes: uint8 (H, W, 4), each cell's type, colour, status and orientation, without who has the seat.
        agent: x, y, direction of who has the seat; x and y are -1 once it has left the room.
        seen: bool (H, W), the cells in its field of view.
        below: (x, y) -> the object in whose cell an NPC stands.
        gestures: (x, y) -> where the NPC there points and what it did last.
        held: (x, y) -> what who has the seat or the NPC there carries, as far as the former sees it.
        marks: (x, y) -> the looks of what is seen there; where who has the seat stands, of what it carries.
    """

    codes: NDArray[np.uint8]
    agent: tuple[int, int, int]
    seen: NDArray[np.bool_]
    below: dict[tuple[int, int], Code]
    gestures: dict[tuple[int, int], Gesture]
    held: dict[tuple[int, int], Code]
    marks: dict[tuple[int, int], Marks]

    @property
    def own(self) -> Code | None:
        """What who has the seat carries."""
        return self.held.get(self.agent[:2])

    @property
    def own_words(self) -> list[str]:
        """A line on what it carries, if it carries something."""
        own, place = self.own, self.agent[:2]
        return [] if own is None else [own_hands(own, self.marks.get(place, ()))]


def scene(table: Table, row: int, seat: int = 0) -> Scene:
    """The scene of a row of the table for a seat, to which the agent is a member like the others."""
    own = table.member_at(row, seat)
    fields = _fields(table, row)
    pose = _pose(fields[own])
    codes, below = table.cells(row), _under_npcs(table, row, own)
    if own:
        _show_agent(table, row, codes, pose, below)
    width, height = table.room(row)
    gestures = gestures_of(table.program(row), table.state.registers[row])
    return Scene(
        codes[:height, :width],
        pose,
        _seen(table, row, pose)[:height, :width],
        {place: look for place, look in below.items() if place != pose[:2]},
        {place: gesture for place, gesture in gestures.items() if own == 0 or place != pose[:2]},
        _held(table, row, own),
        _marks(table, row, codes, own),
    )


def _pose(fields: NDArray[np.int32]) -> tuple[int, int, int]:
    """X, y, direction; x and y are -1 of one who has left the room."""
    if fields[Field.GONE]:
        return -1, -1, int(fields[Field.DIR])
    return int(fields[Field.X]), int(fields[Field.Y]), int(fields[Field.DIR])


def _show_agent(
    table: Table,
    row: int,
    codes: NDArray[np.uint8],
    own: tuple[int, int, int],
    below: Mapping[tuple[int, int], Code],
) -> None:
    """Show the agent among the NPCs, and what lies under who has the seat in its place."""
    program, agent = table.program(row), _fields(table, row)[0]
    x, y, _ = own
    if x >= 0 and codes[y, x, 0] == NPC:
        codes[y, x] = below.get((x, y), _GROUND)
    place = int(agent[Field.X]), int(agent[Field.Y])
    if place[0] >= 0 and not agent[Field.GONE] and not program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        kind = program.table(Header.ENTITY_AT)[0, EntityColumn.KIND]
        codes[place[1], place[0]] = NPC, agent[Field.COLOR], kind, agent[Field.DIR]


def frame(table: Table, row: int, mode: str, tile: int = 32, seat: int = 0) -> Any:
    """uint8 (H * tile, W * tile, 3) for rgb_array, a text for ansi."""
    shown = scene(table, row, seat)
    if mode == "ansi":
        told = figures(shown.codes, shown.gestures, held=shown.held, marks=shown.marks)
        return "\n".join([draw_ansi(shown.codes, shown.agent), *told, *shown.own_words])
    things = shown.below, shown.gestures, shown.held, shown.marks
    return draw_grid(shown.codes, shown.agent, shown.seen, tile, *things)


def plain_text(table: Table, row: int) -> str:
    """The room as text, without a word on what the letters do not say."""
    found = scene(table, row)
    return draw_ansi(found.codes, found.agent)


def coloured_text(table: Table, row: int, seat: int = 0) -> str:
    """The room as text with escape codes for colours, what is in view from a seat on a lighter ground.

    Where the scenario shows players gestures, lines below the room say who points and who did what last; where it
    shows hands, who carries what; where it shows looks, what has which.
    """
    found = scene(table, row, seat)
    shown = {place: gesture for place, gesture in found.gestures.items() if gesture.words}
    told = figures(found.codes, shown, {**shown, **found.held}, found.held, found.marks)
    told += found.own_words
    return "\n".join([draw_ansi(found.codes, found.agent, colour=True, seen=found.seen), *told])


def cast_of(table: Table, row: int, tile: int = 32) -> list[Face]:
    """The NPCs that the agent can see in a row: what the scenario calls them, with a name that was drawn.

    All look down; those that have left are shown as well.
    """
    if table.program(row).header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return []
    described, faces = table.describe(row), []
    for entity, code in looks_of_npcs(table, row).items():
        member = described[entity.key] if entity.index is None else described[entity.key][entity.index]
        name = f": {member['name']}" if "name" in member else ""
        faces.append(Face(f"{entity}{name}", draw_tile(code, None, False, tile)))
    return faces


def looks_of_npcs(table: Table, row: int) -> dict[EntityName, Code]:
    """The look of each NPC in a row, as if it looked down; also of those that have left or are hidden."""
    return {
        entity: (NPC, int(fields[Field.COLOR]), int(fields[Field.STATUS]), _DOWN)
        for entity, fields in zip(table.program(row).entities, _fields(table, row), strict=True)
        if entity.role == "npc"
    }


def _fields(table: Table, row: int) -> NDArray[np.int32]:
    """The registers of the entities in a row, (entities, ENTITY_FIELDS)."""
    count = len(table.program(row).entities)
    return table.state.registers[row, FIRST_ENTITY:][: ENTITY_FIELDS * count].reshape(-1, ENTITY_FIELDS)


def _under_npcs(table: Table, row: int, own: int) -> dict[tuple[int, int], Code]:
    """(x, y) -> the object in whose cell an NPC stands and is drawn; a cell of the canvas shows one of them.

    For a member other than the agent, the agent is one of them.
    """
    program = table.program(row)
    if program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return {}
    fields = _fields(table, row)
    present = {
        number: (int(entity[Field.X]), int(entity[Field.Y]))
        for number, entity in enumerate(fields)
        if entity[Field.X] >= 0 and not entity[Field.GONE]
    }
    roles = [entity.role for entity in program.entities]
    npcs = {place for number, place in present.items() if roles[number] == "npc" or (own and number == 0)}
    return {
        place: _look(program, number, fields[number])
        for number, place in present.items()
        if roles[number] == "object" and place in npcs
    }


def _held(table: Table, row: int, own: int) -> dict[tuple[int, int], Code]:
    """(x, y) -> what is in the hands of the member there: of others its type and colour, where players see them."""
    program = table.program(row)
    flags = program.header(Header.FLAGS)
    if not flags & Flag.CARRYING:
        return {}
    fields = _fields(table, row)
    shown = flags & Flag.SHOWS_CARRYING and not flags & Flag.NPCS_HIDDEN
    found: dict[tuple[int, int], Code] = {}
    for number, thing in enumerate(fields):
        carrier = int(thing[Field.CARRIER]) - 1
        if program.entities[number].role != "object" or carrier < 0:
            continue
        look = _look(program, number, thing)
        who = fields[carrier]
        if carrier == own:
            found[_pose(who)[:2]] = look
        elif shown and who[Field.X] >= 0 and not who[Field.GONE]:
            found.setdefault((int(who[Field.X]), int(who[Field.Y])), (*look[:2], 0, 0))
    return found


def _marks(table: Table, row: int, codes: NDArray[np.uint8], own: int) -> dict[tuple[int, int], Marks]:
    """(x, y) -> the looks of what is seen there; where a member with a seat stands itself, of what it carries."""
    program, registers = table.program(row), table.state.registers[row]
    if not program.looks:
        return {}
    fields = _fields(table, row)
    words, found = dict(program.looks), dict[tuple[int, int], Marks]()
    roles = [entity.role for entity in program.entities]
    things = [number for number, role in enumerate(roles) if role == "object"]
    npcs = [number for number, role in enumerate(roles) if role == "npc" and number != own]
    npcs = [0, *npcs] if own else npcs
    here = _pose(fields[own])[:2]
    # Of several in a cell the last object is seen, and the first NPC before all objects.
    for number in (*things, *reversed(npcs)):
        entity = fields[number]
        place = int(entity[Field.X]), int(entity[Field.Y])
        carried = roles[number] == "object" and entity[Field.CARRIER] == 1 + own
        away = place[0] < 0 or entity[Field.GONE] or place == here
        if not carried and (away or (codes[place[1], place[0], 0] == NPC) != (number in npcs)):
            continue
        shown = (int(registers[one]) if one else NO_GESTURE for one in program.look_table[number])
        found[here if carried else place] = marks_of(words, shown)
    return {place: marks for place, marks in found.items() if marks}


def _look(program: Program, number: int, entity: NDArray[np.int32]) -> Code:
    """How an object looks in its status."""
    first = program.table(Header.ENTITY_AT)[number, EntityColumn.TYPE]
    look = program.table(Header.TYPE_AT)[first + entity[Field.STATUS]]
    return (
        int(look[TypeColumn.CODE]),
        int(entity[Field.COLOR]),
        int(look[TypeColumn.STATUS]),
        int(look[TypeColumn.ORIENTATION]),
    )


def _seen(table: Table, row: int, pose: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Which cells of the canvas lie in the field of view of a member with this x, y, direction, bool (H, W)."""
    program = table.program(row)
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    x, y, direction = pose
    ys, xs = np.mgrid[:height, :width]
    dx, dy = xs - x, ys - y
    ahead_x, ahead_y = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
    ahead, aside = dx * ahead_x + dy * ahead_y, -dx * ahead_y + dy * ahead_x
    seen: NDArray[np.bool_] = (x >= 0) & (ahead >= 0) & (ahead < VIEW) & (abs(aside) <= VIEW // 2)
    return seen
