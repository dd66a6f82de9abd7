"""Positions of entities and relations between them, as tests and activities need them."""

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.state import AGENT, Row
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, EntityColumn, Field, Header, Register


@inline
def field(row: Row, entity: int, name: int) -> int:
    """One register of an entity."""
    return row.registers[FIRST_ENTITY + ENTITY_FIELDS * entity + name]


@inline
def set_field(row: Row, entity: int, name: int, value: int) -> None:
    """Write one register of an entity."""
    row.registers[FIRST_ENTITY + ENTITY_FIELDS * entity + name] = value


@inline
def column(row: Row, entity: int, name: int) -> int:
    """One word of the entity table."""
    return row.program[row.program[Header.ENTITY_AT] + EntityColumn.COLUMNS * entity + name]


@inline
def is_present(row: Row, entity: int) -> bool:
    """Whether the entity is in the room."""
    return field(row, entity, Field.GONE) == 0 and field(row, entity, Field.X) >= 0


@inline
def is_at(row: Row, entity: int, x: int, y: int) -> bool:
    """Whether the entity is in the room and in this cell."""
    return (
        field(row, entity, Field.X) == x
        and field(row, entity, Field.Y) == y
        and field(row, entity, Field.GONE) == 0
    )


@inline
def npc_at(row: Row, x: int, y: int) -> int:
    """The lowest NPC in this cell, 0 if there is none."""
    for npc in range(1, row.program[Header.NPCS] + 1):
        if is_at(row, npc, x, y):
            return npc
    return 0


@inline
def object_at(row: Row, x: int, y: int) -> int:
    """The object that lies on top in this cell, which is the last one there; 0 if there is none."""
    for entity in range(row.program[Header.ENTITIES] - 1, row.program[Header.NPCS], -1):
        if is_at(row, entity, x, y):
            return entity
    return 0


@inline
def step_x(direction: int) -> int:
    """How x changes one cell ahead in this direction."""
    return (1 - direction) * (1 - (direction & 1))


@inline
def step_y(direction: int) -> int:
    """How y changes one cell ahead in this direction."""
    return (2 - direction) * (direction & 1)


@inline
def distance(row: Row, a: int, b: int) -> int:
    """Manhattan distance of two entities."""
    return abs(field(row, a, Field.X) - field(row, b, Field.X)) + abs(
        field(row, a, Field.Y) - field(row, b, Field.Y)
    )


def _quadrants() -> NDArray[np.uint8]:
    """The direction of what lies (dx, dy) away, (27,): by signs, from -1 on, of dx, dy and |dx| - |dy|."""
    x, y, further = (sign.ravel() - 1 for sign in np.indices((3, 3, 3)))
    across, along = np.where(x > 0, 0, 2), np.where(y > 0, 1, 3)
    # On the diagonals SE is right, NE up, NW left, SW down.
    between = np.where(x > 0, np.where(y > 0, 0, 3), np.where(x < 0, np.where(y > 0, 1, 2), 1))
    return np.where(further > 0, across, np.where(further < 0, along, between)).astype(np.uint8)


_QUADRANTS = _quadrants()
_NEITHER = 13
_FIRST_OF = np.array([next((k for k in (1, 3, 0, 2) if ways >> k & 1), 0) for ways in range(16)])
_TURNS = (0, 3, 1, 2)


@inline
def sign(number: int) -> int:
    """-1, 0 or 1."""
    return np.int64(number > 0) - np.int64(number < 0)


@inline
def quadrant(dx: int, dy: int) -> int:
    """Direction of what lies dx to the right and dy down; on the diagonals SE is right, NE up, NW left, SW down.

    Looked up, because branches that go one way as often as the other cost most.
    """
    return np.int64(_QUADRANTS[9 * sign(dx) + 3 * sign(dy) + sign(abs(dx) - abs(dy)) + _NEITHER])


@inline
def preferred(row: Row, mover: int, ways: int) -> int:
    """Of several directions (bit k for direction k, at least one) the one that a mover takes.

    NPCs prefer down, up, right, left. The agent goes straight ahead, else left, right, back: it does not perceive which
    way is down.
    """
    if mover != AGENT:
        return _FIRST_OF[ways]
    ahead = field(row, mover, Field.DIR)
    for turn in _TURNS:
        if ways >> (ahead + turn & 3) & 1:
            return ahead + turn & 3
    return ahead


@inline
def front_direction(row: Row, entity: int) -> int:
    """Direction of the cell in front: a member's own, from a wall into the room; of other objects -1."""
    if entity <= row.program[Header.NPCS]:
        return field(row, entity, Field.DIR) & 3
    x = field(row, entity, Field.X)
    y = field(row, entity, Field.Y)
    if y == 0:
        return 1
    if y == row.registers[Register.HEIGHT] - 1:
        return 3
    if x == 0:
        return 0
    return 2 if x == row.registers[Register.WIDTH] - 1 else -1


@inline
def is_in_front(row: Row, x: int, y: int, entity: int) -> bool:
    """Whether a cell is the one in front of an entity."""
    direction = front_direction(row, entity)
    return (
        direction >= 0
        and x == field(row, entity, Field.X) + step_x(direction)
        and y == field(row, entity, Field.Y) + step_y(direction)
    )
