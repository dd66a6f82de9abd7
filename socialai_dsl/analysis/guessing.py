"""The number of rooms, of several that look alike, that one behaviour can solve.

The rooms are played in lockstep: as long as everything that the agent sees and hears is the same in all of them, it
cannot but do the same in all. So a search over the states of all rooms together finds the most that any policy solves.
Where there are many states, sequences of actions are tried at random before: they find quickly what tells rooms apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import advance, begin
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.analysis.rooms import Plan, wins_of
from socialai_dsl.analysis.search import (
    Chances,
    RandomActions,
    Search,
    SearchVerdict,
    digests_of,
    multipliers,
    useful_actions,
)
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Header, Program, Register

_ROWS: Final = 4096
_WALKS: Final = 256
"""How many sequences of actions are tried at random, at most."""

_NEAR: Final = 3_000
"""The number of states searched before anything is tried at random."""

_LOOKED_INTO: Final = 6
_FEW_STATES: Final = 2_000
"""The number of sequences, among those that tell rooms apart, after which a solution is searched, and the number of
states of each search."""

_SEARCHES: Final = 2
"""Searches of single rooms begin wherever rooms come to look different; once they have looked at this many times
`effort.states`, no further one begins."""


class GuessingVerdict(Enum):
    """Whether a policy does better than a guess."""

    GUESSES = "guesses"  # no policy solves more of the rooms than a guess does
    KNOWS = "knows"  # some sequence of actions solves more of them
    TELLS_APART = "tells apart"  # the rooms come to look different while more of them can be solved
    UNDECIDED = "undecided"  # too many states, or no time


@dataclass(frozen=True)
class Guess:
    """The result for rooms that look alike.

    Attributes:
        answer: what a policy can do at most.
        states: how many different states of all rooms together were looked at.
        exact: False where chance during the episode was tried only in part, or where it was not found out whether rooms
            that look different can still be solved.
        step: after which they are known; of a guess that after which the rooms look different when it is too late.
    """

    answer: GuessingVerdict
    states: int
    exact: bool
    step: int | None = None


@dataclass
class _Together:
    """States of all rooms together that are reached in the same number of steps: (S, rooms, ...)."""

    registers: NDArray[np.int32]
    boards: NDArray[np.uint32]
    keys: NDArray[np.uint64]
    going: NDArray[np.bool_]
    won: NDArray[np.int64]  # (S,) weight of the rooms that are solved

    def __len__(self) -> int:
        return len(self.won)

    def part(self, rows: slice | NDArray[np.intp]) -> _Together:
        return _Together(*(array[rows] for array in vars(self).values()))

    def repeated(self, times: int) -> _Together:
        return _Together(*(np.repeat(array, times, axis=0) for array in vars(self).values()))


class Guessing:
    """Plays as many rooms of a program together as there are weights.

    Args:
        program: what is played.
        weights: int64 (rooms,), how likely each room is. A guess gets the greatest of them right.
    """

    def __init__(self, program: Program, weights: NDArray[np.int64]) -> None:
        self._program = program
        self._weights, self._level = weights, int(weights.max())
        self._relevance = Relevance.of(program)
        self._useful = useful_actions(program, self._relevance.whole_utterance)
        # Which line is said may tell something, too.
        self._chances = Chances(program, self._relevance, self._relevance.drawn)
        self._actions = np.repeat(self._useful, self._chances.count, axis=0)
        rooms = len(weights)
        self._at_once = max(1, _ROWS // (len(self._actions) * rooms))
        self._table = Table([program], self._at_once * len(self._actions) * rooms)
        begin(self._table, 0, None)
        self._alone = Search(program)
        self._solvable: dict[tuple[int, bytes], SearchVerdict] = {}
        self._wins = wins_of(program)
        self._heard = slice(
            program.header(Header.HEARD), program.header(Header.HEARD) + program.header(Header.HEARD_SIZE)
        )
        first = {text: number for number, text in reversed(list(enumerate(program.lines)))}
        self._texts = np.array([*(first[text] for text in program.lines), -1], np.int64)

    def solve(
        self,
        registers: NDArray[np.int32],
        boards: NDArray[np.uint32],
        keys: NDArray[np.uint64],
        effort: Effort,
        plans: Sequence[Plan] = (),
        surely: bool = False,
    ) -> Guess:
        """Play from rooms that look alike: registers (rooms, R), boards (rooms, C), keys (rooms, Key.WORDS).

        `plans` are sequences of actions that are tried first. With `surely` it is not enough that rooms look different
        of which it is not found out whether they can still be solved, as long as there is something else to try.
        """
        start = self._start(registers, boards, keys)
        self._solvable.clear()
        self._effort, self._surely = effort, surely
        self._left = _SEARCHES * effort.states
        if plans and (known := self._walked(start, plans, len(plans))) is not None:
            return known
        few = _NEAR * len(self._useful) // len(self._actions)
        near = self._searched(start, min(few, effort.states))
        if near.answer is not GuessingVerdict.UNDECIDED or effort.states <= few:
            return near
        return self._walked(start, (), _WALKS) or self._searched(start, effort.states)

    def _start(
        self, registers: NDArray[np.int32], boards: NDArray[np.uint32], keys: NDArray[np.uint64]
    ) -> _Together:
        """The rooms as they begin."""
        state = self._table.state
        return _Together(
            registers[None, :, : state.registers.shape[1]],
            boards[None, :, : state.boards.shape[1]],
            self._table.own_keys(keys)[None],
            np.ones((1, len(registers)), np.bool_),
            np.zeros(1, np.int64),
        )

    def first_difference(
        self,
        registers: NDArray[np.int32],
        boards: NDArray[np.uint32],
        keys: NDArray[np.uint64],
        effort: Effort,
    ) -> Plan | None:
        """The shortest sequence of actions after which rooms look different that looked alike; None if none is found.

        The rooms have to go on till then.
        """
        layer = self._start(registers, boards, keys)
        self._seen = set(self._digests(layer).tolist())
        plans: list[list[NDArray[np.int64]]] = [[]]
        while len(layer):
            following, longer = [], []
            for first in range(0, len(layer), self._at_once):
                part = slice(first, first + self._at_once)
                reached, alike = self._step(layer.part(part))
                made = [[*plan, action] for plan in plans[part] for action in self._actions]
                exact = np.arange(len(made)) % self._chances.count == 0
                apart = np.flatnonzero(~alike & reached.going.all(axis=1) & exact)
                if len(apart):
                    return made[int(apart[0])]
                kept = self._new(reached, alike & reached.going.all(axis=1) & exact)
                following.append(reached.part(kept))
                longer += [made[number] for number in kept.tolist()]
                if len(self._seen) > effort.states or effort.clock.is_over:
                    return None
            layer, plans = _joined(following), longer
        return None

    def _searched(self, layer: _Together, states: int) -> Guess:
        """Everything that can be done, breadth first, up to a number of states."""
        self._seen = set(self._digests(layer).tolist())
        clock = self._effort.clock
        step, late, perhaps = 0, None, None
        while len(layer):
            step += 1
            following = []
            for first in range(0, len(layer), self._at_once):
                reached, alike = self._step(layer.part(slice(first, first + self._at_once)))
                if (reached.won > self._level).any():
                    return Guess(GuessingVerdict.KNOWS, len(self._seen), True, step)
                hopeful = reached.won + reached.going @ self._weights > self._level
                following.append(reached.part(self._new(reached, hopeful & alike)))
                if late is None and (~alike).any():
                    late = step
                known = self._may_know(reached.part(np.flatnonzero(hopeful & ~alike)), states)
                if known is SearchVerdict.SOLVABLE:
                    return Guess(GuessingVerdict.TELLS_APART, len(self._seen), True, step)
                perhaps = perhaps or (step if known is SearchVerdict.UNDECIDED else None)
                if perhaps is not None and not self._surely:
                    return Guess(GuessingVerdict.TELLS_APART, len(self._seen), False, perhaps)
                if len(self._seen) > states or clock.is_over:
                    return Guess(GuessingVerdict.UNDECIDED, len(self._seen), False)
            layer = _joined(following)
        if perhaps is not None:
            return Guess(GuessingVerdict.TELLS_APART, len(self._seen), False, perhaps)
        return Guess(GuessingVerdict.GUESSES, len(self._seen), not self._relevance.drawn, late)

    # -- at random --

    def _walked(self, start: _Together, plans: Sequence[Plan], walks: int) -> Guess | None:
        """What sequences of actions find, those that are given and others at random; None where they find nothing."""
        walks = min(walks, self._table.rows // len(self._weights))
        plans = plans[:walks]
        together, acting = start.repeated(walks), RandomActions(self._useful, walks)
        looked_into = 0
        for step in range(self._program.header(Header.HORIZON)):
            actions = acting.next()
            for number, plan in enumerate(plans):
                if number < len(together) and step < len(plan):
                    actions[number] = plan[step]
            reached, alike = self._advance(together, actions, np.zeros(len(together), np.uint64))
            if (reached.won > self._level).any():
                return Guess(GuessingVerdict.KNOWS, step + 1, True, step + 1)
            hopeful = reached.won + reached.going @ self._weights > self._level
            for number in np.flatnonzero(hopeful & ~alike).tolist():
                if looked_into == _LOOKED_INTO or self._effort.clock.is_over:
                    break
                looked_into += 1
                known = self._may_know(reached.part(slice(number, number + 1)), _FEW_STATES)
                if known is SearchVerdict.SOLVABLE:
                    return Guess(GuessingVerdict.TELLS_APART, step + 1, True, step + 1)
            kept = np.flatnonzero(hopeful & alike)
            if not len(kept):
                return None
            plans = [plan for number, plan in enumerate(plans) if number in kept]
            together = reached.part(kept)
            acting.keep(kept)
        return None

    # -- when rooms look different --

    def _may_know(self, apart: _Together, states: int) -> SearchVerdict:
        """Whether more than a guess gets right can be solved, by who knows which room it is from here on; undecided
        where searches gave up on rooms that would be needed for it.
        """
        found = SearchVerdict.UNSOLVABLE
        for k in range(len(apart)):
            best = perhaps = int(apart.won[k])
            for room in np.flatnonzero(apart.going[k]).tolist():
                verdict = self._alone_in(apart.part(slice(k, k + 1)), room, states)
                best += int(self._weights[room]) * (verdict is SearchVerdict.SOLVABLE)
                perhaps += int(self._weights[room]) * (verdict is not SearchVerdict.UNSOLVABLE)
            if best > self._level:
                return SearchVerdict.SOLVABLE
            if perhaps > self._level:
                found = SearchVerdict.UNDECIDED
                if not self._surely:
                    break
        return found

    def _alone_in(self, state: _Together, room: int, states: int) -> SearchVerdict:
        """Whether a room can be solved from here on."""
        registers = state.registers[0, room]
        known = states, self._relevance.of_rows(registers).tobytes()
        if known not in self._solvable:
            start = registers, state.boards[0, room], state.keys[0, room]
            if self._left <= 0:
                return SearchVerdict.UNDECIDED
            # Chance makes many states, but where success is not rare a few walks find it.
            if self._alone.stumbles(*start):
                self._left -= _WALKS
                self._solvable[known] = SearchVerdict.SOLVABLE
            else:
                found = self._alone.solve(*start, states, self._effort.clock)
                self._left -= _WALKS + found.states
                self._solvable[known] = found.verdict
        return self._solvable[known]

    # -- steps --

    def _step(self, layer: _Together) -> tuple[_Together, NDArray[np.bool_]]:
        """Do everything in these states; what follows, and whether the rooms that go on still look alike."""
        count = len(layer)
        marks = self._chances.marks(
            int(layer.keys[0, 0, Key.KEY]), int(layer.registers[0, 0, Register.T]) + 1
        )
        return self._advance(
            layer, np.tile(self._actions, (count, 1)), np.tile(marks, count * len(self._useful))
        )

    def _advance(
        self, layer: _Together, actions: NDArray[np.int64], chance: NDArray[np.uint64]
    ) -> tuple[_Together, NDArray[np.bool_]]:
        """Do actions in each of S states, equally many, int64 (S times k, 4), with other draws of this step, uint64.

        What follows are views of the table, until the next step.
        """
        state, ports = self._table.state, self._table.batch.ports
        count, rooms = layer.going.shape
        times = len(actions) // count
        used = count * times * rooms
        going, won = np.repeat(layer.going, times, axis=0), np.repeat(layer.won, times)
        for own, given in (
            (state.registers, layer.registers),
            (state.boards, layer.boards),
            (state.keys, layer.keys),
        ):
            own[:used].reshape(count, times, rooms, -1)[...] = given[:, None]
        state.registers[used:, Register.ENDED] = 1
        state.registers[:used, Register.ENDED] = ~going.reshape(used)
        changed = np.repeat(chance, rooms)
        state.keys[:used, Key.KEY] ^= changed
        ports.actions[:used] = np.repeat(actions, rooms, axis=0)
        advance(self._table)
        state.keys[:used, Key.KEY] ^= changed

        registers = state.registers[:used]
        ended = (registers[:, Register.ENDED] != 0).reshape(-1, rooms)
        wins = self._wins[registers[:, Register.OUTCOME]].reshape(-1, rooms) & ended & going
        reached = _Together(
            registers.reshape(-1, rooms, registers.shape[1]),
            state.boards[:used].reshape(-1, rooms, state.boards.shape[1]),
            state.keys[:used].reshape(-1, rooms, state.keys.shape[1]),
            going & ~ended,
            won + wins @ self._weights,
        )
        return reached, self._look_alike(reached.going, self._observed(registers).reshape(-1, rooms))

    def _observed(self, registers: NDArray[np.int32]) -> NDArray[np.int64]:
        """A number for what the agent sees and has just heard, (rows,)."""
        size = self._heard.stop - self._heard.start
        spoken = np.arange(size) < registers[:, [Register.HEARD]]
        texts = self._texts[np.where(spoken, registers[:, self._heard], -1)]
        images = self._table.image_ids()[: len(registers)]
        digests: NDArray[np.int64] = images + texts @ multipliers(size).view(np.int64)
        return digests

    @staticmethod
    def _look_alike(going: NDArray[np.bool_], observed: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether all rooms that go on show the same, (S,)."""
        first = np.take_along_axis(observed, going.argmax(axis=1)[:, None], axis=1)
        return np.asarray(~(going & (observed != first)).any(axis=1))

    def _new(self, reached: _Together, wanted: NDArray[np.bool_]) -> NDArray[np.intp]:
        """The numbers of those wanted states, (S,), that were not seen before."""
        rows = np.flatnonzero(wanted)
        digests = self._digests(reached)[rows]
        _, firsts = np.unique(digests, return_index=True)
        new = [k for k in np.sort(firsts).tolist() if int(digests[k]) not in self._seen]
        self._seen.update(digests[new].tolist())
        return rows[new]

    def _digests(self, layer: _Together) -> NDArray[np.uint64]:
        count, rooms = layer.going.shape
        relevant = self._relevance.of_rows(layer.registers.reshape(count * rooms, layer.registers.shape[2]))
        # Of a room that has ended nothing matters any more.
        each = np.where(layer.going, digests_of(relevant).reshape(count, rooms), np.uint64(0))
        each *= multipliers(rooms + 1)[:-1]
        each ^= each >> np.uint64(31)
        won = layer.won.astype(np.uint64) * multipliers(rooms + 1)[-1]
        digests: NDArray[np.uint64] = each.sum(axis=1, dtype=np.uint64) + won
        return digests


def _joined(layers: Sequence[_Together]) -> _Together:
    """States of several layers in one; there is one layer at least."""
    columns = zip(*(vars(layer).values() for layer in layers), strict=True)
    return _Together(*(np.concatenate(arrays) for arrays in columns))
