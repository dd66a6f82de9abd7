"""The view of a seat: 7 x 7 cells of (type, colour, status, orientation)."""

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


def picture(world: World, canvas: tuple[int, int], viewer: Entity) -> np.ndarray:
    """`image[i, j]` shows the cell (6 - j) ahead and (i - 3) to the right of the viewer, a member with a seat; uint8
    (7, 7, 4), with gestures (7, 7, 6), with cells that are pointed at (7, 7, 8)."""
    behind = 4 + world.gestures + world.hands
    more = behind - 4 + len(world.shown_looks)
    image = np.full((SIZE, SIZE, 4 + more), NOTHING, dtype=np.uint8)
    eye = viewer.cell or NOWHERE
    bright = lit(world, eye, viewer.facing, SIZE) if world.occlusion and viewer.cell else None
    for i in range(SIZE):
        for j in range(SIZE):
            ahead, right = 6 - j, i - 3
            cell = cell_in_view(eye, viewer.facing, ahead, right)
            person = person_shown(world, cell, viewer)
            if bright is not None and (ahead, right) not in bright:
                image[i, j, :4] = UNSEEN
            elif ahead == right == 0:
                carried = world.carried_by(viewer)
                image[i, j, :4] = EMPTY if carried is None else thing_shown(carried)
                # Its own cell tells a player on which seat it sits.
                number = 0 if world.seats_hidden else world.seats.index(viewer)
                image[i, j, 3] = number or image[i, j, 3]
                image[i, j, behind:] = looks(world, carried)
            else:
                image[i, j, :4] = shown(world, cell, canvas, person, viewer)
                image[i, j, 4 : 4 + world.gestures] = gestures(world, person, viewer)[: world.gestures]
                if world.hands:
                    image[i, j, behind - 1] = hands(world, person)
                image[i, j, behind:] = looks(world, person or world.object_at(cell))
    return image


def person_shown(world: World, cell: Cell, viewer: Entity) -> Entity | None:
    """The member of the cast that is seen in a cell."""
    others = [member for member in world.members if member is not viewer and not world.npcs_hidden]
    return next((member for member in others if member.cell == cell), None)


def looks(world: World, entity: Entity | None) -> list[int]:
    """The numbers of the looks of what is seen."""
    has = {} if entity is None else entity.looks
    return [words.index(has[name]) if name in has else NOTHING for name, words in world.shown_looks.items()]


def hands(world: World, person: Entity | None) -> int:
    """What somebody carries: its type, and its colour times 32."""
    thing = None if person is None else world.carried_by(person)
    return NOTHING if thing is None else TYPES[thing.type].code + 32 * COLORS.index(str(thing.color))


def gestures(world: World, person: Entity | None, viewer: Entity) -> tuple[int, int, int, int]:
    """Where somebody points, its last act, and how far to the right and ahead of it the cell lies that it points at,
    from 128."""
    if person is None or person.cell is None:
        return NOTHING, NOTHING, NOTHING, NOTHING
    direction, right, ahead = person.pointing, NOTHING, NOTHING
    if isinstance(direction, tuple):
        right, ahead = (128 + cells for cells in right_and_ahead(viewer.facing, person.cell, direction))
        direction = quadrant(person.cell, direction)
    towards = NOTHING if direction is None else direction_shown(world, direction, viewer)
    act = LAST_ACTS.get(person.last_act, LAST_ACTS["none"])
    # Who was reset after pointing has taken its arm down.
    points = person.last_act == "point" and person.pointing is not None
    return towards, act + towards if points else act, right, ahead


def right_and_ahead(facing: str, start: Cell, goal: Cell) -> tuple[int, int]:
    """How many cells to the right of a cell, and ahead of it, another lies for one who looks that way."""
    dx, dy = goal[0] - start[0], goal[1] - start[1]
    return {"up": (dx, -dy), "right": (dy, dx), "down": (-dx, dy), "left": (-dy, -dx)}[facing]


def shown(
    world: World, cell: Cell, canvas: tuple[int, int], person: Entity | None, viewer: Entity
) -> tuple[int, int, int, int]:
    """What one cell looks like. Beyond the room but on the canvas it reads empty, off the canvas wall."""
    if not world.inside(cell):
        on_canvas = 0 <= cell[0] < canvas[0] and 0 <= cell[1] < canvas[1]
        return EMPTY if on_canvas else WALL
    if person is not None:
        way = direction_shown(world, person.facing, viewer)
        return NPC, COLORS.index(str(person.color)), person.kind_code, way
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


def direction_shown(world: World, facing: str, viewer: Entity) -> int:
    """The number of a direction; egocentric: 2 towards where the viewer looks, 0 back at it."""
    number = DIRECTIONS.index(facing)
    return (number - DIRECTIONS.index(viewer.facing) + 2) % 4 if world.egocentric else number
