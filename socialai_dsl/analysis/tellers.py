"""Who or what makes two rooms look or sound different, by name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.rooms import name_of
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.values import shown
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, VIEW, Field, Flag, Header, Program
from socialai_dsl.semantics.plans import CheckedScenario, Entity
from socialai_dsl.semantics.terms import Const, Read

_PLACE: Final = (Field.X, Field.Y, Field.DIR)

SOMEBODY: Final = "somebody's words"
"""Tells where a line is heard whose speaker is not named."""


class Tellers:
    """Compares rooms of one program.

    Args:
        program: what is played. checked: of the same scenario.
    """

    def __init__(self, program: Program, checked: CheckedScenario) -> None:
        self._program, self._checked = program, checked
        self._before_npcs = bool(program.header(Header.FLAGS) & Flag.PICTURE_BEFORE_NPCS)

    def between(self, table: Table, rows: tuple[int, int], before: NDArray[np.int16]) -> list[str]:
        """Members, objects or `SOMEBODY` behind all that differs between two rows since the last step.

        `before` holds the registers of all rows before it, int16 (E, R). It is empty where only the walls differ.
        """
        heard = [table.heard(row) for row in rows]
        lines = set(heard[0]) ^ set(heard[1]) or {
            line for said in heard if heard[0] != heard[1] for line in said
        }
        found = [name for line in sorted(lines) for row in rows for name in self._speakers(line, table, row)]
        state = table.state
        differs = state.image[rows[0]] != state.image[rows[1]]
        if state.extra.shape[1]:
            differs = differs | (state.extra[rows[0]] != state.extra[rows[1]])
        for row in rows:
            found += self._seen(state.registers[row], before[row], differs)
        return list(dict.fromkeys(found))

    def _speakers(self, line: str, table: Table, row: int) -> Iterator[str]:
        if not self._checked.names_shown:
            yield SOMEBODY
            return
        registers = table.state.registers[row]
        for entity in self._checked.entities:
            called = self._called(entity, registers)
            if called is not None and line in table.heard(row) and line.startswith(f"{called}: "):
                yield name_of(self._checked, entity.number)

    def _called(self, entity: Entity, registers: NDArray[np.int16]) -> str | None:
        match entity.name:
            case Const(type=type_, value=value):
                return type_.words[value - type_.low]
            case Read(path=path):
                name = next(register for register in self._program.registers if register.path == path)
                return str(shown(self._program, name, int(registers[name.register])))
        return None

    def _seen(
        self, registers: NDArray[np.int16], before: NDArray[np.int16], differs: NDArray[np.bool_]
    ) -> Iterator[str]:
        """Who and what is shown in the cells that differ; the picture was taken before members moved, or after."""
        x, y, direction = (int(registers[FIRST_ENTITY + field]) for field in _PLACE)
        ahead_x, ahead_y = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
        for entity in self._checked.entities:
            first = FIRST_ENTITY + ENTITY_FIELDS * entity.number
            seen = before if self._before_npcs and entity.number else registers
            dx, dy = int(seen[first + Field.X]) - x, int(seen[first + Field.Y]) - y
            ahead, right = dx * ahead_x + dy * ahead_y, dy * ahead_x - dx * ahead_y
            if seen[first + Field.GONE] == 0 and 0 <= ahead < VIEW and abs(right) <= VIEW // 2:
                cell = (right + VIEW // 2) * VIEW + VIEW - 1 - ahead
                if differs[cell]:
                    yield name_of(self._checked, entity.number)
