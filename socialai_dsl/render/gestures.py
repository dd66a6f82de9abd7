"""Where NPCs point and what they did last, as far as a scenario lets its agent see it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    LAST_ACTS,
    NO_GESTURE,
    Field,
    Flag,
    Header,
    Program,
)
from socialai_dsl.vocabulary import DIRECTIONS, TURN_WORDS

_DONE: Final = {"stop pointing": "stop"}


class Gesture(NamedTuple):
    """The gestures of an NPC.

    Attributes:
        pointing: the direction in which it points, 0 right, 1 down, 2 left, 3 up; None if it does not.
        act: what it did in its last turn, a key of `LAST_ACTS`.
    """

    pointing: int | None
    act: str

    @property
    def words(self) -> str:
        """The gesture in a few words, empty if there is nothing to say."""
        pointing = [] if self.pointing is None else [f"points {DIRECTIONS[self.pointing]}"]
        did = [] if self.act == "none" else [f"did {self.act}"]
        return ", ".join(pointing + did)


def gestures_of(program: Program, registers: NDArray[np.int16]) -> dict[tuple[int, int], Gesture]:
    """(x, y) -> the gesture of the NPC that is seen there; empty where the agent is not shown any."""
    if "pointing" not in program.channels or program.header(Header.FLAGS) & Flag.NPCS_HIDDEN:
        return {}
    found: dict[tuple[int, int], Gesture] = {}
    for number, entity in enumerate(program.entities):
        fields = registers[FIRST_ENTITY + ENTITY_FIELDS * number :]
        if entity.role != "npc" or fields[Field.X] < 0 or fields[Field.GONE]:
            continue
        pointing, act = int(fields[Field.POINTING]), TURN_WORDS[fields[Field.LAST]]
        act = _DONE.get(act, act)
        gesture = Gesture(pointing - 1 if pointing else None, act if act in LAST_ACTS else "none")
        found.setdefault((int(fields[Field.X]), int(fields[Field.Y])), gesture)
    return found


def gesture_shown(pointing: int, act: int) -> Gesture:
    """The gesture for the fifth and sixth channel of an NPC's cell, directions as they stand there."""
    known = [word for word, code in LAST_ACTS.items() if code <= act]
    return Gesture(None if pointing == NO_GESTURE else pointing, max(known, key=LAST_ACTS.__getitem__))
