"""The agent's view: 7 x 7 cells of (type, colour, status, orientation)."""

from __future__ import annotations

import numpy as np

from tests.reference.sight import cell_in_view, lit
from tests.reference.world import COLORS, DIRECTIONS, TYPES, Cell, Entity, World, quadrant

SIZE = 7
UNSEEN = (0, 0, 0, 0)
NOTHING = 255  # in the channels of gestures
LAST_ACTS = {"forward": 0, "left": 1, "right": 2, "toggle": 3, "point": 4, "stop_pointing": 8, "none": 10}
EMPTY, WALL = (1, 0, 0, 0), (2, 5, 0, 0)
NPC = 11
NOWHERE = (-1000, -1000)
"""Where an agent looks from that had no cell to be put on: all that it sees lies off the canvas."""


def picture(world: World, canvas: tuple[int, int]) -> np.ndarray:
    """`image[i, j]` shows the cell (6 - j) ahead and (i - 3) to the right of the agent; uint8 (7, 7, 4), with gestures
    (7, 7, 6), with cells that are pointed at (7, 7, 8)."""
    behind = 4 + world.gestures + world.hands
    more = behind - 4 + len(world.shown_looks)
    image = np.full((SIZE, SIZE, 4 + more), NOTHING, dtype=np.uint8)
    agent = world.agent
    eye = agent.cell or NOWHERE
    bright = lit(world, eye, agent.facing, SIZE) if world.occlusion and agent.cell else None
    for i in range(SIZE):
        for j in range(SIZE):
            ahead, right = 6 - j, i - 3
            cell = cell_in_view(eye, agent.facing, ahead, right)
            if bright is not None and (ahead, right) not in bright:
                image[i, j, :4] = UNSEEN
            elif ahead == right == 0:
                carried = world.carried_by(agent)
                image[i, j, :4] = EMPTY if carried is None else thing_shown(carried)
                image[i, j, behind:] = looks(world, carried)
            else:
                image[i, j, :4] = shown(world, cell, canvas)
                image[i, j, 4 : 4 + world.gestures] = gestures(world, cell)[: world.gestures]
                if world.hands:
                    image[i, j, behind - 1] = hands(world, cell)
                image[i, j, behind:] = looks(world, npc_shown(world, cell) or world.object_at(cell))
    return image


def npc_shown(world: World, cell: Cell) -> Entity | None:
    """The NPC that is seen in a cell."""
    return next((npc for npc in world.npcs if npc.cell == cell and not world.npcs_hidden), None)


def looks(world: World, entity: Entity | None) -> list[int]:
    """The numbers of the looks of what is seen."""
    has = {} if entity is None else entity.looks
    return [words.index(has[name]) if name in has else NOTHING for name, words in world.shown_looks.items()]


def hands(world: World, cell: Cell) -> int:
    """What an NPC in the cell carries: its type, and its colour times 32."""
    npc = npc_shown(world, cell)
    thing = None if npc is None else world.carried_by(npc)
    return NOTHING if thing is None else TYPES[thing.type].code + 32 * COLORS.index(str(thing.color))


def gestures(world: World, cell: Cell) -> tuple[int, int, int, int]:
    """Where an NPC in the cell points, its last act, and how far to the right and ahead of it the cell lies that it
    points at, from 128."""
    npc = npc_shown(world, cell)
    if npc is None:
        return NOTHING, NOTHING, NOTHING, NOTHING
    direction, right, ahead = npc.pointing, NOTHING, NOTHING
    if isinstance(direction, tuple):
        right, ahead = (128 + cells for cells in right_and_ahead(world.agent.facing, cell, direction))
        direction = quadrant(cell, direction)
    towards = NOTHING if direction is None else direction_shown(world, direction)
    act = LAST_ACTS.get(npc.last_act, LAST_ACTS["none"])
    # Who was reset after pointing has taken its arm down.
    points = npc.last_act == "point" and npc.pointing is not None
    return towards, act + towards if points else act, right, ahead


def right_and_ahead(facing: str, start: Cell, goal: Cell) -> tuple[int, int]:
    """How many cells to the right of a cell, and ahead of it, another lies for one who looks that way."""
    dx, dy = goal[0] - start[0], goal[1] - start[1]
    return {"up": (dx, -dy), "right": (dy, dx), "down": (-dx, dy), "left": (-dy, -dx)}[facing]


def shown(world: World, cell: Cell, canvas: tuple[int, int]) -> tuple[int, int, int, int]:
    """What one cell looks like. Beyond the room but on the canvas it reads empty, off the canvas wall."""
    if not world.inside(cell):
        on_canvas = 0 <= cell[0] < canvas[0] and 0 <= cell[1] < canvas[1]
        return EMPTY if on_canvas else WALL
    for npc in world.npcs:
        if npc.cell == cell and not world.npcs_hidden:
            return NPC, COLORS.index(str(npc.color)), npc.kind_code, direction_shown(world, npc.facing)
    thing = world.object_at(cell)
    if thing is not None:
        return thing_shown(thing)
    ground = world.terrain.get(cell)
    if ground is not None:
        return TYPES[ground].code, COLORS.index(str(TYPES[ground].color)), 0, 0
    return WALL if world.on_border(cell) else EMPTY


def thing_shown(thing: Entity) -> tuple[int, int, int, int]:
    """What an object looks like."""
    type_ = TYPES[thing.type]
    seen = type_.initial if thing.dark else thing.status
    tag = 1 if seen == "tagged" else 0
    return type_.code, COLORS.index(str(thing.color)), type_.states.index(seen), tag


def direction_shown(world: World, facing: str) -> int:
    """The number of a direction; egocentric: 2 towards where the agent looks, 0 back at it."""
    number = DIRECTIONS.index(facing)
    return (number - DIRECTIONS.index(world.agent.facing) + 2) % 4 if world.egocentric else number
