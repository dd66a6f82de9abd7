"""Rooms that differ in any number of draws and look alike so far: many are drawn, and grouped by what was perceived.

Rooms that differ in one draw say nothing of designs in which draws are balanced against each other, as where the colour
and the side of what is right are drawn apart: with another side the picture differs, and so it does with another
colour, but not with both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.analysis.rooms import DrawnRooms, Plan
from socialai_dsl.analysis.search import digests_of, multipliers
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.program import Program, Register

ROOMS: Final = 4096
"""How many rooms are drawn to find some that look alike, at least."""


def many_rooms(program: Program, rooms: int, seed: int) -> DrawnRooms:
    """As many rooms of a seed as are drawn to compare them; those that cannot be drawn have ended."""
    return DrawnRooms.numbered(program, max(rooms, ROOMS), seed, all_possible=False)


def like_first(table: Table, size: int | None = None) -> NDArray[np.bool_]:
    """Whether each row of a group shows the same and sounds the same as its first, bool (groups, size).

    Args:
        table: the rows.
        size: how many rows, one after the other, are a group; None: all are one.
    """
    state, size = table.state, size or table.rows
    same = np.ones((table.rows // size, size), np.bool_)
    for array in (state.image, state.extra, state.tokens):
        grouped = array.reshape(*same.shape, -1)
        same &= (grouped == grouped[:, :1]).all(axis=2)
    return same


def pairs_alike(table: Table) -> NDArray[np.bool_]:
    """Whether rows 2k and 2k + 1 show the same and sound the same, (pairs,)."""
    return like_first(table, 2)[:, 1]


def perceived_so_far(table: Table) -> NDArray[np.uint64]:
    """A number for what each row shows and has heard, uint64 (rows,): equal for equal ones, else almost surely not."""
    state = table.state
    parts = [digests_of(np.ascontiguousarray(part)) for part in (state.image, state.extra, state.tokens)]
    return _mixed(parts)


def _mixed(parts: Sequence[NDArray[np.uint64]]) -> NDArray[np.uint64]:
    mixed = np.zeros_like(parts[0])
    for part, multiplier in zip(parts, multipliers(len(parts)), strict=True):
        mixed = (mixed ^ (mixed >> np.uint64(31))) + part * multiplier
    return mixed


@dataclass(frozen=True)
class Division:
    """Rooms in which a script acts otherwise although all that it has perceived and done so far is alike.

    Attributes:
        rooms: two of them, the lowest numbers of either way to act. step: in which it acts otherwise, from 1.
        others: the numbers of all.
    """

    rooms: tuple[int, int]
    step: int
    others: tuple[int, ...]

    def __str__(self) -> str:
        """In words: "rooms 7 and 1203 look and sound alike till step 9, in which it acts otherwise"."""
        first, second = self.rooms
        return f"rooms {first} and {second} look and sound alike till step {self.step}, in which it acts otherwise"


def divided(program: Program, rooms: int, seed: int) -> tuple[int, list[Division]]:
    """Let a script play rooms of a seed, and look for rooms that it has to treat alike and does not.

    Args:
        program: of a scenario with a frame for the agent.
        rooms: the rooms 0, 1, ... that matter; more are drawn beside them.
        seed: of the rooms.

    Returns:
        In how many groups of rooms that look alike the script had to decide, in the step with most groups; and where it
        failed to decide alike.
    """
    drawn = many_rooms(program, rooms, seed)
    table = drawn.table
    history = perceived_so_far(table)
    divisions: list[Division] = []
    most, step = 0, 0
    while True:
        going = _in_company(table, history)
        if not len(going):
            return most, divisions
        step += 1
        actions = without_unsaid(table.scripted_actions())
        acts = digests_of(np.ascontiguousarray(actions))
        groups, group_of = np.unique(history[going], return_inverse=True)
        most = max(most, len(groups))
        first = np.full(len(groups), -1)
        first[group_of[::-1]] = going[::-1]  # the lowest number of each
        otherwise = acts[going] != acts[first[group_of]]
        for group in np.unique(group_of[otherwise]).tolist():
            second = int(going[otherwise & (group_of == group)].min())
            members = tuple(going[group_of == group].tolist())
            divisions.append(Division((int(first[group]), second), step, members))
        drawn.do(actions)
        history = _mixed([history, acts, perceived_so_far(table)])
        # Those that were treated otherwise have been reported.
        table.state.registers[going[np.isin(group_of, group_of[otherwise])], Register.ENDED] = 1


def without_unsaid(actions: NDArray[np.int64]) -> NDArray[np.int64]:
    """Actions, int64 (rows, 3 + slots), without the template and the words where nothing is said."""
    told = actions.copy()
    told[told[:, 1] == 0, 1:] = 0
    return told


def _in_company(table: Table, history: NDArray[np.uint64]) -> NDArray[np.intp]:
    """The rows that go on and are not alone with what they have perceived; the others end."""
    ended = table.state.registers[:, Register.ENDED]
    going = np.flatnonzero(ended == 0)
    _, group_of, counts = np.unique(history[going], return_inverse=True, return_counts=True)
    alone = counts[group_of] == 1
    ended[going[alone]] = 1
    company: NDArray[np.intp] = going[~alone]
    return company


class Lookalikes:
    """Draws rooms once, to find for any of them those that look like it while a plan is followed.

    Args:
        program: what is played. rooms, seed: the rooms 0, 1, ... that matter; more are drawn beside them.
    """

    def __init__(self, program: Program, rooms: int, seed: int) -> None:
        self._rooms = many_rooms(program, rooms, seed)
        self._drawn = ~self._rooms.ended
        self._perceived = perceived_so_far(self._rooms.table)
        self._relevant = digests_of(Relevance.of(program).of_rows(self._rooms.table.state.registers))

    def followed(self, room: int, plan: Plan) -> tuple[list[int], list[int]]:
        """The other rooms that look like a room for as long as a plan is followed that solves it.

        Rooms that begin alike in all that matters are left out.

        Returns:
            Those that the plan solves as well, and those that it does not.
        """
        same = (self._perceived == self._perceived[room]) & (self._relevant != self._relevant[room])
        others = np.flatnonzero(same & self._drawn)
        if not len(others):
            return [], []
        table = self._rooms.table
        self._rooms.restart([room, *others.tolist()])
        solved: list[int] = []
        failed: list[int] = []
        for action in plan:
            self._rooms.do(action)
            ended, won = self._rooms.ended, self._rooms.won[others]
            over = ended[others] | ended[room]
            solved += others[over & won].tolist()
            failed += others[over & ~won].tolist()
            perceived = perceived_so_far(table)
            told_apart = perceived[others] != perceived[room]
            table.state.registers[others[told_apart], Register.ENDED] = 1
            others = others[~over & ~told_apart]
            if not len(others):
                break
        return solved, failed

    def start(self, room: int) -> Start:
        """How a room begins."""
        return self._rooms.start(room)
