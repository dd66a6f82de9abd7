"""The agent's view: 7 x 7 cells of (type, colour, status, orientation)."""

from __future__ import annotations

import numpy as np

from tests.reference.world import AHEAD, COLORS, DIRECTIONS, TYPES, Cell, World

SIZE = 7
EMPTY, WALL = (1, 0, 0, 0), (2, 5, 0, 0)
NPC = 11


def picture(world: World, canvas: tuple[int, int]) -> np.ndarray:
    """`image[i, j]` shows the cell (6 - j) ahead and (i - 3) to the right of the agent; uint8 (7, 7, 4)."""
    image = np.empty((SIZE, SIZE, 4), dtype=np.uint8)
    agent = world.agent
    x, y = agent.cell or (0, 0)
    fx, fy = AHEAD[agent.facing]
    for i in range(SIZE):
        for j in range(SIZE):
            ahead, right = 6 - j, i - 3
            cell = (x + ahead * fx - right * fy, y + ahead * fy + right * fx)
            image[i, j] = EMPTY if ahead == right == 0 else shown(world, cell, canvas)
    return image


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
        type_ = TYPES[thing.type]
        tag = 1 if thing.status == "tagged" else 0
        status = 0 if thing.dark else type_.states.index(thing.status)
        return type_.code, COLORS.index(str(thing.color)), status, tag
    ground = world.terrain.get(cell)
    if ground is not None:
        return TYPES[ground].code, COLORS.index(str(TYPES[ground].color)), 0, 0
    return WALL if world.on_border(cell) else EMPTY


def direction_shown(world: World, facing: str) -> int:
    """The number of a direction; egocentric: 2 towards where the agent looks, 0 back at it."""
    number = DIRECTIONS.index(facing)
    return (number - DIRECTIONS.index(world.agent.facing) + 2) % 4 if world.egocentric else number
