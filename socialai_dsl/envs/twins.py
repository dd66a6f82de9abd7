"""Rooms that differ only in the value of one draw, and what is seen and heard in them under the same actions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.rooms import name_of
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.values import shown
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, VIEW, Field, Flag, Header, Program, Register
from socialai_dsl.semantics.terms import Checked, Const, Entity, Read

_PLACE: Final = (Field.X, Field.Y, Field.DIR)
Actions = Callable[[int], NDArray[np.int64]]
"""What is done in each pair of twins in step t, int64 (pairs, 4)."""


@dataclass(frozen=True)
class Leak:
    """A pair of twins that could be told apart without a cue.

    Attributes:
        index: of the room. step: after which they differ; 0: from the start.
        values: what was drawn in either.
    """

    index: int
    step: int
    values: tuple[Any, Any]


@dataclass(frozen=True)
class Compared:
    """What playing pairs of twins showed.

    Attributes:
        pairs: how many were played. cued: how many differ first in a cue. leaks: the pairs that differ otherwise.
        rooms: the rooms of the pairs that differ.
    """

    pairs: int
    cued: int
    leaks: tuple[Leak, ...]
    rooms: tuple[int, ...]


def layouts(program: Program, path: str, values: Sequence[int]) -> list[dict[str, Any]]:
    """For each value of a draw (`let.exit`) the layout that gives it, and leaves everything else as it is drawn."""
    name = next(register for register in program.registers if register.path == path)
    key = path.removeprefix("let.")
    return [{"let": {key: shown(program, name, value)}} for value in values]


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
        checked: Checked,
        path: str,
        values: NDArray[np.int64],
        by: Sequence[str],
        seed: int,
    ) -> None:
        self._program, self._path, self._values = program, path, values
        self._hidden = not checked.names_shown
        self._by = [entity for entity in checked.entities if name_of(checked, entity.number) in by]
        self._before_npcs = bool(program.header(Header.FLAGS) & Flag.PICTURE_BEFORE_NPCS)
        self._table = Table([program], 2 * len(values), 1)
        given = [layout for pair in values.tolist() for layout in layouts(program, path, pair)]
        index = np.repeat(np.arange(len(values)), 2)
        self._table.reset(seed, {"index": index, "layout": given})

    def start(self, room: int) -> tuple[NDArray[np.int16], NDArray[np.uint32], NDArray[np.uint64]]:
        """How the two of a room begin: registers (2, R), boards (2, C), keys (2, Key.WORDS)."""
        rows, state = slice(2 * room, 2 * room + 2), self._table.state
        return state.registers[rows].copy(), state.boards[rows].copy(), state.keys[rows].copy()

    def play(self, actions: Actions) -> Compared:
        """Do the same in both of each pair until they differ or one of them ends."""
        pairs = len(self._values)
        state, ports = self._table.state, self._table.batch.ports
        running = pairs_alike(self._table)
        leaks = [self._leak(k, 0) for k in np.flatnonzero(~running).tolist()]
        cued, step = list[int](), 0
        while running.any():
            before = state.registers.copy()
            ports.actions[:] = np.repeat(actions(step), 2, axis=0)
            self._table.batch.step(Task.STEP_ONLY)
            step += 1
            running &= (state.registers[:, Register.ENDED] == 0).reshape(-1, 2).all(axis=1)
            for k in np.flatnonzero(running & ~pairs_alike(self._table)).tolist():
                running[k] = False
                if self._is_cue(k, before):
                    cued.append(k)
                else:
                    leaks.append(self._leak(k, step))
        return Compared(pairs, len(cued), tuple(leaks), (*cued, *(leak.index for leak in leaks)))

    def _leak(self, pair: int, step: int) -> Leak:
        first, second = layouts(self._program, self._path, self._values[pair].tolist())
        return Leak(pair, step, (*first["let"].values(), *second["let"].values()))

    def _is_cue(self, pair: int, before: NDArray[np.int16]) -> bool:
        """Whether what differs for the first time comes from one of the members."""
        rows = (2 * pair, 2 * pair + 1)
        heard = [self._table.heard(row) for row in rows]
        if heard[0] != heard[1] and any(
            self._is_by_member(line, row) for row, lines in zip(rows, heard, strict=True) for line in lines
        ):
            return True
        state = self._table.state
        differs = state.image[rows[0]] != state.image[rows[1]]
        if state.extra.shape[1]:
            differs = differs | (state.extra[rows[0]] != state.extra[rows[1]])
        return any(differs[cell] for row in rows for cell in self._cells_with_members(row, before[row]))

    def _is_by_member(self, line: str, row: int) -> bool:
        """Whether a line was said by one of the members; where names are hidden every line may have been."""
        return self._hidden or any(line.startswith(f"{self._name(one, row)}: ") for one in self._by)

    def _name(self, entity: Entity, row: int) -> str:
        match entity.name:
            case Const(type=type_, value=value):
                return type_.words[value - type_.low]
            case Read(path=path):
                name = next(register for register in self._program.registers if register.path == path)
                return str(shown(self._program, name, int(self._table.state.registers[row, name.register])))
        raise AssertionError("internal: a member's name is a value or a register")

    def _cells_with_members(self, row: int, before: NDArray[np.int16]) -> list[int]:
        """The cells of a row's picture that show one of the members; it was taken before they moved, or after."""
        registers = self._table.state.registers[row]
        x, y, direction = (int(registers[FIRST_ENTITY + field]) for field in _PLACE)
        ahead_x, ahead_y = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction]
        cells = []
        for entity in self._by:
            first = FIRST_ENTITY + ENTITY_FIELDS * entity.number
            seen = before if self._before_npcs else registers
            dx, dy = int(seen[first + Field.X]) - x, int(seen[first + Field.Y]) - y
            ahead, right = dx * ahead_x + dy * ahead_y, dy * ahead_x - dx * ahead_y
            if seen[first + Field.GONE] == 0 and 0 <= ahead < VIEW and abs(right) <= VIEW // 2:
                cells.append((right + VIEW // 2) * VIEW + VIEW - 1 - ahead)
        return cells


def random_actions(program: Program, pairs: int, seed: int) -> Actions:
    """Any body action, and half of the time any utterance."""
    generator = np.random.default_rng(seed)
    highest = np.array(
        [
            program.header(Header.PRIMITIVES) + 1,
            2,
            program.header(Header.TEMPLATES),
            program.header(Header.NOUNS),
        ]
    )
    return lambda step: generator.integers(0, highest, (pairs, 4))


class Script:
    """What the agent's own frame does in rooms 0, 1, ... of a seed, where it knows one of the two values.

    Args:
        program: of the scenario with a frame for the agent. path, values: of the draw, one value for each room.
    """

    def __init__(self, program: Program, path: str, values: Sequence[int], seed: int) -> None:
        self._table = Table([program], len(values), 1)
        given = layouts(program, path, values)
        self._table.reset(seed, {"index": np.arange(len(values)), "layout": given})

    def __call__(self, step: int) -> NDArray[np.int64]:
        """Its actions, which are also done in its own rooms."""
        actions = self._table.scripted_actions()
        self._table.batch.ports.actions[:] = actions
        self._table.batch.step(Task.STEP_ONLY)
        return actions


def pairs_alike(table: Table) -> NDArray[np.bool_]:
    """Whether rows 2k and 2k + 1 show the same and sound the same, (pairs,)."""
    state = table.state
    same = np.ones(len(state.registers) // 2, np.bool_)
    for array in (state.image, state.extra, state.tokens):
        same &= (array[0::2] == array[1::2]).reshape(len(same), -1).all(axis=1)
    return same


def alike(table: Table, rows: slice) -> bool:
    """Whether rooms that were just drawn show the same."""
    state = table.state
    return all(
        bool((array[rows] == array[rows][0]).all()) for array in (state.image, state.extra, state.tokens)
    )
