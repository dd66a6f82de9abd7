"""Breadth-first search through the agent's actions for whether a room can be solved.

States are searched breadth first and played on in batches by the engine itself, so the search knows no rule of its
own. Two states are one if they agree on everything that decides how they go on (`relevance`), whatever the time: the
first to be found is the earlier one, and with more time left nothing is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from enum import Enum
from functools import cache
from math import prod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import advance, begin
from socialai_dsl.analysis.effort import Clock, OutOfTimeError
from socialai_dsl.analysis.redrawn import sites_of
from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.draws import GOLDEN, MASK, below, draw, mix
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.vector_env import ScenarioVectorEnv
from socialai_dsl.program import Header, Program, Register

STATES: Final = 300_000
"""How many different states a search looks at before it gives up."""

_ROWS: Final = 4096
CHANCES: Final = 6
"""How many draws are tried of each step in which something is drawn; the first is the episode's own."""

_WALKS: Final = 96
"""How many walks at random look for a success."""

_SPEECH: Final = (0.0, 0.05, 0.3)
"""How often something is said in walks at random."""

_TRIED: Final = 64
"""The number of draws among which those that fall otherwise are looked for."""


class SearchVerdict(Enum):
    """The verdict of a search."""

    SOLVABLE = "solvable"
    UNSOLVABLE = "unsolvable"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Finding:
    """The result of a search in one room.

    Attributes:
        verdict: undecided where there are more states than it may look at.
        states: how many different states it looked at.
        plan: actions of a success, int64 (heads,) each; None without one, or where it needs chance to fall otherwise.
        exact: False where chance may still open a way that was not drawn.
        steps: length of the success that was found, whatever chance it needs; None without one.
    """

    verdict: SearchVerdict
    states: int
    plan: tuple[NDArray[np.int64], ...] | None
    exact: bool
    steps: int | None = None


def search_rooms(
    envs: ScenarioVectorEnv, rows: list[int], states: int = STATES, clock: Clock | None = None
) -> Iterator[Finding]:
    """Search the rooms that these environments are in, one after the other; the environments stay as they are.

    Rooms for which the clock leaves too little time are left out.
    """
    searches: dict[str, Search] = {}
    table = envs._table
    for row in rows:
        program = table.program(row)
        if program.sha256 not in searches:
            searches[program.sha256] = Search(program)
        finding = searches[program.sha256].solve(*table.start(row), states, clock)
        if clock is not None and clock.is_over and finding.verdict is SearchVerdict.UNDECIDED:
            return
        yield finding


@dataclass
class _Layer:
    """States that are reached in the same number of steps, and how: (S, ...) each."""

    registers: NDArray[np.int32]
    boards: NDArray[np.uint32]
    keys: NDArray[np.uint64]
    nodes: NDArray[np.int64]  # number of each state in the tree


class Search:
    """Searches rooms of one program.

    Args:
        program: what is played.
        goals: names of the outcomes that are looked for; None: the successes.
        witness: is shown the registers, int32 (S, R), that every round of steps leads to.
    """

    def __init__(
        self,
        program: Program,
        goals: Collection[str] | None = None,
        witness: Callable[[NDArray[np.int32]], None] | None = None,
    ) -> None:
        self._program = program
        self._witness = witness
        self._relevance = Relevance.of(program)
        actions = useful_actions(program, self._relevance.whole_utterance)
        self._chances = Chances(program, self._relevance, self._relevance.chance)
        self._actions = np.repeat(actions, self._chances.count, axis=0)
        self._at_once = max(1, _ROWS // len(self._actions))
        self._table = Table([program], self._at_once * len(self._actions))
        begin(self._table, 0, None)
        wanted = [o.success if goals is None else o.name in goals for o in program.outcome_table]
        self._wins = np.array([*wanted, False])

    def counters(self) -> dict[str, Any]:
        """How often each outcome and rule happened in all that was searched, as `Table.counters`."""
        return self._table.counters()

    def solve(
        self,
        registers: NDArray[np.int32],
        board: NDArray[np.uint32],
        key: NDArray[np.uint64],
        states: int = STATES,
        clock: Clock | None = None,
    ) -> Finding:
        """Search from one state: registers, int32 (R,), board, uint32 (C,), key, uint64 (Key.WORDS,).

        It is undecided as soon as the clock is over.
        """
        try:
            with nullcontext() if clock is None else clock.limiting():
                return self._solved(registers, board, key, states)
        except OutOfTimeError:
            if clock is None or not clock.is_over:
                raise  # of a clock around this one
            return Finding(SearchVerdict.UNDECIDED, len(self._parents), None, False)

    def _solved(
        self, registers: NDArray[np.int32], board: NDArray[np.uint32], key: NDArray[np.uint64], states: int
    ) -> Finding:
        state = self._table.state
        layer = _Layer(
            registers[None, : state.registers.shape[1]].copy(),
            board[None, : state.boards.shape[1]].copy(),
            self._table.own_keys(key[None]),
            np.zeros(1, np.int64),
        )
        self._parents, self._choices = [-1], [-1]
        self._seen = set(self._digests(layer.registers).tolist())
        while len(layer.nodes):
            following: list[_Layer] = []
            for first in range(0, len(layer.nodes), self._at_once):
                part = slice(first, first + self._at_once)
                winner = self._expand(layer, part, following)
                if winner is not None:
                    chosen = self._choices_to(*winner)
                    return Finding(
                        SearchVerdict.SOLVABLE, len(self._parents), self._plan(chosen), True, len(chosen)
                    )
                if len(self._parents) > states:
                    return Finding(SearchVerdict.UNDECIDED, len(self._parents), None, False)
            layer = _joined(following, layer)
        return Finding(SearchVerdict.UNSOLVABLE, len(self._parents), None, not self._relevance.chance)

    def stumbles(
        self, registers: NDArray[np.int32], board: NDArray[np.uint32], key: NDArray[np.uint64]
    ) -> bool:
        """Whether a success is found by acting at random from one state, as for `solve`, without other draws."""
        state, ports = self._table.state, self._table.batch.ports
        walks = min(_WALKS, self._table.rows)
        acting = RandomActions(self._actions[:: self._chances.count], walks)
        state.registers[walks:, Register.ENDED] = 1
        state.registers[:walks] = registers[: state.registers.shape[1]]
        state.boards[:walks] = board[: state.boards.shape[1]]
        state.keys[:walks] = self._table.own_keys(key)
        ended = state.registers[:walks, Register.ENDED]
        while not ended.all():
            ports.actions[:walks] = acting.next()
            advance(self._table)
            if self._wins[state.registers[:walks, Register.OUTCOME][ended != 0]].any():
                return True
        return False

    def _expand(self, layer: _Layer, part: slice, following: list[_Layer]) -> tuple[int, int] | None:
        """Do everything in a part of the states; the node and choice of a success, or the new states are noted."""
        state, ports = self._table.state, self._table.batch.ports
        nodes, choices = layer.nodes[part], len(self._actions)
        used = len(nodes) * choices
        state.registers[:used] = np.repeat(layer.registers[part], choices, axis=0)
        state.registers[used:, Register.ENDED] = 1
        state.boards[:used] = np.repeat(layer.boards[part], choices, axis=0)
        keys = np.repeat(layer.keys[part], choices, axis=0)
        episode_keys = keys[:, Key.KEY].copy()
        marks = self._chances.marks(int(layer.keys[0, Key.KEY]), int(layer.registers[0, Register.T]) + 1)
        keys[:, Key.KEY] ^= np.tile(marks, used // self._chances.count)
        state.keys[:used] = keys
        ports.actions[:used] = np.tile(self._actions, (len(nodes), 1))
        advance(self._table)

        reached = state.registers[:used]
        if self._witness is not None:
            self._witness(reached)
        ended = reached[:, Register.ENDED] != 0
        wins = np.flatnonzero(ended & self._wins[reached[:, Register.OUTCOME]])
        if len(wins):
            # Of several take one without foreign chance, if there is one.
            best = min(wins.tolist(), key=lambda row: row % self._chances.count != 0)
            return int(nodes[best // choices]), best % choices
        going = np.flatnonzero(~ended)
        digests = self._digests(reached[going])
        # Of the same state reached twice the first row counts: among them the episode's own chance comes first.
        _, firsts = np.unique(digests, return_index=True)
        new = [k for k in np.sort(firsts).tolist() if int(digests[k]) not in self._seen]
        if not new:
            return None
        self._seen.update(digests[new].tolist())
        rows = going[new]
        count = len(self._parents)
        self._parents += nodes[rows // choices].tolist()
        self._choices += (rows % choices).tolist()
        keys = state.keys[rows].copy()
        keys[:, Key.KEY] = episode_keys[rows]
        following.append(
            _Layer(
                state.registers[rows].copy(),
                state.boards[rows].copy(),
                keys,
                np.arange(count, count + len(rows)),
            )
        )
        return None

    def _digests(self, registers: NDArray[np.int32]) -> NDArray[np.uint64]:
        """One number for each state, (S,): equal for equal states, else almost surely different."""
        return digests_of(self._relevance.of_rows(registers))

    def _choices_to(self, node: int, choice: int) -> list[int]:
        """What was chosen from the start on."""
        choices = [choice]
        while self._parents[node] >= 0:
            choices.append(self._choices[node])
            node = self._parents[node]
        return choices[::-1]

    def _plan(self, choices: list[int]) -> tuple[NDArray[np.int64], ...] | None:
        if any(one % self._chances.count != 0 for one in choices):
            return None
        return tuple(self._actions[one].copy() for one in choices)


class RandomActions:
    """Actions at random for several walks, of which some say more than others.

    Args:
        useful: the actions to choose from, int64 (A, 3 + slots).
        walks: how many walks there are.
    """

    def __init__(self, useful: NDArray[np.int64], walks: int) -> None:
        self._useful, self._generator = useful, np.random.default_rng(0)
        self._silent, self._said = (np.flatnonzero(useful[:, 1] == speaks) for speaks in (0, 1))
        self._spoken = np.array(_SPEECH)[np.arange(walks) % len(_SPEECH)]

    def next(self) -> NDArray[np.int64]:
        """An action of each walk, int64 (walks, 3 + slots)."""
        walks = len(self._spoken)
        actions: NDArray[np.int64] = self._useful[self._generator.choice(self._silent, walks)]
        if len(self._said):
            words = self._useful[self._generator.choice(self._said, walks), 1:]
            speaks = self._generator.random(walks) < self._spoken
            actions[speaks, 1:] = words[speaks]
        return actions

    def keep(self, walks: NDArray[np.intp]) -> None:
        """Leave out the other walks."""
        self._spoken = self._spoken[walks]


class Chances:
    """Which draws a search tries of each step: the episode's own first, then others, of which none falls alike.

    Args:
        program: what is played.
        relevance: what matters in it.
        drawn: whether anything that is drawn matters.
    """

    def __init__(self, program: Program, relevance: Relevance, drawn: bool) -> None:
        ways = CHANCES if relevance.choices is None else prod(count for _, count in relevance.choices)
        self.count = min(CHANCES, ways) if drawn else 1
        sites = sites_of(program)
        self._choices = [(*sites[site], count) for site, count in relevance.choices or ()]
        self._all = 1 < self.count == ways

    def marks(self, key: int, step: int) -> NDArray[np.uint64]:
        """What to change an episode's key by, (count,); the first changes nothing. `step` is that of the draws."""
        if not self._all or not self._choices:
            return marks(self.count)
        found: dict[tuple[int, ...], int] = {}
        for mark in marks(_TRIED).tolist():
            drawn = tuple(
                below(draw(key ^ mark, place, step, number), count) for place, number, count in self._choices
            )
            found.setdefault(drawn, mark)
        tried = [*found.values(), *[0] * self.count]
        return np.array(tried[: self.count], np.uint64)


def marks(chances: int) -> NDArray[np.uint64]:
    """What to change an episode's key by for other draws of the same step, (chances,); the first changes nothing."""
    return np.array([mix(k * GOLDEN) & MASK if k else 0 for k in range(chances)], np.uint64)


def digests_of(rows: NDArray[np.int32]) -> NDArray[np.uint64]:
    """One number for each row of int32 (S, N), uint64 (S,): equal for equal rows, else almost surely different."""
    in_a_word = 8 // rows.itemsize
    words = -(-rows.shape[1] // in_a_word)
    packed = np.empty((len(rows), in_a_word * words), rows.dtype)
    packed[:, : rows.shape[1]], packed[:, rows.shape[1] :] = rows, 0
    parts = packed.view(np.uint64) * multipliers(words)
    parts ^= parts >> np.uint64(32)
    parts *= multipliers(words + 1)[1:]
    digests: NDArray[np.uint64] = (parts ^ (parts >> np.uint64(29))).sum(axis=1, dtype=np.uint64)
    return digests


@cache
def multipliers(count: int) -> NDArray[np.uint64]:
    """Odd numbers that digests are made with."""
    drawn = np.random.default_rng(0).integers(0, 1 << 63, count, np.uint64)
    return drawn * np.uint64(2) + np.uint64(1)


def useful_actions(program: Program, whole_utterance: bool) -> NDArray[np.int64]:
    """Every body action with silence and with one utterance of each class, or with every one, int64 (A, 3 + slots)."""
    h = program.header
    start, nouns = h(Header.CLASS_AT), h(Header.NOUNS)
    classes = program.words[start : start + h(Header.TEMPLATES) * nouns]
    pairs = np.array([template * nouns + filling for template, filling in program.sentences.pairs()])
    pairs = pairs if whole_utterance else pairs[np.unique(classes[pairs], return_index=True)[1]]
    heads = program.sentences.heads
    said = [(0, *heads(0, -1)), *((1, *heads(int(pair) // nouns, int(pair) % nouns)) for pair in pairs)]
    return np.array([(body, *words) for body in range(h(Header.PRIMITIVES) + 1) for words in said], np.int64)


def _joined(layers: list[_Layer], empty_like: _Layer) -> _Layer:
    if not layers:
        return _Layer(*(array[:0] for array in vars(empty_like).values()))
    return _Layer(
        *(np.concatenate(arrays) for arrays in zip(*(vars(one).values() for one in layers), strict=True))
    )
