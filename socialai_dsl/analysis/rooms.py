"""Rooms as a seed draws them, one in each row of a table, drawn again and played side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from socialai_dsl.analysis.advance import advance, begin, begin_those_possible
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.envs.told_apart import Value, rooms_apart, values_apart
from socialai_dsl.envs.values import shown
from socialai_dsl.program import Header, Program, Register
from socialai_dsl.semantics.plans import CheckedScenario

Plan = Sequence[NDArray[np.int64]]
"""Actions, int64 (3 + slots,) each, one after the other."""


class DrawnRooms:
    """Rooms in the rows of a table, and how each of them began.

    Args:
        programs: row i plays `programs[i modulo their number]`, all of them with the outcomes of the first.
        rows: how many rooms there are; None: one for each program.

    Attributes:
        table: the rows.
    """

    def __init__(self, programs: Sequence[Program], rows: int | None = None) -> None:
        self.table = Table(programs, len(programs) if rows is None else rows)
        self._program, self._wins = programs[0], wins_of(programs[0])

    @classmethod
    def numbered(cls, program: Program, rooms: int, seed: int, all_possible: bool = True) -> Self:
        """Rooms 0 to rooms - 1 of a seed. Unless all are possible, those that cannot be drawn have ended."""
        drawn = cls([program], rooms)
        if all_possible:
            drawn.draw(seed)
        else:
            begin_those_possible(drawn.table, seed)
            drawn._keep_starts()
        return drawn

    # -- drawing --

    def draw(self, seed: int, index: ArrayLike | None = None, layouts: Any = None) -> None:
        """Draw a room in every row.

        Args:
            seed: of all rooms.
            index: the number of the room, for all rows or for each, int (rows,); None: 0, 1, ...
            layouts: what is given of the room, for each row.
        """
        given = {"index": index} if layouts is None else {"index": index, "layout": layouts}
        begin(self.table, seed, None if index is None else given)
        self._keep_starts()

    def draw_with(self, seed: int, index: ArrayLike, path: str, values: Sequence[int]) -> None:
        """Draw a room in every row with a given value of one draw; everything else is as it is drawn.

        Args:
            seed: of all rooms.
            index: the number of the room, for all rows or for each, int (rows,).
            path: of the draw, such as `let.exit`.
            values: for each row.
        """
        key = path.removeprefix("let.")
        self.draw(seed, index, [{"let": {key: one}} for one in self.named(path, values)])

    def named(self, path: str, values: Sequence[int]) -> list[Any]:
        """Values of a draw, `let.exit`, by the names they have in a layout."""
        name = next(register for register in self._program.registers if register.path == path)
        return [shown(self._program, name, value) for value in values]

    def _keep_starts(self) -> None:
        state = self.table.state
        self._starts = Start(state.registers.copy(), state.boards.copy(), state.keys.copy())

    # -- starts --

    def start(self, row: int) -> Start:
        """How a room began."""
        registers, boards, keys = self._starts
        return Start(registers[row], boards[row], keys[row])

    def starts(self, rows: slice | list[int]) -> Start:
        """How several rooms began: registers (rooms, R), boards (rooms, C), keys (rooms, Key.WORDS)."""
        registers, boards, keys = self._starts
        return Start(registers[rows], boards[rows], keys[rows])

    def restart(self, rows: list[int]) -> None:
        """Let these rows be where they began; all others have ended."""
        state = self.table.state
        state.registers[:, Register.ENDED] = 1
        registers, boards, keys = self.starts(rows)
        state.registers[rows], state.boards[rows], state.keys[rows] = registers, boards, keys

    def put(self, starts: Sequence[Start]) -> None:
        """Let the first rows be where rooms of this program began in other tables; all others have ended."""
        state = self.table.state
        state.registers[:, Register.ENDED] = 1
        for row, (registers, board, key) in enumerate(starts):
            state.registers[row] = registers[: state.registers.shape[1]]
            state.boards[row] = board[: state.boards.shape[1]]
            state.keys[row] = self.table.own_keys(key)

    # -- playing --

    def do(self, actions: NDArray[np.int64]) -> None:
        """Do an action, int64 (3 + slots,), or one in each row, (rows, 3 + slots), where episodes go on."""
        self.table.batch.ports.actions[:] = actions
        advance(self.table)

    def play(self, plan: Plan) -> None:
        """Do the actions of a plan in all rows, one after the other, where episodes go on."""
        for action in plan:
            self.do(action)

    def play_scripts(self) -> None:
        """Let the agents' own frames play all rows to the end."""
        while not self.ended.all():
            self.do(self.table.scripted_actions())

    @property
    def ended(self) -> NDArray[np.bool_]:
        """Which rooms have ended, (rows,)."""
        ended: NDArray[np.bool_] = self.table.state.registers[:, Register.ENDED] != 0
        return ended

    @property
    def won(self) -> NDArray[np.bool_]:
        """Which rooms have ended with a success, (rows,)."""
        return self.ended & self._wins[self.table.state.registers[:, Register.OUTCOME]]


def rooms_by_draw(loaded: LoadedScenario, rooms: int, seed: int) -> Mapping[Value, NDArray[np.int64]]:
    """The numbers of the rooms, 0 to rooms - 1 of a seed, by the draws by whose values results are told apart."""
    if not (draws := loaded.checked.results_by):
        return {}
    table = DrawnRooms.numbered(compile_loaded(loaded), rooms, seed).table
    return rooms_apart(values_apart(table.describe(room), draws) for room in range(rooms))


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


Actions = Callable[[int], NDArray[np.int64]]
"""What is done in each room in step t, int64 (rooms, 3 + slots)."""


def random_actions(program: Program, rooms: int, seed: int) -> Actions:
    """Any body action, and half of the time any utterance."""
    generator = np.random.default_rng(seed)
    sizes = [len(slot.words) for slot in program.sentences.slots]
    highest = np.array([program.header(Header.PRIMITIVES) + 1, 2, program.header(Header.TEMPLATES), *sizes])
    return lambda step: generator.integers(0, highest, (rooms, len(highest)))
