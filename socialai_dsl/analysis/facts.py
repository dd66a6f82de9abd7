"""What is known of drawn rooms: members that are absent, and whether a success exists."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.rooms import DrawnRooms, idle, name_of
from socialai_dsl.analysis.search import Finding, Search, SearchVerdict
from socialai_dsl.envs.table import Start
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, Field, Program
from socialai_dsl.semantics.free_cells import asks_about_cells
from socialai_dsl.semantics.plans import CheckedScenario, Placing


class RoomFacts:
    """Rooms 0, 1, ... of a seed, with a cache of the facts found about each.

    Args:
        checked: the scenario. program: of the same.
        effort: which rooms, and how many states of each are searched.
    """

    def __init__(self, checked: CheckedScenario, program: Program, effort: Effort) -> None:
        self.checked, self.program = checked, program
        self._effort = effort
        self._drawn = DrawnRooms.numbered(program, effort.rooms, effort.seed)
        self._search = Search(program)
        self._findings: dict[int, Finding] = {}

    def start(self, room: int) -> Start:
        """How a room begins."""
        return self._drawn.start(room)

    def success(self, room: int, effort: Effort) -> Finding:
        """A shortest success in a room, with luck."""
        found = self._findings.get(room)
        if found is None or (found.verdict is SearchVerdict.UNDECIDED and not effort.clock.is_over):
            found = self._search.solve(*self.start(room), effort.states, effort.clock)
            self._findings[room] = found
        return found

    def missing(self, room: int, names: Collection[str]) -> list[str]:
        """Those of these members that are absent from a room although they were placed."""
        return [name for name in self._unasked if name in names and self._gone(room, self._unasked[name])]

    @cached_property
    def _unasked(self) -> dict[str, int]:
        """What was not asked to be out of the room: name -> number of the entity."""
        asked = {
            item.entity
            for item in self.checked.setup
            if isinstance(item, Placing)
            and (item.nowhere or item.inside is not None or not asks_about_cells(item))
        }
        numbers = range(len(self.checked.entities))
        return {name_of(self.checked, number): number for number in numbers if number not in asked}

    def _gone(self, room: int, number: int) -> bool:
        return bool(self._drawn.start(room).registers[FIRST_ENTITY + ENTITY_FIELDS * number + Field.GONE])

    @cached_property
    def solved_by_idling(self) -> NDArray[np.bool_]:
        """In which rooms a success comes of itself, while the agent does nothing, (rooms,)."""
        while not self._drawn.ended.all():
            self._drawn.do(idle(self.program))
        return self._drawn.won
