"""How many of several rooms that look alike one and the same behaviour can solve.

The rooms are played in lockstep: as long as everything that the agent sees and hears is the same in all of them, it
cannot but do the same in all. So a search over the states of all rooms together finds the most that any policy solves.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.relevance import Relevance
from socialai_dsl.envs.search import CHANCES, Search, Verdict, marks, multipliers, useful_actions
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Header, Program, Register

_ROWS: Final = 4096


class Answer(Enum):
    """Whether a policy does better than a guess."""

    GUESSES = "guesses"  # no policy solves more of the rooms than a guess does
    KNOWS = "knows"  # some sequence of actions solves more of them
    TELLS_APART = "tells apart"  # the rooms come to look different while more of them can be solved
    UNDECIDED = "undecided"  # too many states


@dataclass(frozen=True)
class Guess:
    """What was found out about rooms that look alike.

    Attributes:
        answer: what a policy can do at most.
        states: how many different states of all rooms together were looked at.
        exact: False where chance during the episode was tried only in part.
    """

    answer: Answer
    states: int
    exact: bool


@dataclass
class _Together:
    """States of all rooms together that are reached in the same number of steps: (S, rooms, ...)."""

    registers: NDArray[np.int16]
    boards: NDArray[np.uint32]
    keys: NDArray[np.uint64]
    going: NDArray[np.bool_]
    won: NDArray[np.int64]  # (S,) weight of the rooms that are solved

    def __len__(self) -> int:
        return len(self.won)

    def part(self, rows: slice | NDArray[np.intp]) -> _Together:
        return _Together(*(array[rows] for array in vars(self).values()))


class Guessing:
    """Plays as many rooms of a program together as there are weights.

    Args:
        program: what is played.
        weights: int64 (rooms,), how likely each room is. A guess gets the greatest of them right.
    """

    def __init__(self, program: Program, weights: NDArray[np.int64]) -> None:
        self._weights, self._level = weights, int(weights.max())
        self._relevance = Relevance.of(program)
        actions = useful_actions(program, self._relevance.whole_utterance)
        chances = CHANCES if self._relevance.drawn else 1  # which line is said may tell something, too
        self._actions = np.repeat(actions, chances, axis=0)
        self._marks = np.tile(marks(chances), len(actions))
        rooms = len(weights)
        self._at_once = max(1, _ROWS // (len(self._actions) * rooms))
        self._table = Table([program], self._at_once * len(self._actions) * rooms, 1)
        self._table.reset(0, None)
        self._alone = Search(program)
        self._solvable: dict[bytes, bool] = {}
        self._wins = np.array([outcome.success for outcome in program.outcome_table] + [False])
        self._multipliers = multipliers(len(self._relevance.registers) * rooms + rooms + 1)
        self._heard = slice(
            program.header(Header.HEARD), program.header(Header.HEARD) + program.header(Header.HEARD_SIZE)
        )
        first = {text: number for number, text in reversed(list(enumerate(program.lines)))}
        self._texts = np.array([*(first[text] for text in program.lines), -1], np.int64)

    def solve(
        self,
        registers: NDArray[np.int16],
        boards: NDArray[np.uint32],
        keys: NDArray[np.uint64],
        states: int,
    ) -> Guess:
        """Play from rooms that look alike: registers (rooms, R), boards (rooms, C), keys (rooms, Key.WORDS)."""
        state = self._table.state
        keys = keys.copy()
        keys[:, [Key.PROGRAM, Key.POOL]] = state.keys[0, [Key.PROGRAM, Key.POOL]]
        layer = _Together(
            registers[None, :, : state.registers.shape[1]],
            boards[None, :, : state.boards.shape[1]],
            keys[None],
            np.ones((1, len(registers)), np.bool_),
            np.zeros(1, np.int64),
        )
        self._solvable.clear()
        self._seen = set(self._digests(layer).tolist())
        told_apart, exact = False, not self._relevance.drawn
        while len(layer):
            following = []
            for first in range(0, len(layer), self._at_once):
                reached, alike = self._step(layer.part(slice(first, first + self._at_once)))
                if (reached.won > self._level).any():
                    return Guess(Answer.KNOWS, len(self._seen), True)
                hopeful = reached.won + reached.going @ self._weights > self._level
                following.append(self._new(reached.part(np.flatnonzero(hopeful & alike))))
                apart = reached.part(np.flatnonzero(hopeful & ~alike))
                told_apart = told_apart or self._may_know(apart, states)
                if len(self._seen) > states:
                    return Guess(Answer.UNDECIDED, len(self._seen), False)
            layer = _Together(
                *(
                    np.concatenate(arrays)
                    for arrays in zip(*(vars(f).values() for f in following), strict=True)
                )
            )
        return Guess(Answer.TELLS_APART if told_apart else Answer.GUESSES, len(self._seen), exact)

    def _may_know(self, apart: _Together, states: int) -> bool:
        """Whether more than a guess might get right can be solved, by who knows which room it is from here on."""
        for k in range(len(apart)):
            best = int(apart.won[k])
            for room in np.flatnonzero(apart.going[k]).tolist():
                best += int(self._weights[room]) * self._may_be_solved(
                    apart.part(slice(k, k + 1)), room, states
                )
            if best > self._level:
                return True
        return False

    def _may_be_solved(self, state: _Together, room: int, states: int) -> bool:
        """Whether nothing is known to keep a room from being solved."""
        registers = state.registers[0, room]
        relevant = np.minimum(registers[self._relevance.registers], self._relevance.limits)
        known = relevant.tobytes()
        if known not in self._solvable:
            found = self._alone.solve(registers, state.boards[0, room], state.keys[0, room], states)
            self._solvable[known] = found.verdict is not Verdict.UNSOLVABLE
        return self._solvable[known]

    def _step(self, layer: _Together) -> tuple[_Together, NDArray[np.bool_]]:
        """Do everything in these states; what follows, and whether the rooms that go on still look alike."""
        state, ports = self._table.state, self._table.batch.ports
        count, rooms, choices = *layer.going.shape, len(self._actions)
        shape, used = (count, choices, rooms), count * choices * rooms
        before = _Together(*(np.repeat(array, choices, axis=0) for array in vars(layer).values()))
        state.registers[:used] = before.registers.reshape(used, -1)
        state.registers[used:, Register.ENDED] = 1
        state.registers[:used, Register.ENDED] = ~before.going.reshape(used)
        state.boards[:used] = before.boards.reshape(used, -1)
        keys = before.keys.reshape(used, -1).copy()
        own = keys[:, Key.KEY].copy()
        keys[:, Key.KEY] ^= np.repeat(np.tile(self._marks, count), rooms)
        state.keys[:used] = keys
        ports.actions[:used] = np.repeat(np.tile(self._actions, (count, 1)), rooms, axis=0)
        self._table.batch.step(Task.STEP_ONLY)

        registers, keys = state.registers[:used].copy(), state.keys[:used].copy()
        keys[:, Key.KEY] = own
        ended = (registers[:, Register.ENDED] != 0).reshape(-1, rooms)
        wins = self._wins[registers[:, Register.OUTCOME]].reshape(-1, rooms) & ended & before.going
        reached = _Together(
            registers.reshape(-1, rooms, registers.shape[1]),
            state.boards[:used].copy().reshape(-1, rooms, state.boards.shape[1]),
            keys.reshape(-1, rooms, keys.shape[1]),
            before.going & ~ended,
            before.won + wins @ self._weights,
        )
        assert reached.won.shape == (shape[0] * shape[1],), "internal: one sum for each state and action"
        return reached, self._look_alike(reached.going, self._observed(registers).reshape(-1, rooms))

    def _observed(self, registers: NDArray[np.int16]) -> NDArray[np.uint64]:
        """A number for what the agent sees and has just heard, (rows,)."""
        used, size = len(registers), self._heard.stop - self._heard.start
        images = self._table.state.image[:used].astype(np.uint64)
        extra = self._table.state.extra[:used].reshape(used, -1).astype(np.uint64)
        spoken = np.arange(size) < registers[:, [Register.HEARD]]
        texts = self._texts[np.where(spoken, registers[:, self._heard], -1)].view(np.uint64)
        parts = np.concatenate([images, extra, texts], axis=1)
        digests: NDArray[np.uint64] = parts @ multipliers(parts.shape[1])
        return digests

    @staticmethod
    def _look_alike(going: NDArray[np.bool_], observed: NDArray[np.uint64]) -> NDArray[np.bool_]:
        """Whether all rooms that go on show the same, (S,)."""
        first = np.take_along_axis(observed, going.argmax(axis=1)[:, None], axis=1)
        return np.asarray(~(going & (observed != first)).any(axis=1))

    def _new(self, reached: _Together) -> _Together:
        """Those states that were not seen before."""
        digests = self._digests(reached)
        _, firsts = np.unique(digests, return_index=True)
        new = [k for k in np.sort(firsts).tolist() if int(digests[k]) not in self._seen]
        self._seen.update(digests[new].tolist())
        return reached.part(np.array(new, np.intp))

    def _digests(self, layer: _Together) -> NDArray[np.uint64]:
        relevant = np.minimum(layer.registers[:, :, self._relevance.registers], self._relevance.limits)
        # Of a room that has ended nothing matters any more.
        relevant = np.where(layer.going[:, :, None], relevant, 0)
        flat = relevant.reshape(len(layer), relevant.shape[1] * relevant.shape[2])
        parts = np.concatenate([flat, layer.going, layer.won[:, None]], axis=1)
        digests: NDArray[np.uint64] = parts.astype(np.int64).view(np.uint64) @ self._multipliers
        return digests
