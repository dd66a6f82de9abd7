"""The first difference in sight or sound between rooms that differ in one draw, under equal actions, and its source."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.alike import pairs_alike
from socialai_dsl.analysis.rooms import Actions, DrawnRooms, name_of
from socialai_dsl.envs.table import Start, Table, joined
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

    def between(self, table: Table, rows: tuple[int, int], before: NDArray[np.int32]) -> list[str]:
        """Members, objects or `SOMEBODY` behind all that differs between two rows since the last step.

        `before` holds the registers of all rows before it, int32 (E, R). It is empty where only the walls differ.
        """
        heard = [table.heard(row) for row in rows]
        lines = set(heard[0]) ^ set(heard[1]) or {
            line for said in heard if heard[0] != heard[1] for line in said
        }
        found = [name for line in sorted(lines) for row in rows for name in self._speakers(line, table, row)]
        state, both = table.state, list(rows)
        pictures = joined(state.image[both], state.extra[both], table.channels)
        differs = (pictures[0] != pictures[1]).any(-1).ravel()  # (49,)
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
            if (
                called is not None
                and line in table.heard(row)
                and line.startswith((f"{called}: ", f"{called} to "))
            ):
                yield name_of(self._checked, entity.number)

    def _called(self, entity: Entity, registers: NDArray[np.int32]) -> str | None:
        match entity.name:
            case Const(type=type_, value=value):
                return type_.words[value - type_.low]
            case Read(path=path):
                name = next(register for register in self._program.registers if register.path == path)
                return str(shown(self._program, name, int(registers[name.register])))
        return None

    def _seen(
        self, registers: NDArray[np.int32], before: NDArray[np.int32], differs: NDArray[np.bool_]
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


# -- twins ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Leak:
    """A pair of twins that could be told apart without a cue.

    Attributes:
        index: of the room. step: after which they differ; 0: from the start.
        values: what was drawn in either. by: who or what differs, by name; empty where only the walls do.
    """

    index: int
    step: int
    values: tuple[Any, Any]
    by: tuple[str, ...]


@dataclass(frozen=True)
class TwinComparison:
    """The result of playing pairs of twins.

    Attributes:
        pairs: how many were played. cued: how many differ first in a cue. leaks: the pairs that differ otherwise.
        rooms: the rooms of the pairs that differ.
    """

    pairs: int
    cued: int
    leaks: tuple[Leak, ...]
    rooms: tuple[int, ...]


class Twins:
    """Pairs of rooms 0, 1, ... of a seed: rows 2k and 2k + 1 are room k, with two values of a draw.

    Args:
        program: what is played. checked: of the same scenario.
        path: of the draw. values: for each room the two values, (rooms, 2).
        by: members of the cast whose cues may differ.
    """

    def __init__(
        self,
        program: Program,
        checked: CheckedScenario,
        path: str,
        values: NDArray[np.int64],
        by: Sequence[str],
        seed: int,
    ) -> None:
        self._path, self._values = path, values
        self._cues, self._tellers = {*by, SOMEBODY}, Tellers(program, checked)
        self._drawn = DrawnRooms([program], 2 * len(values))
        self._drawn.draw_with(seed, np.repeat(np.arange(len(values)), 2), path, values.ravel().tolist())

    def start(self, room: int) -> Start:
        """How the two of a room begin: registers (2, R), boards (2, C), keys (2, Key.WORDS)."""
        return self._drawn.starts(slice(2 * room, 2 * room + 2))

    def play(self, actions: Actions) -> TwinComparison:
        """Do the same in both of each pair until they differ or one of them ends."""
        drawn, registers = self._drawn, self._drawn.table.state.registers
        running = pairs_alike(drawn.table)
        leaks = [self._leak(k, 0, self._between(k, registers)) for k in np.flatnonzero(~running).tolist()]
        cued, step = list[int](), 0
        while running.any():
            before = registers.copy()
            drawn.do(np.repeat(actions(step), 2, axis=0))
            step += 1
            running &= ~drawn.ended.reshape(-1, 2).any(axis=1)
            for k in np.flatnonzero(running & ~pairs_alike(drawn.table)).tolist():
                running[k] = False
                tellers = self._between(k, before)
                if self._cues.isdisjoint(tellers):
                    leaks.append(self._leak(k, step, tellers))
                else:
                    cued.append(k)
        return TwinComparison(
            len(self._values), len(cued), tuple(leaks), (*cued, *(leak.index for leak in leaks))
        )

    def _between(self, pair: int, before: NDArray[np.int32]) -> list[str]:
        return self._tellers.between(self._drawn.table, (2 * pair, 2 * pair + 1), before)

    def _leak(self, pair: int, step: int, by: Sequence[str]) -> Leak:
        first, second = self._drawn.named(self._path, self._values[pair].tolist())
        return Leak(pair, step, (first, second), tuple(by))


class Script:
    """The actions of the agent's own frame in rooms 0, 1, ... of a seed, where it knows one of the two values.

    Args:
        program: of the scenario with a frame for the agent. path, values: of the draw, one value for each room.
    """

    def __init__(self, program: Program, path: str, values: Sequence[int], seed: int) -> None:
        self._drawn = DrawnRooms([program], len(values))
        self._drawn.draw_with(seed, np.arange(len(values)), path, values)

    def __call__(self, step: int) -> NDArray[np.int64]:
        """Its actions, which are also done in its own rooms."""
        actions = self._drawn.table.scripted_actions()
        self._drawn.do(actions)
        return actions
