"""Where NPCs point and what they did last, as far as a scenario lets its agent see it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import (
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    GESTURES,
    LAST_ACTS,
    NO_GESTURE,
    POINTING_HERE,
    Field,
    Flag,
    Header,
    Program,
    place_of,
)
from socialai_dsl.vocabulary import DIRECTIONS, TURN_WORDS

_DONE: Final = {"stop pointing": "stop"}


class Gesture(NamedTuple):
    """The gestures of an NPC.

    Attributes:
        pointing: the direction in which it points, 0 right, 1 down, 2 left, 3 up; None if it does not.
        act: what it did in its last turn, a key of `LAST_ACTS`.
        cell: how far to the right and down the cell lies that it points at; None if it points at none, or it is not
            shown which.
    """

    pointing: int | None
    act: str
    cell: tuple[int, int] | None = None

    @property
    def words(self) -> str:
        """The gesture in a few words, empty if there is nothing to say."""
        pointing = [] if self.pointing is None else [f"points {self._where(self.pointing)}"]
        did = [] if self.act == "none" else [f"did {self.act}"]
        return ", ".join(pointing + did)

    def _where(self, direction: int) -> str:
        if self.cell is None:
            return DIRECTIONS[direction]
        ways = zip(self.cell, (("right", "left"), ("down", "up")), strict=True)
        far = [f"{abs(cells)} {words[cells < 0]}" for cells, words in ways if cells]
        return f"at the cell {' and '.join(far)}" if far else "at its own cell"


def gestures_of(program: Program, registers: NDArray[np.int16]) -> dict[tuple[int, int], Gesture]:
    """(x, y) -> the gesture of the NPC that is seen there; empty where the agent is not shown any."""
    if "pointing" not in program.channels or program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return {}
    found: dict[tuple[int, int], Gesture] = {}
    for number, entity in enumerate(program.entities):
        fields = registers[FIRST_ENTITY + ENTITY_FIELDS * number :]
        if entity.role != "npc" or fields[Field.X] < 0 or fields[Field.GONE]:
            continue
        place = int(fields[Field.X]), int(fields[Field.Y])
        pointing, act = int(fields[Field.POINTING]), TURN_WORDS[fields[Field.LAST]]
        act = _DONE.get(act, act)
        act, cell = act if act in LAST_ACTS else "none", None
        if pointing >= CELL:
            x, y = place_of(pointing)
            cell = x - place[0], y - place[1]
            gesture = Gesture(_quadrant(*cell), act, cell if GESTURES[-1] in program.channels else None)
        else:
            gesture = Gesture(pointing - 1 if pointing else None, act)
        found.setdefault(place, gesture)
    return found


def gesture_shown(pointing: int, act: int, right: int = NO_GESTURE, ahead: int = NO_GESTURE) -> Gesture:
    """The gesture for the channels of an NPC's cell, directions as they stand there; ahead is up."""
    known = [word for word, code in LAST_ACTS.items() if code <= act]
    cell = None if right == NO_GESTURE else (right - POINTING_HERE, POINTING_HERE - ahead)
    return Gesture(None if pointing == NO_GESTURE else pointing, max(known, key=LAST_ACTS.__getitem__), cell)


def _quadrant(right: int, down: int) -> int:
    """The direction of what lies there; on the diagonals SE is right, NE up, NW left, SW down, and so is no way."""
    if abs(right) == abs(down):
        return {(True, True): 0, (True, False): 3, (False, False): 2, (False, True): 1}[right > 0, down >= 0]
    if abs(right) > abs(down):
        return 0 if right > 0 else 2
    return 1 if down > 0 else 3
