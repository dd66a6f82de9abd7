"""Drawn rooms with known facts: members that are absent, and whether a success exists."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import advance, begin
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.search import Finding, Search, SearchVerdict
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, Field, Header, Program, Register
from socialai_dsl.semantics.free_cells import asks_about_cells
from socialai_dsl.semantics.plans import CheckedScenario, Placing


class Rooms:
    """Rooms 0, 1, ... of a seed, with a cache of the facts found about each.

    Args:
        checked: the scenario. program: of the same.
        effort: which rooms, and how many states of each are searched.
    """

    def __init__(self, checked: CheckedScenario, program: Program, effort: Effort) -> None:
        self.checked, self.program = checked, program
        self._effort = effort
        self._table = Table([program], effort.rooms)
        begin(self._table, effort.seed, None)
        state = self._table.state
        self._registers, self._boards = state.registers.copy(), state.boards.copy()
        self._keys = state.keys.copy()
        self._search = Search(program)
        self._findings: dict[int, Finding] = {}

    def start(self, room: int) -> Start:
        """How a room begins."""
        return Start(self._registers[room], self._boards[room], self._keys[room])

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
        return bool(self._registers[room, FIRST_ENTITY + ENTITY_FIELDS * number + Field.GONE])

    @cached_property
    def solved_by_idling(self) -> NDArray[np.bool_]:
        """In which rooms a success comes of itself, while the agent does nothing, (rooms,)."""
        registers = self._table.state.registers
        while not registers[:, Register.ENDED].all():
            self._table.batch.ports.actions[:] = idle(self.program)
            advance(self._table)
        return wins_of(self.program)[registers[:, Register.OUTCOME]]


def name_of(checked: CheckedScenario, number: int) -> str:
    """The scenario's name of an entity: `people[0]`."""
    entity = checked.entities[number]
    return entity.key if entity.index is None else f"{entity.key}[{entity.index}]"


def idle(program: Program) -> NDArray[np.int64]:
    """The action that does nothing and says nothing, int64 (3 + slots,)."""
    return np.array([program.header(Header.PRIMITIVES), *[0] * (2 + len(program.sentences.slots))], np.int64)


def wins_of(program: Program) -> NDArray[np.bool_]:
    """Which outcomes are successes, (outcomes + 1,); the last stands for none so far."""
    return np.array([outcome.success for outcome in program.outcome_table] + [False])
